//! `kreisel process`: the pipeline over a recording, without network and clock.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use super::files::Output;
use super::labels::LabelWriter;
use super::npz::Archive;
use super::progress::Progress;
use super::score::Score;
use super::summary::Summary;
use super::{Completion, files, map, objects, roads};
use crate::pipeline::{Fault, Outcome, Pipeline, RevolutionReport};
use crate::tally::Tally;
use crate::time::Time;
use crate::track::APPEARANCE_FEATURES;
use crate::wire::envelope::Postmark;
use crate::wire::recording::Entry;
use crate::wire::{Envelope, Recording};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Recording or capture (pcap, pcapng) to perceive.
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// Recording of what `kreisel run` would multicast.
    #[arg(long, value_name = "OUT.rec")]
    output: Option<PathBuf>,
    /// Objects, one line of JSON a revolution.
    #[arg(long, value_name = "OUT.jsonl")]
    objects: Option<PathBuf>,
    /// Labels of all points, one array a revolution.
    #[arg(long, value_name = "OUT.npz")]
    labels: Option<PathBuf>,
    /// What each cluster of the labels looks like, one array a revolution, to fit what tells vehicles that stand.
    #[arg(long, value_name = "OUT.npz")]
    appearances: Option<PathBuf>,
    /// The map at the end.
    #[arg(long, value_name = "OUT.npz")]
    grid: Option<PathBuf>,
    /// The sensor's way, one pose a revolution, in TUM format: t x y z qx qy qz qw.
    #[arg(long, value_name = "OUT.tum")]
    trajectory: Option<PathBuf>,
    /// Ignore pose messages, as if the session had none.
    #[arg(long)]
    no_poses: bool,
    /// Truth to compare the objects with, as `kreisel simulate` writes it.
    #[arg(long, value_name = "FILE.jsonl")]
    truth: Option<PathBuf>,
    /// Configuration file; `kreisel config` prints one.
    #[arg(long, value_name = "FILE.toml")]
    config: Option<PathBuf>,
    /// Map of roads with roundabouts to watch (.scn, .scnx, .osm), instead of the configuration's.
    #[arg(long, value_name = "MAP")]
    map: Option<PathBuf>,
    /// senderStamp of what is sent.
    #[arg(long, value_name = "STAMP", default_value_t = 0)]
    id: u32,
}

/// Seconds of recorded time between two Status messages.
const STATUS_PERIOD_S: f64 = 1.0;

struct Process<'a> {
    arguments: &'a Arguments,
    pipeline: Pipeline,
    output: Option<Output>,
    objects: Option<Output>,
    trajectory: Option<Output>,
    labels: Option<LabelWriter>,
    appearances: Option<Archive>,
    grid: Option<Archive>,
    score: Option<Score>,
    summary: Option<Summary>,
    frame: Vec<u8>,
    status_due: Option<Time>,
    faults: Tally,
}

pub(super) fn run(arguments: &Arguments) -> Result<Completion> {
    let mut configuration = files::configuration(arguments.config.as_deref())?;
    configuration.ego.use_poses &= !arguments.no_poses;
    let (bytes, completion) = files::Recorded::read(&arguments.input)?.with_packets();
    let outputs = [
        &arguments.output,
        &arguments.objects,
        &arguments.labels,
        &arguments.appearances,
        &arguments.grid,
        &arguments.trajectory,
    ];
    let inputs = [
        Some(&arguments.input),
        arguments.truth.as_ref(),
        arguments.config.as_ref(),
        arguments.map.as_ref(),
    ];
    files::check_distinct(&inputs, &outputs.map(Option::as_ref))?;
    let asks_nothing = arguments.truth.is_none() && outputs.iter().all(|output| output.is_none());
    let roads = roads::configured(&mut configuration, arguments.map.as_deref())?;
    let mut process = Process {
        arguments,
        score: arguments.truth.as_deref().map(Score::read).transpose()?,
        pipeline: Pipeline::new(&configuration, arguments.id),
        output: Output::create_if(arguments.output.as_deref())?,
        objects: Output::create_if(arguments.objects.as_deref())?,
        trajectory: Output::create_if(arguments.trajectory.as_deref())?,
        labels: arguments
            .labels
            .as_deref()
            .map(LabelWriter::create)
            .transpose()?,
        appearances: arguments
            .appearances
            .as_deref()
            .map(Archive::create)
            .transpose()?,
        grid: arguments.grid.as_deref().map(Archive::create).transpose()?,
        summary: asks_nothing.then(Summary::new),
        frame: vec![],
        status_due: None,
        faults: Tally::default(),
    };
    if let Some(roads) = &roads {
        process.pipeline.take_map(roads);
        if let Some(score) = &mut process.score {
            score.watch_gaps(&configuration.roundabout, roads);
        }
    }
    let mut progress = Progress::of(bytes.len(), "bytes");
    let mut damages = usize::from(completion == Completion::Damaged);
    for item in Recording::new(&bytes) {
        match item {
            Ok(entry) => {
                progress.set(entry.offset);
                process.take(&entry)?;
            }
            Err(damage) => {
                damages += 1;
                files::report_damage(&arguments.input, &damage);
            }
        }
    }
    drop(progress);
    process.finish(damages)
}

