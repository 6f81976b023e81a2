//! Files in and out, with errors that name them, and progress.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, anyhow, bail};
use indicatif::{ProgressBar, ProgressStyle};

use super::Completion;
use super::capture::{self, Capture};
use crate::config::{Configuration, text};
use crate::wire::recording::Damage;

/// A whole file.
pub(super) fn read(path: &Path) -> Result<Vec<u8>> {
    std::fs::read(path).with_context(|| path.display().to_string())
}

/// What is read as a recording; which it is, is found from its first bytes.
pub(super) enum Recorded {
    /// Frames end to end.
    Recording(Vec<u8>),
    /// Packets of a VLP-16.
    Capture(Capture),
}

impl Recorded {
    /// Reads a file. What of a capture could not be read is said.
    pub(super) fn read(path: &Path) -> Result<Self> {
        let bytes = read(path)?;
        if !capture::is_capture(&bytes) {
            return Ok(Self::Recording(bytes));
        }
        let capture = Capture::read(path, &bytes)?;
        capture.warn(path);
        Ok(Self::Capture(capture))
    }

    /// The recording, of which a capture's packets are messages; and whether all of it could be read.
    pub(super) fn with_packets(self) -> (Vec<u8>, Completion) {
        match self {
            Self::Recording(bytes) => (bytes, Completion::Done),
            Self::Capture(capture) => (capture.recording(), capture.completion()),
        }
    }

    /// The recording, in which a capture's packets are the point clouds that a device service would make of them; and
    /// whether all of it could be read.
    pub(super) fn with_clouds(self, path: &Path) -> (Vec<u8>, Completion) {
        match self {
            Self::Recording(bytes) => (bytes, Completion::Done),
            Self::Capture(capture) => {
                let clouds = capture.clouds(0);
                clouds.warn(path);
                let completion = capture.completion().and(clouds.completion());
                (clouds.whole_revolutions(), completion)
            }
        }
    }
}

/// The configuration in a file, or the default one.
pub(super) fn configuration(path: Option<&Path>) -> Result<Configuration> {
    let Some(path) = path else {
        return Ok(Configuration::default());
    };
    let content = String::from_utf8(read(path)?).map_err(|error| {
        let byte = error.utf8_error().valid_up_to();
        anyhow!("{}: byte {byte} is not UTF-8 text", path.display())
    })?;
    text::parse(&content).with_context(|| path.display().to_string())
}

/// Refuses to write over what is read.
pub(super) fn check_distinct(input: &Path, outputs: &[Option<&PathBuf>]) -> Result<()> {
    let Ok(input) = input.canonicalize() else {
        return Ok(());
    };
    for output in outputs.iter().copied().flatten() {
        if output.canonicalize().is_ok_and(|output| output == input) {
            bail!("{}: is the input, and would be lost", output.display());
        }
    }
    Ok(())
}

/// A file that is written, whose errors name it.
#[derive(Debug)]
pub(super) struct Output {
    path: PathBuf,
    writer: BufWriter<File>,
}

impl Output {
    /// Makes the file, or empties it.
    pub(super) fn create(path: &Path) -> Result<Self> {
        let file = File::create(path).with_context(|| path.display().to_string())?;
        Ok(Self {
            path: path.into(),
            writer: BufWriter::new(file),
        })
    }

    /// The same where a path may be left out.
    pub(super) fn create_if(path: Option<&Path>) -> Result<Option<Self>> {
        path.map(Self::create).transpose()
    }

    pub(super) fn put(&mut self, bytes: &[u8]) -> Result<()> {
        let result = self.writer.write_all(bytes);
        result.with_context(|| self.path.display().to_string())
    }

    /// Sees to it that everything is written.
    pub(super) fn finish(mut self) -> Result<()> {
        let result = self.writer.flush();
        result.with_context(|| self.path.display().to_string())
    }

    /// The file itself, for writers that seek.
    pub(super) fn into_file(self) -> Result<File> {
        let path = self.path;
        let file = self.writer.into_inner();
        file.map_err(|error| error.into_error())
            .with_context(|| path.display().to_string())
    }
}

/// A progress bar on a terminal, nothing in a pipe.
pub(super) fn progress(length: usize, unit: &str) -> ProgressBar {
    let bar = ProgressBar::new(length as u64);
    let template = if unit == "bytes" {
        "{bar:40} {bytes}/{total_bytes} {eta}".into()
    } else {
        format!("{{bar:40}} {{pos}}/{{len}} {unit} {{eta}}")
    };
    if let Ok(style) = ProgressStyle::with_template(&template) {
        bar.set_style(style);
    }
    bar
}

/// Says what is damaged in a file, in one line.
pub(super) fn report_damage(path: &Path, damage: &Damage) {
    tell!(
        "kreisel: {}: {}; {} bytes skipped",
        path.display(),
        damage.error,
        damage.skipped
    );
}
