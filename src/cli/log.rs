//! Where the log goes: to stderr, or, where the journal reads that, to the journal with its fields.

use std::fs::File;
use std::io::{self, IsTerminal as _};
use std::os::fd::AsFd as _;
use std::os::unix::fs::MetadataExt as _;

use tracing::Level;
use tracing_journald::{Priority, PriorityMappings};
use tracing_subscriber::filter::LevelFilter;
use tracing_subscriber::layer::SubscriberExt as _;
use tracing_subscriber::util::SubscriberInitExt as _;

/// What is logged from here on is told from this level up.
pub(super) fn start(level: Level) {
    let journal = leads_to_journal().then(tracing_journald::layer);
    if let Some(Ok(journal)) = journal {
        let journal = journal
            .with_syslog_identifier(env!("CARGO_PKG_NAME").into())
            .with_priority_mappings(PRIORITIES);
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

/// As syslog means them.
const PRIORITIES: PriorityMappings = PriorityMappings {
    error: Priority::Error,
    warn: Priority::Warning,
    info: Priority::Informational,
    debug: Priority::Debug,
    trace: Priority::Debug,
};

/// Whether stderr leads to the journal: systemd names device and inode of what it has connected
/// (systemd.exec(5), `$JOURNAL_STREAM`).
fn leads_to_journal() -> bool {
    let stderr = io::stderr().as_fd().try_clone_to_owned().map(File::from);
    let (Ok(named), Ok(own)) = (
        std::env::var("JOURNAL_STREAM"),
        stderr.and_then(|stderr| stderr.metadata()),
    ) else {
        return false;
    };
    named == format!("{}:{}", own.dev(), own.ino())
}
