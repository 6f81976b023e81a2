//! `kreisel record`: a session into a file.

use std::path::PathBuf;
use std::pin::pin;

use anyhow::Result;
use clap::Args;

use super::files::Output;
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

pub(super) fn run(arguments: &Arguments) -> Result<Completion> {
    let (written, damaged) = block_on(record(arguments))?;
    tell!("kreisel: {written} envelopes written, {damaged} damaged datagrams left out");
    Ok(Completion::Done)
}

async fn record(arguments: &Arguments) -> Result<(u64, u64)> {
    let parameters = Configuration::default().session;
    let (mut receiver, _sender) = arguments.session.session().join(&parameters)?;
    let mut output = Output::create(&arguments.output)?;
    tracing::info!("recording {}; Ctrl-C ends it", receiver.group());
    let mut stop = pin!(stop_signal());
    let mut datagram = Datagram::default();
    let (mut written, mut damaged, mut lost) = (0, 0, 0);
    loop {
        let arrival = tokio::select! {
            received = receiver.receive(&mut datagram) => received?,
            () = &mut stop => {
                output.finish()?;
                return Ok((written, damaged));
            }
        };
        if arrival.kernel_dropped > lost {
            lost = arrival.kernel_dropped;
            tracing::warn!("{lost} datagrams lost so far: the receive buffer was full");
        }
        // Only what is sound: one damaged frame would hide what follows from other readers.
        let datagram = datagram.bytes();
        match (Envelope::from_datagram(datagram), frame::split(datagram, 0)) {
            (Ok(_), Ok((_, end))) => {
                output.put(&datagram[..end])?;
                written += 1;
            }
            _ => damaged += 1,
        }
    }
}
