//! `kreisel view`: a recording or a session in a browser.

use std::net::{Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, bail};
use clap::Args;
use tokio::sync::mpsc;

use super::onlooker::watch;
use super::playback::{Playback, Timeline};
use super::{Completion, block_on, files, roads, stop_signal};
use crate::daemon::session::Session;
use crate::view::{self, Control, DEFAULT_ADDRESS, Feed};
use crate::wire::Recording;

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Recording or capture (pcap, pcapng) to play.
    #[arg(value_name = "FILE", required_unless_present = "cid")]
    input: Option<PathBuf>,
    /// Session to watch: what a daemon in it publishes.
    #[arg(long, value_name = "N", conflicts_with = "input", value_parser = clap::value_parser!(u8).range(1..=254))]
    cid: Option<u8>,
    /// Address of the network interface to use [default: the routing table's choice].
    #[arg(long, value_name = "IPV4", requires = "cid")]
    interface: Option<Ipv4Addr>,
    /// Where the page is served.
    #[arg(long, value_name = "ADDRESS", default_value = DEFAULT_ADDRESS)]
    address: SocketAddr,
    /// Map of roads with roundabouts to watch (.scn, .scnx, .osm), instead of the configuration's.
    #[arg(long, value_name = "MAP", conflicts_with = "cid")]
    map: Option<PathBuf>,
    /// Configuration file; `kreisel config` prints one.
    #[arg(long, value_name = "FILE.toml", conflicts_with = "cid")]
    config: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> Result<Completion> {
    match (&arguments.input, arguments.cid) {
        (Some(path), _) => play(arguments, path),
        (None, Some(cid)) => {
            let (feed, _) = serve(arguments.address)?;
            let session = Session {
                cid,
                interface: arguments.interface,
            };
            block_on(async {
                tokio::select! {
                    result = watch(session, feed) => result,
                    () = stop_signal() => Ok(()),
                }
            })?;
            Ok(Completion::Done)
        }
        (None, None) => bail!("neither a recording nor a session to show"),
    }
}

fn serve(address: SocketAddr) -> Result<(Feed, mpsc::Receiver<Control>)> {
    let served = view::serve(address);
    let (feed, controls) = served.with_context(|| format!("cannot serve the view at {address}"))?;
    say!(
        "Open http://{} in a browser; Ctrl-C ends it.",
        feed.address()
    );
    Ok((feed, controls))
}

fn play(arguments: &Arguments, path: &Path) -> Result<Completion> {
    let mut configuration = files::configuration(arguments.config.as_deref())?;
    let roads = roads::configured(&mut configuration, arguments.map.as_deref())?;
    let (bytes, mut completion) = files::Recorded::read(path)?.with_packets();
    let mut entries = vec![];
    for item in Recording::new(&bytes) {
        match item {
            Ok(entry) => entries.push(entry),
            Err(damage) => {
                files::report_damage(path, &damage);
                completion = Completion::Damaged;
            }
        }
    }
    let Some(timeline) = Timeline::of(&entries) else {
        bail!("{}: byte 0: no point cloud to show", path.display());
    };
    let (feed, controls) = serve(arguments.address)?;
    let mut playback = Playback::new(configuration, roads, entries, timeline, feed);
    block_on(async {
        tokio::select! {
            () = playback.run(controls) => Ok(()),
            () = stop_signal() => Ok(()),
        }
    })?;
    Ok(completion)
}
