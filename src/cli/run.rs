//! `kreisel run`: the daemon.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use super::{Completion, SessionArguments, block_on, files, stop_signal};
use crate::daemon::{self, Options};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    session: SessionArguments,
    /// senderStamp of what is sent, to tell several instances apart.
    #[arg(long, value_name = "STAMP", default_value_t = 0)]
    id: u32,
    /// Configuration file; `kreisel config` prints one.
    #[arg(long, value_name = "FILE.toml")]
    config: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> Result<Completion> {
    let options = Options {
        session: arguments.session.session(),
        sender_stamp: arguments.id,
        configuration: files::configuration(arguments.config.as_deref())?,
    };
    block_on(async { Ok(daemon::run(options, stop_signal()).await?) })?;
    Ok(Completion::Done)
}