impl Process<'_> {
    fn take(&mut self, entry: &Entry<'_>) -> Result<()> {
        match self.pipeline.handle(&entry.envelope) {
            Ok(Outcome::Revolution(report)) => self.answer(&report),
            Ok(_) => Ok(()),
            Err(fault) => {
                self.report(entry.offset, &entry.envelope, &fault);
                Ok(())
            }
        }
    }

    /// One line for the first fault of a kind; the rest are counted.
    fn report(&mut self, offset: usize, envelope: &Envelope<'_>, fault: &Fault) {
        self.faults.count(fault.name());
        if self.faults.get(fault.name()) == 1 {
            tell!(
                "kreisel: {}: byte {offset}: message {}: {}: {fault}",
                self.arguments.input.display(),
                envelope.data_type,
                fault.name(),
            );
        }
    }

    fn answer(&mut self, report: &RevolutionReport) -> Result<()> {
        if let Some(output) = &mut self.output {
            for frame in self.pipeline.publish_objects(report.time, 0.0) {
                output.put(frame)?;
            }
        }
        self.pipeline.update_map();
        if let Some(output) = &mut self.output {
            for frame in self.pipeline.publish_map(report.time) {
                output.put(frame)?;
            }
        }
        self.put_status(report.time)?;
        if let Some(output) = &mut self.objects {
            output.put(&objects::line(report, self.pipeline.objects())?)?;
        }
        if let Some(output) = &mut self.trajectory {
            output.put(trajectory_line(report.time, &self.pipeline).as_bytes())?;
        }
        if let Some(score) = &mut self.score {
            score.take(report, &self.pipeline);
        }
        if let Some(summary) = &mut self.summary {
            summary.take(report, self.pipeline.objects());
        }
        if let Some(labels) = &mut self.labels {
            labels.put_perceived(&self.pipeline, report.number)?;
        }
        if let Some(archive) = &mut self.appearances {
            let all = self.pipeline.appearances();
            let shape = [all.len(), APPEARANCE_FEATURES];
            let features = all.flatten().map(|feature| feature as f32);
            archive.put(&format!("r{:06}", report.number), &shape, features)?;
        }
        Ok(())
    }

    /// Status once a second of recorded time.
    fn put_status(&mut self, now: Time) -> Result<()> {
        let period = crate::time::Span::from_seconds(STATUS_PERIOD_S);
        let due = *self.status_due.get_or_insert(now + period);
        let jumped_back = (due - now) > period;
        if now < due && !jumped_back {
            return Ok(());
        }
        self.status_due = Some(now + period);
        if let Some(output) = &mut self.output {
            let postmark = Postmark {
                sent: now,
                sampled: now,
                sender_stamp: self.arguments.id,
            };
            self.frame.clear();
            postmark.put(&mut self.frame, &self.pipeline.status());
            output.put(&self.frame)?;
        }
        Ok(())
    }

    fn finish(self, damages: usize) -> Result<Completion> {
        for output in [self.output, self.objects, self.trajectory]
            .into_iter()
            .flatten()
        {
            output.finish()?;
        }
        if let Some(labels) = self.labels {
            labels.finish()?;
        }
        if let Some(archive) = self.appearances {
            archive.finish()?;
        }
        if let Some(archive) = self.grid {
            map::write(archive, self.pipeline.grid())?;
        }
        let (status, counts) = (self.pipeline.status(), self.pipeline.counts());
        say!(
            "{} point clouds: {} answered, {} refused; {} damaged messages, {damages} damaged stretches",
            status.revolutions_received,
            status.revolutions_published,
            status.revolutions_refused,
            status.datagrams_damaged,
        );
        if let Some(score) = &self.score {
            say!("{}", score.summary());
            if let Some(gaps) = score.gap_summary() {
                say!("{gaps}");
            }
        }
        for found in self.pipeline.found_roundabouts() {
            let reference = self.pipeline.sweep().reference;
            say!("{}", super::roundabout::described_found(found, reference));
        }
        if let Some(summary) = &self.summary {
            summary.print(&self.arguments.input)?;
        }
        if self.faults.total() > 0 {
            tell!(
                "kreisel: {}: {}",
                self.arguments.input.display(),
                self.faults
            );
        }
        if counts.packets_lost > 0 {
            let (path, lost) = (self.arguments.input.display(), counts.packets_lost);
            tell!("kreisel: {path}: {lost} packets are missing");
        }
        for (count, what) in [
            (
                counts.ground_held,
                "without a plausible ground plane: the last one was kept",
            ),
            (
                counts.ground_fallback,
                "before any plausible ground plane: it was taken level at the configured height",
            ),
            (
                counts.airborne_revolutions,
                "with snow, rain, spray or dust: what stood alone near the sensor was left out",
            ),
            (counts.time_jumps, "after a jump in time: tracks began anew"),
        ] {
            if count > 0 {
                tell!(
                    "kreisel: {}: {count} revolutions {what}",
                    self.arguments.input.display()
                );
            }
        }
        let all_refused = status.revolutions_received > 0 && status.revolutions_published == 0;
        if damages > 0 || status.datagrams_damaged > 0 || all_refused {
            Ok(Completion::Damaged)
        } else {
            Ok(Completion::Done)
        }
    }
}

/// A line of a trajectory: where the sensor was at a time, in the local frame.
fn trajectory_line(time: Time, pipeline: &Pipeline) -> String {
    let sensor = pipeline.sweep().local_attitude();
    let [x, y, z]: [f64; 3] = sensor.translation_m.into();
    let [qx, qy, qz, qw] = sensor.quaternion();
    let micros = time.micros();
    format!(
        "{}.{:06} {x:.6} {y:.6} {z:.6} {qx:.9} {qy:.9} {qz:.9} {qw:.9}\n",
        micros.div_euclid(1_000_000),
        micros.rem_euclid(1_000_000),
    )
}
