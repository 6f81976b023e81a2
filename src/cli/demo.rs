//! `kreisel demo`: everything on one machine, without any set-up.

use std::io::{IsTerminal as _, Write as _};
use std::net::{Ipv4Addr, SocketAddr};
use std::time::Duration;

use anyhow::Result;
use clap::Args;

use super::run::serve_view;
use super::{Completion, block_on, simulate, stop_signal};
use crate::config::Configuration;
use crate::daemon::listener::Datagram;
use crate::daemon::session::Session;
use crate::daemon::{self, Options};
use crate::simulate::scenario::Scenario;
use crate::track::Class;
use crate::view::DEFAULT_ADDRESS;
use crate::wire::object_list::{Object, ObjectList};
use crate::wire::{Envelope, Message};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// End after so many seconds [default: at Ctrl-C].
    #[arg(long, value_name = "S", value_parser = simulate::duration)]
    duration: Option<f64>,
    /// Session to use on loopback.
    #[arg(long, value_name = "N", default_value_t = 253, value_parser = clap::value_parser!(u8).range(1..=254))]
    cid: u8,
    /// Noise of the simulated sensor follows from it.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// What to simulate; `kreisel simulate --list` names the scenarios.
    #[arg(long, value_name = "NAME", default_value = "roundabout-waiting", value_parser = simulate::find)]
    scenario: Scenario,
    /// Where to show it in a browser.
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, require_equals = true, default_value = DEFAULT_ADDRESS, default_missing_value = DEFAULT_ADDRESS)]
    view: SocketAddr,
}

/// senderStamp of the demo's objects, to tell them from those of another daemon.
const SENDER_STAMP: u32 = 2021;

pub(super) fn run(arguments: &Arguments) -> Result<Completion> {
    block_on(demonstrate(arguments))?;
    Ok(Completion::Done)
}

async fn demonstrate(arguments: &Arguments) -> Result<()> {
    let session = Session {
        cid: arguments.cid,
        interface: Some(Ipv4Addr::LOCALHOST),
    };
    let configuration = Configuration::default();
    let sender = session.sender(&configuration.session)?;
    // Without its view the demo is still worth watching.
    let view = serve_view(arguments.view);
    let view = view.inspect_err(|error| tracing::warn!("{error:#}")).ok();
    let title = match &view {
        Some(view) => format!("Open http://{} in a browser to see it.", view.address()),
        None => "Its view could not be served; the log says why.".into(),
    };
    let options = Options {
        session: Some(session),
        sensor: None,
        publish_cloud: false,
        roads: arguments.scenario.roads(),
        sender_stamp: SENDER_STAMP,
        configuration,
        view,
        onlooker: None,
    };
    let duration = arguments.duration.map(Duration::from_secs_f64);
    let stop = async {
        match duration {
            Some(duration) => tokio::select! {
                () = tokio::time::sleep(duration) => {}
                () = stop_signal() => {}
            },
            None => stop_signal().await,
        }
    };
    // Looking at the simulated world takes longer than perceiving it; nobody waits for that.
    let (ended, end) = tokio::sync::oneshot::channel();
    let (scenario, seed) = (arguments.scenario, arguments.seed);
    std::thread::spawn(move || {
        let sent = block_on(simulate::send(&scenario, seed, 1.0, &sender));
        // Nobody listens when the demo is over.
        let _ = ended.send(sent);
    });
    tokio::select! {
        result = daemon::run(options, stop) => Ok(result?),
        Ok(result) = end => result,
        result = show_objects(session, &title) => result,
    }
}

/// Shows every list on a terminal, and one a second in a pipe.
async fn show_objects(session: Session, title: &str) -> Result<()> {
    let (mut receiver, _sender) = session.join(&Configuration::default().session)?;
    let mut datagram = Datagram::default();
    let terminal = std::io::stdout().is_terminal();
    loop {
        receiver.receive(&mut datagram).await?;
        let Ok((envelope, _)) = Envelope::from_datagram(datagram.bytes()) else {
            continue;
        };
        let ours = envelope.data_type == ObjectList::ID && envelope.sender_stamp == SENDER_STAMP;
        let Ok(list) = ObjectList::decode(envelope.payload, envelope.payload_offset) else {
            continue;
        };
        if ours && (terminal || list.revolution % 10 == 0) {
            let text = table(&list);
            let mut out = std::io::stdout().lock();
            if terminal {
                write!(out, "\x1b[H\x1b[2J{title}\n\n")?;
            }
            write!(out, "{text}")?;
            out.flush()?;
        }
    }
}

fn table(list: &ObjectList) -> String {
    let mut text = format!(
        "revolution {}: {} objects in {:.2} ms\n{:>5} {:<12} {:>7} {:>7} {:>6} {:>6} {:>14} {:>7}\n",
        list.revolution,
        list.count,
        1000.0 * list.processing_time,
        "id",
        "class",
        "x m",
        "y m",
        "m/s",
        "yaw",
        "l x w x h m",
        "points"
    );
    for object in &list.objects.0 {
        text.push_str(&row(object));
    }
    text
}

fn row(object: &Object) -> String {
    let size = format!(
        "{:.1}x{:.1}x{:.1}",
        object.length, object.width, object.height
    );
    format!(
        "{:>5} {:<12} {:>7.1} {:>7.1} {:>6.1} {:>6.0} {:>14} {:>7}\n",
        object.object_id,
        Class::from_number(object.classification).map_or("?", Class::name),
        object.x,
        object.y,
        object.speed,
        object.yaw.to_degrees(),
        size,
        object.number_of_points
    )
}
