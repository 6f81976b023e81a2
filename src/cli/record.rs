//! `kreisel record`: a session into a file.

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::PathBuf;
use std::pin::pin;
use std::time::Duration;

use anyhow::{Context as _, Result};
use clap::Args;
use tokio::time::interval;

use super::{Completion, SessionArguments, block_on, stop_signal};
use crate::config::Configuration;
use crate::daemon::listener::Datagram;
use crate::wire::{Envelope, frame};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Recording to write.
    #[arg(value_name = "FILE.rec")]
    output: PathBuf,
    #[command(flatten)]
    session: SessionArguments,
}

/// How often what was received is sure to be in the file.
const FLUSHED: Duration = Duration::from_secs(1);

/// What a recording misses.
#[derive(Debug, Default)]
struct Recorded {
    written: u64,
    damaged: u64,
    lost: u64,
}

pub(super) fn run(arguments: &Arguments) -> Result<Completion> {
    let Recorded {
        written,
        damaged,
        lost,
    } = block_on(record(arguments))?;
    tell!(
        "kreisel: {written} envelopes written, {damaged} damaged datagrams left out, {lost} lost"
    );
    if damaged + lost > 0 {
        Ok(Completion::Damaged)
    } else {
        Ok(Completion::Done)
    }
}

async fn record(arguments: &Arguments) -> Result<Recorded> {
    let parameters = Configuration::default().session;
    let (mut receiver, _sender) = arguments.session.session().join(&parameters)?;
    // A recording is whole whenever it ends, and grows where everybody looks for it.
    let path = &arguments.output;
    let named = || path.display().to_string();
    let mut file = BufWriter::new(File::create(path).with_context(named)?);
    tracing::info!("recording {}; Ctrl-C ends it", receiver.group());
    let mut stop = pin!(stop_signal());
    let mut ticks = interval(FLUSHED);
    let mut datagram = Datagram::default();
    let mut recorded = Recorded::default();
    loop {
        let arrival = tokio::select! {
            received = receiver.receive(&mut datagram) => received?,
            _ = ticks.tick() => {
                file.flush().with_context(named)?;
                continue;
            }
            () = &mut stop => {
                file.flush().with_context(named)?;
                return Ok(recorded);
            }
        };
        if arrival.kernel_dropped > recorded.lost {
            recorded.lost = arrival.kernel_dropped;
            let lost = recorded.lost;
            tracing::warn!("{lost} datagrams lost so far: the receive buffer was full");
        }
        // Only what is sound: one damaged frame would hide what follows from other readers.
        let datagram = datagram.bytes();
        match (Envelope::from_datagram(datagram), frame::split(datagram, 0)) {
            (Ok(_), Ok((_, end))) => {
                file.write_all(&datagram[..end]).with_context(named)?;
                recorded.written += 1;
            }
            _ => recorded.damaged += 1,
        }
    }
}
