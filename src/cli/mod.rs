//! The command line: one file a command. What goes wrong is said here, once, in one line.

/// Prints a line of results; an error when nobody can read it.
macro_rules! say {
    ($($argument:tt)*) => {{
        use std::io::Write as _;
        writeln!(std::io::stdout().lock(), $($argument)*)?
    }};
}

/// Prints a line of diagnostics, if anybody can read it.
macro_rules! tell {
    ($($argument:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr().lock(), $($argument)*);
    }};
}

mod capture;

mod config;

mod convert;

mod demo;

mod drive;

mod files;

mod gap_score;

mod health;

mod inspect;

mod labels;

mod log;

mod map;

#[cfg(feature = "foxglove")]
mod mcap;

mod npz;

mod objects;

mod onlooker;

mod packets;

mod pcap;

mod playback;

mod process;

mod progress;

mod record;

mod replay;

mod roads;

mod roundabout;

mod run;

mod score;

mod simulate;

mod summary;

mod view;
mod window_score;

use std::net::Ipv4Addr;
use std::process::ExitCode;

use anyhow::Context as _;
use clap::{Args, Parser, Subcommand};
use tracing::Level;

use crate::daemon::session::Session;

/// LiDAR perception for OpenDaVINCI and OpenDLV sessions: VLP-16 revolutions in, objects out.
#[derive(Debug, Parser)]
#[command(name = "kreisel", version, max_term_width = 100)]
struct CommandLine {
    #[command(subcommand)]
    command: Command,
    /// Say more: 1, what is around, once a second; 2, every message and every revolution.
    #[arg(long, global = true, num_args = 0..=1, require_equals = true, default_missing_value = "1", value_name = "LEVEL", hide_possible_values = true)]
    verbose: Option<u8>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Join a session, perceive, and publish objects back into it.
    Run(run::Arguments),
    /// Perceive a simulated roundabout on loopback and show its objects.
    Demo(demo::Arguments),
    /// Multicast a recording at the pace at which it was recorded.
    Replay(replay::Arguments),
    /// Write every envelope of a session to a recording.
    Record(record::Arguments),
    /// Perceive a recording, without network and clock.
    Process(process::Arguments),
    /// Make a recording of a synthetic VLP-16, with truth.
    Simulate(simulate::Arguments),
    /// Turn captured VLP-16 packets (pcap, pcapng) into a recording, or anything into MCAP.
    Convert(convert::Arguments),
    /// Show a recording or a session in a browser.
    View(view::Arguments),
    /// Say what is in a recording.
    Inspect(inspect::Arguments),
    /// Let a simulated vehicle enter a roundabout when the advice allows it.
    Drive(drive::Arguments),
    /// Say what roundabouts are in a map of roads.
    Roundabout(roundabout::Arguments),
    /// Print the complete configuration.
    Config(config::Arguments),
    /// Ask whether the daemon on this host is receiving and keeping up.
    Health(health::Arguments),
}

/// Which session, for the commands that join one.
#[derive(Debug, Clone, Args)]
struct SessionArguments {
    /// The session: multicast group 225.0.0.CID, port 12175.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=254))]
    cid: u8,
    /// Address of the network interface to use [default: the routing table's choice].
    #[arg(long, value_name = "IPV4")]
    interface: Option<Ipv4Addr>,
}

impl SessionArguments {
    fn session(&self) -> Session {
        Session {
            cid: self.cid,
            interface: self.interface,
        }
    }
}

/// How a command ended that did not fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Completion {
    /// All is done.
    Done,
    /// Done, but parts of the input were damaged and were passed over.
    Damaged,
}

impl Completion {
    /// Of two parts of the work together.
    fn and(self, other: Self) -> Self {
        match self {
            Self::Done => other,
            Self::Damaged => self,
        }
    }
}

/// Exit code of [`Completion::Damaged`].
const EXIT_DAMAGED: u8 = 3;

/// Runs the command line; the only place where exit codes are made.
pub fn main() -> ExitCode {
    let line = CommandLine::parse();
    log::start(match line.verbose {
        None | Some(0) => Level::INFO,
        Some(1) => Level::DEBUG,
        Some(_) => Level::TRACE,
    });
    let result = match line.command {
        Command::Run(arguments) => run::run(&arguments),
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Replay(arguments) => replay::run(&arguments),
        Command::Record(arguments) => record::run(&arguments),
        Command::Process(arguments) => process::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Convert(arguments) => convert::run(&arguments),
        Command::View(arguments) => view::run(&arguments),
        Command::Inspect(arguments) => inspect::run(&arguments),
        Command::Drive(arguments) => drive::run(&arguments),
        Command::Roundabout(arguments) => roundabout::run(&arguments),
        Command::Config(arguments) => config::run(&arguments),
        Command::Health(arguments) => health::run(&arguments),
    };
    match result {
        Ok(Completion::Done) => ExitCode::SUCCESS,
        Ok(Completion::Damaged) => ExitCode::from(EXIT_DAMAGED),
        // Who reads our output has seen enough.
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            tell!("kreisel: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    let kind = |cause: &std::io::Error| cause.kind();
    let io = error.chain().find_map(|cause| cause.downcast_ref());
    io.map(kind) == Some(std::io::ErrorKind::BrokenPipe)
}

/// File descriptors that sockets, signals and the view of a command may need. Where they are missing, tokio panics.
const DESCRIPTORS: usize = 24;

/// Runs async work on this thread until it ends.
fn block_on<T>(work: impl Future<Output = anyhow::Result<T>>) -> anyhow::Result<T> {
    let spare: Result<Vec<_>, _> = (0..DESCRIPTORS)
        .map(|_| std::fs::File::open("/dev/null"))
        .collect();
    drop(spare.context("cannot open sockets")?);
    tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()?
        .block_on(work)
}

/// Ready when the process is asked to stop: by Ctrl-C, by `SIGTERM`, or because its terminal is gone.
async fn stop_signal() {
    use tokio::signal::unix::{SignalKind, signal};
    let (Ok(mut interrupt), Ok(mut terminate), Ok(mut hangup)) = (
        signal(SignalKind::interrupt()),
        signal(SignalKind::terminate()),
        signal(SignalKind::hangup()),
    ) else {
        return std::future::pending().await;
    };
    tokio::select! {
        _ = interrupt.recv() => {}
        _ = terminate.recv() => {}
        _ = hangup.recv() => {}
    }
}
