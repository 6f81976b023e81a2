//! Archives of arrays for numpy.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use rawzip::ZipArchiveWriter;

use super::files::Output;

/// Writes arrays one after the other.
#[derive(Debug)]
pub(super) struct Archive {
    path: PathBuf,
    zip: ZipArchiveWriter<Output>,
}

/// A number as numpy names it.
pub(super) trait Element: Copy {
    const DESCRIPTION: &'static str;

    fn put(self, out: &mut Vec<u8>);
}

macro_rules! elements {
    ($($type:ty, $description:literal;)*) => {$(
        impl Element for $type {
            const DESCRIPTION: &'static str = $description;

            fn put(self, out: &mut Vec<u8>) {
                out.extend_from_slice(&self.to_le_bytes());
            }
        }
    )*};
}

elements! {
    u8, "|u1";
    i32, "<i4";
    f32, "<f4";
    f64, "<f8";
}

impl Archive {
    pub(super) fn create(path: &Path) -> Result<Self> {
        Ok(Self {
            path: path.into(),
            zip: ZipArchiveWriter::new(Output::create(path)?),
        })
    }

    /// Adds an array of this shape, its last index running fastest.
    pub(super) fn put<T: Element>(
        &mut self,
        name: &str,
        shape: &[usize],
        elements: impl Iterator<Item = T>,
    ) -> Result<()> {
        let mut array = header(T::DESCRIPTION, shape);
        for element in elements {
            element.put(&mut array);
        }
        self.add(&format!("{name}.npy"), &array)
            .with_context(|| self.path.display().to_string())
    }

    fn add(&mut self, name: &str, content: &[u8]) -> Result<()> {
        let (mut entry, config) = self.zip.new_file(name).start()?;
        let mut writer = config.wrap(&mut entry);
        writer.write_all(content)?;
        let (_, sizes) = writer.finish()?;
        entry.finish(sizes)?;
        Ok(())
    }

    pub(super) fn finish(self) -> Result<()> {
        let finished = self.zip.finish();
        let output = finished.with_context(|| self.path.display().to_string())?;
        output.finish()
    }
}

/// The head of an array file (NumPy's format, version 1.0): padded to a multiple of 64 bytes.
fn header(description: &str, shape: &[usize]) -> Vec<u8> {
    let sizes: Vec<String> = shape.iter().map(|size| format!("{size},")).collect();
    let mut text = format!(
        "{{'descr': '{description}', 'fortran_order': False, 'shape': ({}), }}",
        sizes.join(" ")
    );
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
    fn array_headers_are_aligned_and_name_type_and_shape() {
        for shape in [&[] as &[usize], &[2], &[1810, 16]] {
            let header = header("<i4", shape);
            assert_eq!(header.len() % 64, 0);
            assert_eq!(header.last(), Some(&b'\n'));
        }
        let text = String::from_utf8_lossy(&header("<f4", &[7, 9])).into_owned();
        assert!(text.contains("'descr': '<f4'") && text.contains("(7, 9,)"));
    }
}
