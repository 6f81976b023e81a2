//! `kreisel run`: the daemon.

use std::net::SocketAddr;
use std::path::PathBuf;

use anyhow::{Context as _, Result};
use clap::Args;

use super::{Completion, SessionArguments, block_on, files, stop_signal};
use crate::daemon::{self, Options};
use crate::view::{self, DEFAULT_ADDRESS, Feed};

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
    /// Show what is seen in a browser, at this address [default: 127.0.0.1:8111].
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, require_equals = true, default_missing_value = DEFAULT_ADDRESS)]
    view: Option<SocketAddr>,
}

pub(super) fn run(arguments: &Arguments) -> Result<Completion> {
    let options = Options {
        session: arguments.session.session(),
        sender_stamp: arguments.id,
        configuration: files::configuration(arguments.config.as_deref())?,
        view: arguments.view.map(serve_view).transpose()?,
    };
    block_on(async { Ok(daemon::run(options, stop_signal()).await?) })?;
    Ok(Completion::Done)
}

/// Serves a view and says where it is.
pub(super) fn serve_view(address: SocketAddr) -> Result<Feed> {
    let served = view::serve(address);
    let (feed, _) = served.with_context(|| format!("cannot serve the view at {address}"))?;
    tracing::info!("view: open http://{} in a browser", feed.address());
    Ok(feed)
}
