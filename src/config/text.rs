//! Configuration files: TOML with a comment per value, written and read.

use std::fmt::Write as _;

use toml::de::{DeTable, DeValue};

use super::{Configuration, MOST_MAP_MB};
use crate::parameter::{Problem, Profile, Value};

/// What is wrong with a configuration file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ConfigError {
    /// It is not TOML.
    #[error("line {line}: {message}")]
    Syntax {
        /// Counted from 1.
        line: usize,
        /// What the parser says.
        message: String,
    },
    /// A name that does not exist.
    #[error("line {line}: there is no {what} \"{name}\"; there are {known}")]
    Unknown {
        /// Counted from 1.
        line: usize,
        /// Section or parameter.
        what: &'static str,
        /// What was written.
        name: String,
        /// What could have been.
        known: String,
    },
    /// A name of something else.
    #[error("line {line}: \"{name}\" is a section, written [{name}], not a value")]
    NotASection {
        /// Counted from 1.
        line: usize,
        /// What was given a value.
        name: String,
    },
    /// A value above another one that it may not exceed.
    #[error("line {line}: {low_name} = {low} is above {high_name} = {high}")]
    Contradiction {
        /// Counted from 1; of the later one of the two.
        line: usize,
        /// Section and name of the one.
        low_name: &'static str,
        /// Its value.
        low: Value,
        /// Section and name of the other.
        high_name: &'static str,
        /// Its value.
        high: Value,
    },
    /// A map that no computer should keep.
    #[error(
        "line {line}: a map with grid.cell_m = {cell_m} and grid.keep_m = {keep_m} takes up to {mb:.0} MB, at most {MOST_MAP_MB} are allowed"
    )]
    TooLarge {
        /// Counted from 1; of the later one of the two.
        line: usize,
        /// Side of a cell.
        cell_m: f64,
        /// How far it is kept.
        keep_m: f64,
        /// What it takes.
        mb: f64,
    },
    /// A value that cannot be.
    #[error("line {line}: {section}.{key}: {problem}")]
    Value {
        /// Counted from 1.
        line: usize,
        /// Section of the parameter.
        section: &'static str,
        /// Name of the parameter.
        key: &'static str,
        /// What is wrong with it.
        problem: Problem,
    },
}

/// The whole configuration as TOML; [`parse`] gives it back.
pub fn print(configuration: &Configuration) -> String {
    let mut out = String::new();
    let _ = writeln!(
        out,
        "# Where values come from that are not given here: default, thesis."
    );
    let _ = writeln!(out, "profile = \"{}\"", configuration.profile.name());
    for section in configuration.sections() {
        let _ = writeln!(out);
        comment(&mut out, section.meaning());
        let _ = writeln!(out, "[{}]", section.name());
        for (index, parameter) in section.descriptions().iter().enumerate() {
            let _ = writeln!(out);
            comment(&mut out, parameter.meaning);
            let unit = match parameter.unit {
                "" => String::new(),
                unit => format!("Unit: {unit}. "),
            };
            let _ = writeln!(out, "# {unit}Range: {}.", parameter.domain);
            let _ = writeln!(out, "{} = {}", parameter.key, section.get(index));
        }
    }
    out
}

fn comment(out: &mut String, lines: &[&str]) {
    for line in lines {
        let _ = writeln!(out, "#{line}");
    }
}

/// Reads a configuration. Values that are not given come from the named profile.
///
/// # Errors
/// [`ConfigError`] with the line of the first thing that is wrong.
pub fn parse(text: &str) -> Result<Configuration, ConfigError> {
    let document = DeTable::parse(text).map_err(|error| ConfigError::Syntax {
        line: line_of(text, error.span().map_or(0, |span| span.start)),
        message: error.message().replace('\n', " "),
    })?;
    let mut configuration = Configuration::profile(profile(text, document.get_ref())?);
    for (name, content) in document.get_ref() {
        let line = line_of(text, name.span().start);
        let name = name.get_ref().as_ref();
        if name != "profile" {
            read_section(text, &mut configuration, line, name, content.get_ref())?;
        }
    }
    check(text, document.get_ref(), &configuration)?;
    Ok(configuration)
}

