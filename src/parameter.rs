//! The table form in which each stage declares its parameters once, with both profiles' values,
//! range, unit and meaning. Printing, reading and checking follow from it.

mod settings;

use std::fmt;

pub use settings::{Addresses, Text};

/// Where values come from that nobody set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Profile {
    /// The best that has been measured.
    Default,
    /// The thesis' algorithm with the thesis' numbers (Scholle 2017).
    Thesis,
}

impl Profile {
    /// All of them.
    pub const ALL: [Profile; 2] = [Profile::Default, Profile::Thesis];

    /// The name in configuration files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Default => "default",
            Self::Thesis => "thesis",
        }
    }
}

/// A parameter's value in the terms of a configuration file.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// `true` or `false`.
    Bool(bool),
    /// A whole number.
    Integer(i64),
    /// A number.
    Real(f64),
    /// A word.
    Text(String),
}

impl Value {
    /// It as a number, if it is one.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Integer(value) => Some(*value as f64),
            Self::Real(value) => Some(*value),
            Self::Bool(_) | Self::Text(_) => None,
        }
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bool(value) => write!(f, "{value}"),
            Self::Integer(value) => write!(f, "{value}"),
            Self::Real(value) => write!(f, "{value:?}"),
            Self::Text(value) => write!(f, "{value:?}"),
        }
    }
}

/// What a file says about one parameter.
#[derive(Debug, Clone, Copy)]
pub struct Description {
    /// Name in the file.
    pub key: &'static str,
    /// What it means and what follows from it, a line of the declaration each.
    pub meaning: &'static [&'static str],
    /// Unit, or empty.
    pub unit: &'static str,
    /// What it may be.
    pub domain: Domain,
}

/// What a parameter may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Domain {
    /// `true` or `false`.
    Switch,
    /// A whole number within bounds, both included.
    Whole(f64, f64),
    /// A number within bounds, both included.
    Real(f64, f64),
    /// One of these words.
    Choice(&'static [&'static str]),
    /// Addresses of hosts.
    Addresses,
    /// Any text.
    Text,
}

impl fmt::Display for Domain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Switch => write!(f, "true or false"),
            Self::Whole(low, high) if *high >= i64::MAX as f64 => write!(f, "{low} or more"),
            Self::Whole(low, high) | Self::Real(low, high) => write!(f, "{low} to {high}"),
            Self::Choice(names) => write!(f, "{}", names.join(", ")),
            Self::Addresses => write!(f, "IPv4 addresses with commas between them"),
            Self::Text => write!(f, "a text"),
        }
    }
}

/// Why a value cannot be a parameter's.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Problem {
    /// Of the right type, but too small or too large.
    #[error("{value} is outside {domain}{}", spaced(.unit))]
    OutOfRange {
        /// What was given.
        value: Value,
        /// What may be given.
        domain: Domain,
        /// Its unit.
        unit: &'static str,
    },
    /// Of another type, or not one of the words.
    #[error("{value} is not {}", wanted(.domain, .unit))]
    WrongType {
        /// What was given.
        value: Value,
        /// What may be given.
        domain: Domain,
        /// Its unit.
        unit: &'static str,
    },
}

fn spaced(unit: &str) -> String {
    if unit.is_empty() {
        String::new()
    } else {
        format!(" {unit}")
    }
}

fn wanted(domain: &Domain, unit: &str) -> String {
    match domain {
        Domain::Switch => "true or false".into(),
        Domain::Whole(..) => format!("a whole number, {domain}{}", spaced(unit)),
        Domain::Real(..) => format!("a number, {domain}{}", spaced(unit)),
        Domain::Choice(_) => format!("one of {domain}"),
        Domain::Addresses | Domain::Text => domain.to_string(),
    }
}

/// A group of parameters that belong to one stage.
pub trait Section {
    /// Its heading in the file.
    fn name(&self) -> &'static str;
    /// What the stage is.
    fn meaning(&self) -> &'static [&'static str];
    /// Its parameters in the order of declaration.
    fn descriptions(&self) -> Vec<Description>;
    /// The value of a parameter by its place in [`Section::descriptions`].
    fn get(&self, index: usize) -> Value;
    /// Sets a parameter by its place in [`Section::descriptions`].
    ///
    /// # Errors
    /// [`Problem`] when the value is of another type or out of range.
    fn set(&mut self, index: usize, value: Value) -> Result<(), Problem>;
}

/// A type that a parameter may have.
pub trait Setting: Sized {
    /// What values of the type may be, given the declared bounds.
    fn domain(bounds: Option<(f64, f64)>) -> Domain;
    /// As a file writes it.
    fn to_value(&self) -> Value;
    /// From what a file says, if the type fits.
    fn from_value(value: &Value) -> Option<Self>;
    /// The number that bounds apply to.
    fn number(&self) -> Option<f64> {
        None
    }
}

