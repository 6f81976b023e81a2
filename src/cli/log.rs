//! Where the log goes: to stderr, or, where the journal reads that, to the journal with its fields.

use std::fs::File;
use std::io::{self, IsTerminal as _};
use std::os::fd::AsFd as _;
use std::os::unix::fs::MetadataExt as _;

use tracing::Level;
use tracing_subscriber::filter::LevelFilter;
use tracing_subscriber::layer::SubscriberExt as _;
use tracing_subscriber::util::SubscriberInitExt as _;

/// What is logged from here on is told from this level up.
pub(super) fn start(level: Level) {
    let journal = journal().and_then(|()| tracing_journald::layer().ok());
    if let Some(journal) = journal {
        let journal = journal.with_syslog_identifier(env!("CARGO_PKG_NAME").into());
        let log = tracing_subscriber::registry().with(LevelFilter::from_level(level));
        return log.with(journal).init();
    }
    tracing_subscriber::fmt()
        .with_max_level(level)
        .with_target(false)
        .with_writer(io::stderr)
        .with_ansi(io::stderr().is_terminal())
        .init();
}

/// Something if stderr leads to the journal: systemd names device and inode of what it has connected
/// (systemd.exec(5), `$JOURNAL_STREAM`).
fn journal() -> Option<()> {
    let named = std::env::var("JOURNAL_STREAM").ok()?;
    let stderr = File::from(io::stderr().as_fd().try_clone_to_owned().ok()?);
    let own = stderr.metadata().ok()?;
    (named == format!("{}:{}", own.dev(), own.ino())).then_some(())
}
