//! `kreisel run`: the daemon.

use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;

use anyhow::{Context as _, Result};
use clap::Args;

use super::{Completion, block_on, files, roads, stop_signal};
use crate::daemon::sensor::SensorPort;
use crate::daemon::session::Session;
use crate::daemon::{self, Onlooker, Options};
use crate::view::{self, DEFAULT_ADDRESS, Feed};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The session: multicast group 225.0.0.CID, port 12175.
    #[arg(long, value_name = "N", required_unless_present = "velodyne", value_parser = clap::value_parser!(u8).range(1..=254))]
    cid: Option<u8>,
    /// Address of the network interface to use [default: the routing table's choice for a session, any for a sensor].
    #[arg(long, value_name = "IPV4")]
    interface: Option<Ipv4Addr>,
    /// Take the packets of a VLP-16 itself, from this UDP port [default: 2368].
    #[arg(long, value_name = "PORT", num_args = 0..=1, require_equals = true, default_missing_value = DEFAULT_PORT, value_parser = clap::value_parser!(u16).range(1..))]
    velodyne: Option<u16>,
    /// Address of the network interface that its packets must come to, if it is not the session's [default: any].
    #[arg(long, value_name = "IPV4", requires = "velodyne")]
    sensor_interface: Option<Ipv4Addr>,
    /// Address of that VLP-16 [default: the first one that is heard].
    #[arg(long, value_name = "IPV4", requires = "velodyne")]
    sensor: Option<Ipv4Addr>,
    /// Send the point clouds that a device service would make of its packets into the session.
    #[arg(long, requires = "velodyne", requires = "cid")]
    publish_cloud: bool,
    /// senderStamp of what is sent, to tell several instances apart.
    #[arg(long, value_name = "STAMP", default_value_t = 0)]
    id: u32,
    /// Configuration file; `kreisel config` prints one.
    #[arg(long, value_name = "FILE.toml")]
    config: Option<PathBuf>,
    /// Map of roads with roundabouts to watch (.scn, .scnx, .osm), instead of the configuration's.
    #[arg(long, value_name = "MAP")]
    map: Option<PathBuf>,
    /// Show what is seen in a browser, at this address [default: 127.0.0.1:8111].
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, require_equals = true, default_missing_value = DEFAULT_ADDRESS)]
    view: Option<SocketAddr>,
    /// Show it in Foxglove or Lichtblick, at this address [default: 127.0.0.1:8765].
    #[cfg(feature = "foxglove")]
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, require_equals = true, default_missing_value = crate::foxglove::DEFAULT_ADDRESS)]
    foxglove: Option<SocketAddr>,
}

/// The port of data packets as the command line writes it.
const DEFAULT_PORT: &str = "2368";

pub(super) fn run(arguments: &Arguments) -> Result<Completion> {
    let interface = arguments.interface;
    // Without a session there is one interface to speak of.
    let alone = interface.filter(|_| arguments.cid.is_none());
    let sensor_interface = arguments.sensor_interface.or(alone);
    let mut configuration = files::configuration(arguments.config.as_deref())?;
    let options = Options {
        roads: roads::configured(&mut configuration, arguments.map.as_deref())?,
        session: arguments.cid.map(|cid| Session { cid, interface }),
        sensor: arguments.velodyne.map(|port| SensorPort {
            port,
            interface: sensor_interface,
            address: arguments.sensor,
        }),
        publish_cloud: arguments.publish_cloud,
        sender_stamp: arguments.id,
        configuration,
        view: arguments.view.map(serve_view).transpose()?,
        onlooker: onlooker(arguments)?,
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

#[cfg(not(feature = "foxglove"))]
fn onlooker(_: &Arguments) -> Result<Option<Box<dyn Onlooker>>> {
    Ok(None)
}

#[cfg(feature = "foxglove")]
fn onlooker(arguments: &Arguments) -> Result<Option<Box<dyn Onlooker>>> {
    let Some(address) = arguments.foxglove else {
        return Ok(None);
    };
    let server = crate::foxglove::Server::start(address);
    let server = server.with_context(|| format!("cannot serve Foxglove at {address}"))?;
    tracing::info!(
        "foxglove: open ws://{} in Foxglove or Lichtblick",
        server.address()
    );
    Ok(Some(Box::new(server)))
}
