//! `kreisel convert`: captured VLP-16 packets to the envelopes that the device service sends.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use super::capture::Capture;
use super::files::Output;
use super::{Completion, files};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Capture to read, pcap or pcapng.
    #[arg(value_name = "IN.pcap")]
    input: PathBuf,
    /// Recording to write.
    #[arg(value_name = "OUT.rec")]
    output: PathBuf,
    /// senderStamp of the envelopes.
    #[arg(long, value_name = "STAMP", default_value_t = 0)]
    id: u32,
}

pub(super) fn run(arguments: &Arguments) -> Result<Completion> {
    let bytes = files::read(&arguments.input)?;
    files::check_distinct(&[Some(&arguments.input)], &[Some(&arguments.output)])?;
    let capture = Capture::read(&arguments.input, &bytes)?;
    let clouds = capture.clouds(arguments.id);
    let mut output = Output::create(&arguments.output)?;
    output.put(&clouds.frames)?;
    output.finish()?;
    say!(
        "{} packets, {} revolutions; {} columns after the last one not sent",
        clouds.packets,
        clouds.revolutions,
        clouds.pending_columns(),
    );
    clouds.warn(&arguments.input);
    capture.warn(&arguments.input);
    Ok(capture.completion().and(clouds.completion()))
}
