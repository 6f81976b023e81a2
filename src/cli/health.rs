//! `kreisel health`: for health checks of containers.

use anyhow::{Result, bail};
use clap::Args;

use super::Completion;
use crate::daemon::health;

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Ask only daemons of this session [default: all on this host].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=254))]
    cid: Option<u8>,
}

pub(super) fn run(arguments: &Arguments) -> Result<Completion> {
    match health::check(arguments.cid) {
        Ok(()) => {
            say!("ok");
            Ok(Completion::Done)
        }
        Err(problem) => bail!("unhealthy: {problem}"),
    }
}
