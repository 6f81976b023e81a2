//! `labels.npz`: one int32 array [columns][layers] a revolution, for numpy.

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use super::files::Output;
use crate::cloud::MAX_LAYERS;
use crate::cluster::Clusters;
use crate::pipeline::Pipeline;

const NO_RETURN: i32 = 0;
const GROUND: i32 = 1;
const NOISE: i32 = 2;
const FIRST_CLUSTER: i32 = 100;

/// Writes the archive revolution by revolution.
#[derive(Debug)]
pub(super) struct LabelWriter {
    path: PathBuf,
    archive: ZipWriter<BufWriter<File>>,
}

impl LabelWriter {
    pub(super) fn create(path: &Path) -> Result<Self> {
        let file = Output::create(path)?.into_file()?;
        Ok(Self {
            path: path.into(),
            archive: ZipWriter::new(BufWriter::new(file)),
        })
    }

    /// Adds the labels of the pipeline's last revolution.
    pub(super) fn put_perceived(&mut self, pipeline: &Pipeline, revolution: u32) -> Result<()> {
        let labels = (0..pipeline.scan().len()).map(|point| label(pipeline, point));
        self.put(labels, revolution)
    }

    /// Adds an array of labels, column by column.
    pub(super) fn put(
        &mut self,
        labels: impl ExactSizeIterator<Item = i32>,
        revolution: u32,
    ) -> Result<()> {
        let mut array = npy_header(labels.len() / MAX_LAYERS);
        for label in labels {
            array.extend_from_slice(&label.to_le_bytes());
        }
        let options = SimpleFileOptions::default();
        let name = format!("r{revolution:06}.npy");
        let result = self.archive.start_file(name, options).map_err(Into::into);
        result
            .and_then(|()| self.archive.write_all(&array))
            .with_context(|| self.path.display().to_string())
    }

    pub(super) fn finish(self) -> Result<()> {
        let finished = self.archive.finish().map_err(std::io::Error::from);
        finished
            .and_then(|mut writer| writer.flush())
            .with_context(|| self.path.display().to_string())
    }
}

fn label(pipeline: &Pipeline, point: usize) -> i32 {
    if !pipeline.scan().has_return(point) {
        NO_RETURN
    } else if pipeline.ground_mask()[point] {
        GROUND
    } else {
        match pipeline.clusters().labels()[point] {
            Clusters::NONE => NOISE,
            cluster => FIRST_CLUSTER + cluster,
        }
    }
}

/// The head of an array file (NumPy's format, version 1.0): padded to a multiple of 64 bytes.
fn npy_header(columns: usize) -> Vec<u8> {
    let mut text =
        format!("{{'descr': '<i4', 'fortran_order': False, 'shape': ({columns}, {MAX_LAYERS}), }}");
    const FIXED_LEN: usize = 10;
    let padding = 63 - (FIXED_LEN + text.len()) % 64;
    text.extend(std::iter::repeat_n(' ', padding));
    text.push('\n');
    let mut header = b"\x93NUMPY\x01\x00".to_vec();
    header.extend_from_slice(&(text.len() as u16).to_le_bytes());
    header.extend_from_slice(text.as_bytes());
    header
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn array_headers_are_aligned() {
        for columns in [1, 1810, 2000] {
            let header = npy_header(columns);
            assert_eq!(header.len() % 64, 0);
            assert_eq!(header.last(), Some(&b'\n'));
        }
    }
}
