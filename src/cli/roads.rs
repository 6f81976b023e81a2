//! Maps of roads as files: which format it is, is found from the bytes.

use std::path::Path;

use anyhow::{Context as _, Result, anyhow, bail};
use miniz_oxide::inflate::{TINFLStatus, decompress_to_vec_with_limit};
use rawzip::{CompressionMethod, ZipArchive};

use super::files;
use crate::config::Configuration;
use crate::ego::geodesy::Geodetic;
use crate::parameter::Text;
use crate::roadmap::{Origin, Roadmap, osm, roundabouts, scn};

/// What a scenario archive's text may grow to: a map of a city has a tenth.
const LARGEST_SCENARIO: usize = 256 << 20;
/// The scenario in an archive.
const SCENARIO_NAME: &str = "scenario.scn";

/// Reads a scenario, an archive with one, or an extract of OpenStreetMap. An origin that is given
/// takes the place of the file's.
pub(super) fn read(path: &Path, origin: Option<Geodetic>) -> Result<Roadmap> {
    let bytes = files::read(path)?;
    parse(&bytes, origin).with_context(|| path.display().to_string())
}

fn parse(bytes: &[u8], origin: Option<Geodetic>) -> Result<Roadmap> {
    if bytes.starts_with(b"PK\x03\x04") {
        return scenario(&unpacked(bytes)?, origin);
    }
    let text = String::from_utf8_lossy(bytes);
    let is_xml = text
        .trim_start_matches('\u{feff}')
        .trim_start()
        .starts_with('<');
    if is_xml {
        return Ok(osm::read(&text, origin)?);
    }
    scenario(&text, origin)
}

fn scenario(text: &str, origin: Option<Geodetic>) -> Result<Roadmap> {
    let mut map = scn::read(text)?;
    if let Some(place) = origin {
        let rotation_rad = map.origin.map_or(0.0, |origin| origin.rotation_rad);
        map.origin = Some(Origin {
            place,
            rotation_rad,
            is_longitude_first: false,
        });
    }
    Ok(map)
}

fn unpacked(bytes: &[u8]) -> Result<String> {
    let damaged = "a damaged archive";
    let archive = ZipArchive::from_slice(bytes).context(damaged)?;
    let (mut entries, mut found) = (archive.entries(), None);
    while let Some(entry) = entries.next_entry().context(damaged)? {
        let name = String::from_utf8_lossy(entry.file_path().as_bytes()).into_owned();
        let is_usual = name == SCENARIO_NAME;
        if is_usual || (found.is_none() && name.to_lowercase().ends_with(".scn")) {
            found = Some((name, entry));
        }
        if is_usual {
            break;
        }
    }
    let (name, entry) = found.ok_or_else(|| anyhow!("an archive without {SCENARIO_NAME}"))?;
    let in_archive = || format!("{name} in the archive");
    let packed = archive
        .get_entry(entry.wayfinder())
        .with_context(in_archive)?;
    let content = match entry.compression_method() {
        CompressionMethod::STORE => packed.data().to_vec(),
        CompressionMethod::DEFLATE => inflated(packed.data()).with_context(in_archive)?,
        other => bail!(
            "{} is compressed by {other:?}, which is not read",
            in_archive()
        ),
    };
    let mut verified = packed.verifying_reader(content.as_slice());
    std::io::copy(&mut verified, &mut std::io::sink()).with_context(in_archive)?;
    Ok(String::from_utf8_lossy(&content).into_owned())
}

fn inflated(packed: &[u8]) -> Result<Vec<u8>> {
    decompress_to_vec_with_limit(packed, LARGEST_SCENARIO).map_err(|error| match error.status {
        TINFLStatus::HasMoreOutput => anyhow!("larger than {LARGEST_SCENARIO} bytes"),
        status => anyhow!("damaged: {status:?}"),
    })
}

/// The roads that a configuration names, if it does; a map on the command line takes its place.
pub(super) fn configured(
    configuration: &mut Configuration,
    map: Option<&Path>,
) -> Result<Option<Roadmap>> {
    if let Some(path) = map {
        configuration.roundabout.map = Text(path.display().to_string());
    }
    let Text(name) = &configuration.roundabout.map;
    if name.is_empty() {
        return Ok(None);
    }
    let found = read(Path::new(name), None)?;
    if roundabouts(&found).is_empty() {
        bail!("{name}: no roundabout is in it; `kreisel roundabout` says what is");
    }
    Ok(Some(found))
}

/// An origin on the command line: latitude and longitude.
pub(super) fn origin(text: &str) -> Result<Geodetic, String> {
    let degrees = |text: &str| text.trim().parse::<f64>().ok();
    text.split_once(',')
        .and_then(|(latitude, longitude)| degrees(latitude).zip(degrees(longitude)))
        .map(|(latitude_deg, longitude_deg)| Geodetic {
            latitude_deg,
            longitude_deg,
            altitude_m: 0.0,
        })
        .filter(Geodetic::is_valid)
        .ok_or_else(|| "latitude and longitude are wanted, as 57.77284,12.769964".to_owned())
}
