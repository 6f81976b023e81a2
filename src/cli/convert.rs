//! `kreisel convert`: captured VLP-16 packets to the envelopes that the device service sends, and anything to MCAP.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use super::capture::Capture;
use super::files::Output;
#[cfg(feature = "foxglove")]
use super::mcap::write as write_mcap;
use super::{Completion, files};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Capture to read, pcap or pcapng; for MCAP a recording, too.
    #[arg(value_name = "IN.pcap")]
    pub(super) input: PathBuf,
    /// Recording to write, or what Kreisel sees in it if its name ends in .mcap.
    #[arg(value_name = "OUT.rec")]
    pub(super) output: PathBuf,
    /// Configuration file, for MCAP; `kreisel config` prints one.
    #[arg(long, value_name = "FILE.toml")]
    pub(super) config: Option<PathBuf>,
    /// senderStamp of the envelopes.
    #[arg(long, value_name = "STAMP", default_value_t = 0)]
    id: u32,
    /// Leave out the first revolution, of which only the end was captured; the device service sends it.
    #[arg(long)]
    whole: bool,
}

#[cfg(not(feature = "foxglove"))]
fn write_mcap(arguments: &Arguments) -> Result<Completion> {
    let output = arguments.output.display();
    anyhow::bail!(
        "{output}: this kreisel was built without MCAP: cargo build --release --features foxglove"
    );
}

pub(super) fn run(arguments: &Arguments) -> Result<Completion> {
    let inputs = [Some(&arguments.input), arguments.config.as_ref()];
    files::check_distinct(&inputs, &[Some(&arguments.output)])?;
    if arguments
        .output
        .extension()
        .is_some_and(|ending| ending == "mcap")
    {
        return write_mcap(arguments);
    }
    let bytes = files::read(&arguments.input)?;
    let capture = Capture::read(&arguments.input, &bytes)?;
    let clouds = capture.clouds(arguments.id);
    let mut output = Output::create(&arguments.output)?;
    let (frames, revolutions) = if arguments.whole {
        let whole = clouds.revolutions.saturating_sub(1);
        (clouds.whole_revolutions(), whole)
    } else {
        (&clouds.frames[..], clouds.revolutions)
    };
    output.put(frames)?;
    output.finish()?;
    say!(
        "{} packets, {revolutions} revolutions; {} columns after the last one not sent",
        clouds.packets,
        clouds.pending_columns(),
    );
    clouds.warn(&arguments.input);
    capture.warn(&arguments.input);
    Ok(capture.completion().and(clouds.completion()))
}