fn profile(text: &str, document: &DeTable<'_>) -> Result<Profile, ConfigError> {
    let Some(value) = document.get("profile") else {
        return Ok(Profile::Default);
    };
    let written = plain(value.get_ref());
    Profile::ALL
        .into_iter()
        .find(|profile| written == Value::Text(profile.name().into()))
        .ok_or_else(|| ConfigError::Unknown {
            line: line_of(text, value.span().start),
            what: "profile",
            name: written.to_string().trim_matches('"').into(),
            known: Profile::ALL.map(Profile::name).join(", "),
        })
}

fn read_section(
    text: &str,
    configuration: &mut Configuration,
    line: usize,
    name: &str,
    content: &DeValue<'_>,
) -> Result<(), ConfigError> {
    let known = configuration.sections().map(|section| section.name());
    let section = configuration
        .sections_mut()
        .into_iter()
        .find(|section| section.name() == name);
    let Some(section) = section else {
        return Err(ConfigError::Unknown {
            line,
            what: "section",
            name: name.into(),
            known: known.join(", "),
        });
    };
    let DeValue::Table(table) = content else {
        return Err(ConfigError::NotASection {
            line,
            name: name.into(),
        });
    };
    let descriptions = section.descriptions();
    for (key, value) in table {
        let (key_line, value_line) = (
            line_of(text, key.span().start),
            line_of(text, value.span().start),
        );
        let found = descriptions
            .iter()
            .position(|parameter| parameter.key == key.get_ref().as_ref());
        let index = found.ok_or_else(|| ConfigError::Unknown {
            line: key_line,
            what: "parameter",
            name: format!("{name}.{}", key.get_ref()),
            known: descriptions
                .iter()
                .map(|parameter| parameter.key)
                .collect::<Vec<_>>()
                .join(", "),
        })?;
        section
            .set(index, plain(value.get_ref()))
            .map_err(|problem| ConfigError::Value {
                line: value_line,
                section: section.name(),
                key: descriptions[index].key,
                problem,
            })?;
    }
    Ok(())
}

/// Checks what parameters ask of each other.
fn check(
    text: &str,
    document: &DeTable<'_>,
    configuration: &Configuration,
) -> Result<(), ConfigError> {
    // A profile holds: at least one of two that do not is given.
    let line = |names: [&str; 2]| {
        let given = names.iter().filter_map(|name| {
            let (section, key) = name.split_once('.')?;
            let DeValue::Table(table) = document.get(section)?.get_ref() else {
                return None;
            };
            let (key, _) = table.get_key_value(key)?;
            Some(line_of(text, key.span().start))
        });
        given.max().unwrap_or(1)
    };
    let value = |name| configuration.value(name).unwrap_or(Value::Bool(false));
    if let Some([low, high]) = configuration.contradiction() {
        return Err(ConfigError::Contradiction {
            line: line([low, high]),
            low_name: low,
            low: value(low),
            high_name: high,
            high: value(high),
        });
    }
    let grid = &configuration.grid;
    if grid.most_mb() > MOST_MAP_MB {
        return Err(ConfigError::TooLarge {
            line: line(["grid.cell_m", "grid.keep_m"]),
            cell_m: grid.cell_m,
            keep_m: grid.keep_m,
            mb: grid.most_mb(),
        });
    }
    Ok(())
}

/// A TOML value in our terms; what no parameter can be becomes a word that says so.
fn plain(value: &DeValue<'_>) -> Value {
    let number = |digits: &str| digits.parse::<f64>().ok();
    match value {
        DeValue::Boolean(value) => Value::Bool(*value),
        DeValue::String(value) => Value::Text(value.to_string()),
        DeValue::Integer(value) => i64::from_str_radix(value.as_str(), value.radix())
            .map_or_else(|_| Value::Text(value.to_string()), Value::Integer),
        DeValue::Float(value) => number(value.as_str())
            .filter(|value| value.is_finite())
            .map_or_else(|| Value::Text(value.to_string()), Value::Real),
        DeValue::Array(_) => Value::Text("a list".into()),
        DeValue::Table(_) => Value::Text("a table".into()),
        DeValue::Datetime(value) => Value::Text(value.to_string()),
    }
}

