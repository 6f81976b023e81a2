//! Files in and out, with errors that name them.

use std::fs::{File, Metadata};
use std::io::{BufWriter, Write};
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, anyhow, bail};

use super::Completion;
use super::capture::Capture;
use crate::config::{Configuration, text};
use crate::wire::capture::is_capture;
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
        if !is_capture(&bytes) {
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
                (clouds.whole_revolutions().to_vec(), completion)
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

/// Refuses to write over what is read, and two outputs into one file.
pub(super) fn check_distinct(
    inputs: &[Option<&PathBuf>],
    outputs: &[Option<&PathBuf>],
) -> Result<()> {
    let inputs: Vec<_> = inputs.iter().copied().flatten().collect();
    let mut taken: Vec<&PathBuf> = vec![];
    for output in outputs.iter().copied().flatten() {
        if let Some(input) = inputs.iter().find(|input| are_one(input, output)) {
            bail!(
                "{}: is what is read from {}, and would be lost",
                output.display(),
                input.display()
            );
        }
        if taken.iter().any(|other| are_one(other, output)) {
            bail!("{}: would be written twice", output.display());
        }
        taken.push(output);
    }
    Ok(())
}

/// Whether two paths lead to one file, whether or not it is there.
fn are_one(one: &Path, other: &Path) -> bool {
    let place = |path: &Path| {
        let folder = match path.parent() {
            Some(folder) if folder != Path::new("") => folder,
            _ => Path::new("."),
        };
        path.canonicalize()
            .or_else(|_| {
                Ok::<_, std::io::Error>(
                    folder
                        .canonicalize()?
                        .join(path.file_name().unwrap_or_default()),
                )
            })
            .ok()
    };
    let file = |path: &Path| {
        let found = std::fs::metadata(path).ok().filter(Metadata::is_file)?;
        Some((found.dev(), found.ino()))
    };
    // Devices and pipes may be written to by many.
    let is_special = std::fs::metadata(one).is_ok_and(|found| !found.is_file());
    let is_same_place = place(one).is_some_and(|place_of_one| Some(place_of_one) == place(other));
    !is_special && (is_same_place || file(one).is_some_and(|found| Some(found) == file(other)))
}

/// A file that is written, whose errors name it. It is written beside its name and gets it when it is whole: what
/// stops half way leaves what was there before.
#[derive(Debug)]
pub(super) struct Output {
    path: PathBuf,
    writer: BufWriter<File>,
    /// Where it is written meanwhile, if that is elsewhere.
    beside: Option<PathBuf>,
}

impl Output {
    /// Makes the file.
    pub(super) fn create(path: &Path) -> Result<Self> {
        let named = || path.display().to_string();
        // What a link leads to is replaced, and not the link.
        let path = path.canonicalize().unwrap_or_else(|_| path.into());
        let is_special = std::fs::metadata(&path).is_ok_and(|found| !found.is_file());
        let beside = match path.file_name() {
            Some(name) if !is_special => {
                let name = format!(".{}.{}.part", name.display(), std::process::id());
                Some(path.with_file_name(name))
            }
            _ => None,
        };
        let file = File::create(beside.as_ref().unwrap_or(&path)).with_context(named)?;
        Ok(Self {
            path,
            writer: BufWriter::new(file),
            beside,
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

    /// Sees to it that everything is written, and gives the file its name.
    pub(super) fn finish(mut self) -> Result<()> {
        let renamed = self.writer.flush().and_then(|()| match &self.beside {
            Some(beside) => std::fs::rename(beside, &self.path),
            None => Ok(()),
        });
        if renamed.is_ok() {
            self.beside = None;
        }
        renamed.with_context(|| self.path.display().to_string())
    }
}

impl Drop for Output {
    fn drop(&mut self) {
        if let Some(beside) = &self.beside {
            // Nobody is left who could be told.
            let _ = std::fs::remove_file(beside);
        }
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.writer.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.writer.flush()
    }
}

// What writes MCAP files goes back to say how long a chunk became.
#[cfg(feature = "foxglove")]
impl std::io::Seek for Output {
    fn seek(&mut self, to: std::io::SeekFrom) -> std::io::Result<u64> {
        self.writer.seek(to)
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_finished_leaves_what_was_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.rec");
        std::fs::write(&path, "older").unwrap();
        let mut output = Output::create(&path).unwrap();
        output.put(b"half").unwrap();
        drop(output);
        assert_eq!(std::fs::read(&path).unwrap(), b"older");
        let mut output = Output::create(&path).unwrap();
        output.put(b"whole").unwrap();
        output.finish().unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"whole");
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1);
    }

    #[test]
    fn a_link_is_written_through() {
        let folder = tempfile::tempdir().unwrap();
        let [target, link] = ["target", "link"].map(|name| folder.path().join(name));
        std::fs::write(&target, "older").unwrap();
        std::os::unix::fs::symlink(&target, &link).unwrap();
        let mut output = Output::create(&link).unwrap();
        output.put(b"newer").unwrap();
        output.finish().unwrap();
        assert_eq!(std::fs::read(&target).unwrap(), b"newer");
        assert!(link.is_symlink());
    }

    #[test]
    fn one_file_by_two_names_is_found_before_anything_is_touched() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("in.rec"), "input").unwrap();
        std::fs::hard_link(path("in.rec"), path("hard")).unwrap();
        std::os::unix::fs::symlink(path("in.rec"), path("soft")).unwrap();
        let input = path("in.rec");
        let problem = |outputs: &[PathBuf]| {
            let outputs: Vec<_> = outputs.iter().map(Some).collect();
            check_distinct(&[Some(&input)], &outputs).map_err(|error| error.to_string())
        };
        for name in ["in.rec", "hard", "soft", "./in.rec"] {
            assert!(
                problem(&[path(name)])
                    .unwrap_err()
                    .contains("would be lost"),
                "{name}"
            );
        }
        let twice = [path("new"), path("other"), path("./new")];
        assert!(
            problem(&twice)
                .unwrap_err()
                .contains("would be written twice")
        );
        let null = PathBuf::from("/dev/null");
        assert_eq!(problem(&[path("new"), null.clone(), null]), Ok(()));
    }
}
