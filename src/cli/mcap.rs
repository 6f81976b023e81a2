//! `kreisel convert IN OUT.mcap`: what the pipeline sees in a recording, for Foxglove, Lichtblick and their like.

use std::path::Path;

use anyhow::{Context as _, Result};

use super::files::{self, Output};
use super::progress::Progress;
use super::{Completion, convert};
use crate::foxglove::Stage;
use crate::pipeline::{Outcome, Pipeline};
use crate::tally::Tally;
use crate::time::{Span, Time};
use crate::wire::Recording;

/// How often the state of the pipeline is written.
const STATUS_PERIOD: Span = Span::from_micros(1_000_000);

/// Perceives a recording or a capture and writes an MCAP file.
pub(super) fn write(arguments: &convert::Arguments) -> Result<Completion> {
    let configuration = files::configuration(arguments.config.as_deref())?;
    let (bytes, mut completion) = files::Recorded::read(&arguments.input)?.with_packets();
    let mut stage = Stage::new()?;
    let output = Output::create(&arguments.output)?;
    let named = || arguments.output.display().to_string();
    let writer = stage.context().mcap_writer();
    let writer = writer.create(output).with_context(named)?;
    let mut pipeline = Pipeline::new(&configuration, 0);
    let (mut faults, mut told): (_, Option<Time>) = (Tally::default(), None);
    let mut progress = Progress::of(bytes.len(), "bytes");
    for item in Recording::new(&bytes) {
        let entry = match item {
            Ok(entry) => entry,
            Err(damage) => {
                completion = Completion::Damaged;
                files::report_damage(&arguments.input, &damage);
                continue;
            }
        };
        progress.set(entry.offset);
        match pipeline.handle(&entry.envelope) {
            Ok(Outcome::Revolution(report)) => {
                pipeline.update_map();
                stage.show(&pipeline, &report);
                let is_due = |told: Time| report.time - told >= STATUS_PERIOD || report.time < told;
                if told.is_none_or(is_due) {
                    told = Some(report.time);
                    stage.tell(&pipeline.status(), report.time);
                }
            }
            Ok(_) => {}
            Err(fault) => {
                faults.count(fault.name());
                if faults.get(fault.name()) == 1 {
                    stage.warn(&fault.to_string(), entry.envelope.time());
                }
            }
        }
    }
    drop(progress);
    writer.close().with_context(named)?.finish()?;
    report(&pipeline, &faults, &arguments.output)?;
    Ok(completion)
}

fn report(pipeline: &Pipeline, faults: &Tally, output: &Path) -> Result<()> {
    let status = pipeline.status();
    say!(
        "{}: {} revolutions, {} refused; {faults}",
        output.display(),
        status.revolutions_published,
        status.revolutions_refused
    );
    Ok(())
}