fn line_of(text: &str, offset: usize) -> usize {
    let offset = offset.min(text.len());
    1 + text.as_bytes()[..offset]
        .iter()
        .filter(|byte| **byte == b'\n')
        .count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_printed_is_read_back_unchanged() {
        for profile in Profile::ALL {
            let configuration = Configuration::profile(profile);
            assert_eq!(parse(&print(&configuration)), Ok(configuration));
        }
    }

    #[test]
    fn a_wrong_value_is_named_with_line_range_and_unit() {
        let error = parse("[session]\n# far\nttl = 300\n").unwrap_err();
        assert_eq!(
            error.to_string(),
            "line 3: session.ttl: 300 is outside 0 to 255 hops"
        );
        let error = parse("[session]\nttl = -1\n").unwrap_err();
        assert_eq!(
            error.to_string(),
            "line 2: session.ttl: -1 is outside 0 to 255 hops"
        );
        let error = parse("[session]\nreceive_buffer_mb = nan\n").unwrap_err();
        assert!(
            error
                .to_string()
                .starts_with("line 2: session.receive_buffer_mb: \"nan\"")
        );
    }

    #[test]
    fn unknown_names_are_answered_with_the_known_ones() {
        let error = parse("\n[sesion]\nttl = 1\n").unwrap_err().to_string();
        assert!(
            error.starts_with("line 2: there is no section \"sesion\""),
            "{error}"
        );
        let error = parse("[session]\nhops = 1\n").unwrap_err().to_string();
        assert!(
            error.contains("there is no parameter \"session.hops\"; there are ttl"),
            "{error}"
        );
        let error = parse("profile = \"fast\"").unwrap_err().to_string();
        assert!(error.contains("there is no profile \"fast\""), "{error}");
    }

    #[test]
    fn bounds_the_wrong_way_round_are_refused_where_the_second_is_given() {
        let error = parse("[ground]\nheight_high_m = 1.0\n# low\nheight_low_m = 2\n").unwrap_err();
        assert_eq!(
            error.to_string(),
            "line 4: ground.height_low_m = 2.0 is above ground.height_high_m = 1.0"
        );
        let error = parse("[cloud]\nminimum_range_m = 3\nmaximum_range_m = 2.0\n").unwrap_err();
        assert_eq!(
            error.to_string(),
            "line 3: cloud.minimum_range_m = 3.0 is above cloud.maximum_range_m = 2.0"
        );
    }

    #[test]
    fn values_of_different_sections_that_contradict_each_other_are_named_both() {
        let error = parse("[cluster]\nhighest_m = 1\n[track]\nlowest_object_m = 2\n").unwrap_err();
        assert_eq!(
            error.to_string(),
            "line 4: track.lowest_object_m = 2.0 is above cluster.highest_m = 1.0"
        );
        let error = parse("[grid]\nkeep_m = 40.0\n").unwrap_err();
        assert_eq!(
            error.to_string(),
            "line 2: grid.reach_m = 50.0 is above grid.keep_m = 40.0"
        );
    }

    #[test]
    fn a_map_that_is_too_large_is_refused() {
        let error = parse("[grid]\ncell_m = 0.05\nkeep_m = 1000\n").unwrap_err();
        assert_eq!(
            error.to_string(),
            "line 3: a map with grid.cell_m = 0.05 and grid.keep_m = 1000 takes up to 4800 MB, at most 2000 are allowed"
        );
    }

    #[test]
    fn a_section_that_is_given_a_value_is_told_how_it_is_written() {
        let error = parse("cloud = 3\n").unwrap_err().to_string();
        assert_eq!(
            error,
            "line 1: \"cloud\" is a section, written [cloud], not a value"
        );
    }

    #[test]
    fn a_syntax_error_names_its_line() {
        let error = parse("[session]\nttl == 1\n").unwrap_err();
        assert!(error.to_string().starts_with("line 2: "), "{error}");
    }
}