/// Parses and checks one value.
pub fn parse<T: Setting>(
    value: Value,
    bounds: Option<(f64, f64)>,
    unit: &'static str,
) -> Result<T, Problem> {
    let domain = T::domain(bounds);
    let Some(setting) = T::from_value(&value) else {
        // A negative whole number is out of range, not of another type.
        return Err(match (&value, domain) {
            (Value::Integer(_), Domain::Whole(..)) => Problem::OutOfRange {
                value,
                domain,
                unit,
            },
            _ => Problem::WrongType {
                value,
                domain,
                unit,
            },
        });
    };
    let inside = match (setting.number(), bounds) {
        (Some(number), Some((low, high))) => (low..=high).contains(&number),
        _ => true,
    };
    if inside {
        Ok(setting)
    } else {
        Err(Problem::OutOfRange {
            value,
            domain,
            unit,
        })
    }
}

/// Declares a parameter struct: meaning, `name: type = default, thesis value, in range, "unit";`.
/// `thesis` may be left out where both profiles agree.
macro_rules! parameters {
    (
        $(#[doc = $section_doc:literal])*
        pub struct $name:ident $section:literal {
            $(
                $(#[doc = $doc:literal])*
                $field:ident: $type:ty = $default:expr
                    $(, thesis $thesis:expr)?
                    $(, in $low:literal ..= $high:literal)?
                    , $unit:literal;
            )*
        }
    ) => {
        $(#[doc = $section_doc])*
        #[derive(Debug, Clone, PartialEq)]
        pub struct $name {
            $( $(#[doc = $doc])* #[doc = concat!("\nUnit: ", $unit)] pub $field: $type, )*
        }

        impl $name {
            /// The values of a built-in profile.
            #[allow(unused_mut, unused_assignments, clippy::allow_attributes)]
            pub fn profile(profile: $crate::parameter::Profile) -> Self {
                let thesis = profile == $crate::parameter::Profile::Thesis;
                Self {
                    $( $field: {
                        let mut value: $type = $default;
                        $( if thesis { value = $thesis; } )?
                        let _ = thesis;
                        value
                    }, )*
                }
            }
        }

        impl $crate::parameter::Section for $name {
            fn name(&self) -> &'static str {
                $section
            }

            fn meaning(&self) -> &'static [&'static str] {
                &[$($section_doc),*]
            }

            fn descriptions(&self) -> Vec<$crate::parameter::Description> {
                vec![$( $crate::parameter::Description {
                    key: stringify!($field),
                    meaning: &[$($doc),*],
                    unit: $unit,
                    domain: <$type as $crate::parameter::Setting>::domain(
                        $crate::parameter::parameters!(@bounds $($low, $high)?)
                    ),
                }, )*]
            }

            fn get(&self, index: usize) -> $crate::parameter::Value {
                [$( $crate::parameter::Setting::to_value(&self.$field), )*][index].clone()
            }

            #[allow(unused_assignments, clippy::allow_attributes)]
            fn set(
                &mut self,
                index: usize,
                value: $crate::parameter::Value,
            ) -> Result<(), $crate::parameter::Problem> {
                let mut position = 0;
                $(
                    if index == position {
                        self.$field = $crate::parameter::parse(
                            value,
                            $crate::parameter::parameters!(@bounds $($low, $high)?),
                            $unit,
                        )?;
                        return Ok(());
                    }
                    position += 1;
                )*
                Ok(())
            }
        }
    };
    (@bounds) => { None };
    (@bounds $low:literal, $high:literal) => { Some((f64::from($low), f64::from($high))) };
}
pub(crate) use parameters;

/// Declares an enum whose variants are words in a configuration file.
macro_rules! choices {
    (
        $(#[$meta:meta])*
        pub enum $name:ident { $( $(#[$variant_meta:meta])* $variant:ident = $word:literal, )* }
    ) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum $name { $( $(#[$variant_meta])* $variant, )* }

        impl $crate::parameter::Setting for $name {
            fn domain(_bounds: Option<(f64, f64)>) -> $crate::parameter::Domain {
                $crate::parameter::Domain::Choice(&[$($word),*])
            }

            fn to_value(&self) -> $crate::parameter::Value {
                let word = match self { $( Self::$variant => $word, )* };
                $crate::parameter::Value::Text(word.into())
            }

            fn from_value(value: &$crate::parameter::Value) -> Option<Self> {
                match value {
                    $crate::parameter::Value::Text(word) => match word.as_str() {
                        $( $word => Some(Self::$variant), )*
                        _ => None,
                    },
                    _ => None,
                }
            }
        }
    };
}
pub(crate) use choices;
