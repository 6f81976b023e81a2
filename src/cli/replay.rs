//! `kreisel replay`: a recording back onto the network.

use std::net::Ipv4Addr;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context as _, Result, bail};
use clap::Args;
use tokio::time::{Instant, sleep_until};

use super::capture::Capture;
use super::packets::PacketSender;
use super::progress::Progress;
use super::{Completion, block_on, files, simulate, stop_signal};
use crate::config::Configuration;
use crate::daemon::session::{Sender, Session};
use crate::simulate::scenario::Scenario;
use crate::wire::Recording;
use crate::wire::frame::MAX_DATAGRAM_LEN;
use crate::wire::recording::Entry;

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Recording or capture (pcap, pcapng) to play.
    #[arg(value_name = "FILE")]
    input: PathBuf,
    /// The session: multicast group 225.0.0.CID, port 12175.
    #[arg(long, value_name = "N", required_unless_present = "velodyne", value_parser = clap::value_parser!(u8).range(1..=254))]
    cid: Option<u8>,
    /// Address of the network interface to use [default: the routing table's choice].
    #[arg(long, value_name = "IPV4")]
    interface: Option<Ipv4Addr>,
    /// Send the packets of a capture, as the sensor did, to this host and port [default: 127.0.0.1:2368].
    #[arg(long, value_name = "HOST[:PORT]", num_args = 0..=1, require_equals = true, default_missing_value = "127.0.0.1", conflicts_with_all = ["cid", "interface"])]
    velodyne: Option<String>,
    /// Times as fast as recorded.
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = speed)]
    speed: f64,
    /// Begin again at the end.
    #[arg(long = "loop")]
    repeat: bool,
    /// Where there is no such file, send a simulated session instead.
    #[arg(long, value_name = "SCENARIO", value_parser = simulate::find)]
    or_simulate: Option<Scenario>,
}

/// Seed of the simulation that stands in for a recording.
const SEED: u64 = 1;

/// Longest pause that is waited for, as in libcluon's player: what is longer is a gap in the
/// recording or a time stamp from elsewhere.
pub(super) const LONGEST_PAUSE_S: f64 = 1.0;

fn speed(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(speed) if (0.001..=1000.0).contains(&speed) => Ok(speed),
        _ => Err("not a number from 0.001 to 1000".into()),
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<Completion> {
    let simulated = arguments.or_simulate.as_ref();
    let simulated = simulated.filter(|_| !arguments.input.exists());
    match (simulated, &arguments.velodyne, arguments.cid) {
        (_, Some(target), _) => send_packets(arguments, target, simulated),
        (simulated, None, Some(cid)) => {
            let interface = arguments.interface;
            let session = Session { cid, interface };
            match simulated {
                Some(scenario) => {
                    block_on(simulate(arguments, session, scenario))?;
                    Ok(Completion::Done)
                }
                None => replay(arguments, session),
            }
        }
        (_, None, None) => bail!("neither a session nor a host to send to"),
    }
}

/// Packets to a host: those of a capture, or simulated ones.
fn send_packets(
    arguments: &Arguments,
    target: &str,
    simulated: Option<&Scenario>,
) -> Result<Completion> {
    let sender = PacketSender::to(target)?;
    let path = &arguments.input;
    if let Some(scenario) = simulated {
        let name = scenario.name;
        tracing::info!(
            "{} does not exist: simulating \"{name}\" to {target}",
            path.display()
        );
        block_on(async {
            tokio::select! {
                result = sender.simulate(scenario, SEED, arguments.speed) => result,
                () = stop_signal() => Ok(()),
            }
        })?;
        return Ok(Completion::Done);
    }
    let capture = Capture::read(path, &files::read(path)?)?;
    capture.warn(path);
    tracing::info!(
        "playing {} packets to {target}",
        capture.packets().iter().count()
    );
    block_on(async {
        let play = async {
            let mut due = Instant::now();
            loop {
                due = sender.play(capture.packets(), arguments.speed, due).await?;
                if !arguments.repeat {
                    return Ok(());
                }
            }
        };
        tokio::select! {
            result = play => result,
            () = stop_signal() => Ok(()),
        }
    })?;
    Ok(capture.completion())
}

/// A simulated session at its own pace, without end.
async fn simulate(arguments: &Arguments, session: Session, scenario: &Scenario) -> Result<()> {
    let sender = session.sender(&Configuration::default().session)?;
    let (path, group) = (arguments.input.display(), session.group());
    tracing::info!(
        "{path} does not exist: simulating \"{}\" to {group}",
        scenario.name
    );
    tokio::select! {
        result = simulate::send(scenario, SEED, arguments.speed, &sender) => result,
        () = stop_signal() => Ok(()),
    }
}

fn replay(arguments: &Arguments, session: Session) -> Result<Completion> {
    let (bytes, mut completion) =
        files::Recorded::read(&arguments.input)?.with_clouds(&arguments.input);
    let mut entries = vec![];
    for item in Recording::new(&bytes) {
        match item {
            Ok(entry) if entry.frame.len() > MAX_DATAGRAM_LEN => {
                let (path, length) = (arguments.input.display(), entry.frame.len());
                tell!(
                    "kreisel: {path}: byte {}: {length} bytes do not fit a datagram; skipped",
                    entry.offset
                );
                completion = Completion::Damaged;
            }
            Ok(entry) => entries.push(entry),
            Err(damage) => {
                files::report_damage(&arguments.input, &damage);
                completion = Completion::Damaged;
            }
        }
    }
    if entries.is_empty() {
        bail!("{}: byte 0: no envelope to play", arguments.input.display());
    }
    block_on(async {
        tokio::select! {
            result = play(arguments, session, &entries) => result,
            () = stop_signal() => Ok(()),
        }
    })?;
    Ok(completion)
}

async fn play(arguments: &Arguments, session: Session, entries: &[Entry<'_>]) -> Result<()> {
    let sender = session.sender(&Configuration::default().session)?;
    tracing::info!("playing {} envelopes to {}", entries.len(), session.group());
    let mut due = Instant::now();
    loop {
        due = play_once(arguments, session, entries, &sender, due).await?;
        if !arguments.repeat {
            return Ok(());
        }
    }
}

/// Plays the recording once, from `due` on; gives when it ended.
async fn play_once(
    arguments: &Arguments,
    session: Session,
    entries: &[Entry<'_>],
    sender: &Sender,
    mut due: Instant,
) -> Result<Instant> {
    let mut progress = Progress::of(entries.len(), "envelopes");
    let mut last = None;
    for entry in entries {
        let time = entry.envelope.time();
        let passed_s = last.map_or(0.0, |last| (time - last).seconds());
        last = Some(time);
        due += Duration::from_secs_f64(passed_s.clamp(0.0, LONGEST_PAUSE_S) / arguments.speed);
        sleep_until(due).await;
        let sent = sender.send(entry.frame);
        sent.with_context(|| format!("cannot send to {}", session.group()))?;
        progress.step();
    }
    // A loop of one envelope must not become a flood.
    Ok(due.max(Instant::now()) + Duration::from_millis(100).div_f64(arguments.speed))
}
