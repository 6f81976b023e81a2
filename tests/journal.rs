//! The log as systemd's journal gets it.
#![cfg(feature = "shell")]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::fs::File;
use std::os::unix::fs::MetadataExt as _;
use std::os::unix::net::UnixDatagram;
use std::process::Command;
use std::time::{Duration, Instant};

use nix::mount::{MsFlags, mount};
use nix::sched::{CloneFlags, unshare};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

/// Where journald listens.
const SOCKET: &str = "/run/systemd/journal/socket";

/// A socket where journald's would be, for this thread and what it starts.
fn journal() -> UnixDatagram {
    unshare(CloneFlags::CLONE_NEWNS).unwrap();
    let none = None::<&str>;
    mount(none, "/", none, MsFlags::MS_REC | MsFlags::MS_PRIVATE, none).unwrap();
    mount(none, "/run", Some("tmpfs"), MsFlags::empty(), none).unwrap();
    std::fs::create_dir_all("/run/systemd/journal").unwrap();
    let journal = UnixDatagram::bind(SOCKET).unwrap();
    journal
        .set_read_timeout(Some(Duration::from_secs(10)))
        .unwrap();
    journal
}

/// What a daemon sends first to the journal, and writes to its log meanwhile, which is a file of which the environment says
/// so much.
fn logged(journal: &UnixDatagram, named: impl Fn(&File) -> String) -> (String, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stderr");
    let stderr = File::create(&path).unwrap();
    let mut daemon = Command::new(env!("CARGO_BIN_EXE_kreisel"))
        .args(["run", "--cid=238", "--interface=127.0.0.1"])
        .env("JOURNAL_STREAM", named(&stderr))
        .stderr(stderr)
        .spawn()
        .unwrap();
    let mut bytes = [0; 4096];
    // It is tried with an empty one first.
    let entries = (0..2).map(|_| journal.recv(&mut bytes).unwrap_or_default());
    let length = entries.max().unwrap_or_default();
    let began = Instant::now();
    while length == 0
        && std::fs::read(&path).unwrap().is_empty()
        && began.elapsed() < Duration::from_secs(10)
    {
        std::thread::sleep(Duration::from_millis(50));
    }
    kill(Pid::from_raw(daemon.id() as i32), Signal::SIGTERM).unwrap();
    daemon.wait().unwrap();
    let entry = String::from_utf8_lossy(&bytes[..length]).into_owned();
    (entry, std::fs::read_to_string(path).unwrap())
}

#[test]
#[cfg_attr(
    not(network_namespaces),
    ignore = "needs root, to stand in for journald"
)]
fn the_journal_gets_priority_and_origin_and_a_terminal_gets_lines() {
    let thread = std::thread::spawn(|| {
        let journal = journal();
        let (entry, lines) = logged(&journal, |stderr| {
            let stderr = stderr.metadata().unwrap();
            format!("{}:{}", stderr.dev(), stderr.ino())
        });
        // A field is its name, the length of its value in eight bytes, and the value.
        let field = |name: &str, value: &str| {
            let length = String::from_utf8_lossy(&value.len().to_le_bytes()).into_owned();
            format!("{name}\n{length}{value}\n")
        };
        for (name, value) in [
            ("PRIORITY", "6"),
            ("SYSLOG_IDENTIFIER", "kreisel"),
            ("TARGET", "kreisel::daemon"),
        ] {
            assert!(entry.contains(&field(name, value)), "{entry}");
        }
        assert!(entry.contains("joined 225.0.0.238:12175"), "{entry}");
        assert_eq!(lines, "");
        // Of a unit whose stderr leads elsewhere the environment may still name the journal.
        journal
            .set_read_timeout(Some(Duration::from_millis(800)))
            .unwrap();
        let mut rest = [0; 4096];
        while journal.recv(&mut rest).is_ok() {}
        let (entry, lines) = logged(&journal, |_| "1:1".into());
        assert_eq!(entry, "");
        assert!(lines.contains("joined 225.0.0.238:12175"), "{lines}");
    });
    if let Err(panic) = thread.join() {
        std::panic::resume_unwind(panic);
    }
}
