//! What the end-to-end tests share.

use std::path::{Path, PathBuf};

/// A file of the shared test data; `None` where the data is absent, which in CI it must not be.
#[expect(unreachable_pub)]
pub fn data(name: &str) -> Option<PathBuf> {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data"));
    if folder.is_dir() {
        return Some(folder.join(name));
    }
    assert!(
        std::env::var_os("CI").is_none(),
        "{} is absent",
        folder.display()
    );
    None
}
