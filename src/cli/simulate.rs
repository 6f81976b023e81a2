//! `kreisel simulate`: a synthetic session with truth.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Result, bail};
use clap::Args;
use tokio::time::{Instant, sleep_until};

use super::files::{Output, check_distinct};
use super::labels::LabelWriter;
use super::npz::Archive;
use super::pcap::PcapWriter;
use super::progress::Progress;
use super::{Completion, map, objects};
use crate::daemon::session::Sender;
use crate::roadmap::scn;
use crate::simulate::scenario::{self, Scenario};
use crate::simulate::{Simulation, Truth};
use crate::wire::Recording;

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Scenario to simulate.
    #[arg(value_name = "SCENARIO", value_parser = find, required_unless_present = "list")]
    scenario: Option<Scenario>,
    /// List the scenarios.
    #[arg(long)]
    list: bool,
    /// The noise follows from it: the same seed gives the same bytes.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// How long, in seconds.
    #[arg(long, value_name = "S", default_value_t = 10.0, value_parser = duration)]
    duration: f64,
    /// Recording to write; a capture of the sensor's packets if its name ends in .pcap.
    #[arg(long, value_name = "FILE", required_unless_present = "list")]
    output: Option<PathBuf>,
    /// Truth to write, one line of JSON a revolution.
    #[arg(long, value_name = "FILE.jsonl")]
    truth: Option<PathBuf>,
    /// True labels of all points: 0 no return, 1 ground, 2 structure, 100 + n road user n.
    #[arg(long, value_name = "FILE.npz")]
    labels: Option<PathBuf>,
    /// The map of the roads, if there is a roundabout.
    #[arg(long, value_name = "OUT.scn")]
    map: Option<PathBuf>,
    /// True map at the end: bit 0 occupied, bit 1 seen, bit 2 passed by a ray.
    #[arg(long, value_name = "FILE.npz")]
    grid: Option<PathBuf>,
}

/// A day: longer ones are a slip of the pen.
const LONGEST_S: f64 = 86_400.0;
/// Revolutions a second.
const ROTATION_HZ: f64 = 10.0;

/// A scenario by its name.
pub(super) fn find(name: &str) -> Result<Scenario, String> {
    let names = || {
        scenario::all()
            .iter()
            .map(|s| s.name)
            .collect::<Vec<_>>()
            .join(", ")
    };
    scenario::find(name).ok_or_else(|| format!("there is no such scenario; there are: {}", names()))
}

/// A duration in seconds.
pub(super) fn duration(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds > 0.0 && seconds <= LONGEST_S => Ok(seconds),
        _ => Err(format!(
            "not a number of seconds above 0 and up to {LONGEST_S}"
        )),
    }
}

/// Sends a scenario into a session for ever, at `speed` times its own pace.
pub(super) async fn send(
    scenario: &Scenario,
    seed: u64,
    speed: f64,
    sender: &Sender,
) -> Result<()> {
    let mut simulation = Simulation::new(*scenario, seed);
    let period = Duration::from_secs_f64(1.0 / (ROTATION_HZ * speed));
    let mut frame = vec![];
    let mut due = Instant::now();
    loop {
        frame.clear();
        simulation.revolve(&mut frame);
        due += period;
        sleep_until(due).await;
        for entry in Recording::new(&frame).flatten() {
            sender.send(entry.frame)?;
        }
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<Completion> {
    if arguments.list {
        for scenario in scenario::all() {
            say!("{}: {}", scenario.name, scenario.summary);
        }
        return Ok(Completion::Done);
    }
    let (Some(scenario), Some(path)) = (&arguments.scenario, &arguments.output) else {
        return Ok(Completion::Done);
    };
    let outputs = [
        Some(path),
        arguments.truth.as_ref(),
        arguments.labels.as_ref(),
        arguments.grid.as_ref(),
        arguments.map.as_ref(),
    ];
    check_distinct(&[], &outputs)?;
    if let Some(path) = &arguments.map {
        let Some(roads) = scenario.roads() else {
            bail!("there is no map of the roads of {}", scenario.name);
        };
        let mut output = Output::create(path)?;
        output.put(scn::write(&roads).as_bytes())?;
        output.finish()?;
    }
    let in_packets = path
        .extension()
        .is_some_and(|extension| extension == "pcap");
    let mut sink = match in_packets {
        true => Sink::Capture(PcapWriter::create(path)?),
        false => Sink::Recording(Output::create(path)?, vec![]),
    };
    let mut truth = Output::create_if(arguments.truth.as_deref())?;
    let mut labels = arguments
        .labels
        .as_deref()
        .map(LabelWriter::create)
        .transpose()?;
    let grid = arguments.grid.as_deref();
    let grid = grid.map(Archive::create).transpose()?;
    let revolutions = (arguments.duration * ROTATION_HZ).round().max(1.0) as usize;
    let mut progress = Progress::of(revolutions, "revolutions");
    let mut simulation = match in_packets {
        true => Simulation::in_packets(*scenario, arguments.seed),
        false => Simulation::new(*scenario, arguments.seed),
    };
    if arguments.grid.is_some() {
        simulation.survey();
    }
    for revolution in 0..revolutions {
        let was = sink.revolve(&mut simulation)?;
        if let Some(truth) = &mut truth {
            truth.put(&objects::truth_line(&was)?)?;
        }
        if let Some(labels) = &mut labels {
            labels.put(simulation.labels().iter().copied(), revolution as u32)?;
        }
        progress.step();
    }
    drop(progress);
    sink.finish(&mut simulation)?;
    truth.map_or(Ok(()), Output::finish)?;
    labels.map_or(Ok(()), LabelWriter::finish)?;
    if let (Some(archive), Some(map)) = (grid, simulation.map()) {
        map::write_truth(archive, &map)?;
    }
    Ok(Completion::Done)
}

/// Where revolutions go.
enum Sink {
    /// As point clouds and poses, with room for those of a revolution.
    Recording(Output, Vec<u8>),
    /// As the sensor's packets.
    Capture(PcapWriter),
}

impl Sink {
    fn revolve(&mut self, simulation: &mut Simulation) -> Result<Truth> {
        match self {
            Self::Recording(output, frames) => {
                frames.clear();
                let truth = simulation.revolve(frames);
                output.put(frames)?;
                Ok(truth)
            }
            Self::Capture(writer) => {
                let mut written = Ok(());
                let truth = simulation.revolve_in_packets(|packet| {
                    if written.is_ok() {
                        written = writer.put(packet);
                    }
                });
                written.map(|()| truth)
            }
        }
    }

    fn finish(self, simulation: &mut Simulation) -> Result<()> {
        match self {
            Self::Recording(output, _) => output.finish(),
            Self::Capture(mut writer) => {
                let mut written = Ok(());
                simulation.close_packets(|packet| {
                    if written.is_ok() {
                        written = writer.put(packet);
                    }
                });
                written?;
                writer.finish()
            }
        }
    }
}
