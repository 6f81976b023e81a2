//! `kreisel view`: a recording or a session in a browser.

use std::net::{Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context as _, Result, bail};
use clap::Args;
use tokio::sync::mpsc;
use tokio::time::{Instant, sleep_until};

use super::{Completion, block_on, files, stop_signal};
use crate::cloud::{CloudParameters, Intake, OwnVehicle, Scan};
use crate::config::Configuration;
use crate::daemon::session::{Datagram, Session};
use crate::ego::{Anchor, Placement, Pose};
use crate::pipeline::{Outcome, Pipeline, RevolutionReport, Step};
use crate::time::Time;
use crate::view::{self, Around, Control, DEFAULT_ADDRESS, Feed, Player};
use crate::wire::object_list::ObjectList;
use crate::wire::point_cloud::{CompactPointCloud, POINT_CLOUD_ID};
use crate::wire::recording::Entry;
use crate::wire::{Envelope, Message, Recording};

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
    let configuration = files::configuration(arguments.config.as_deref())?;
    let (bytes, mut completion) = files::read_recording(path)?;
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
    let is_cloud = |entry: &&Entry<'_>| entry.envelope.data_type == POINT_CLOUD_ID;
    let times: Vec<Time> = entries
        .iter()
        .filter(is_cloud)
        .map(|entry| entry.envelope.time())
        .collect();
    let (Some(begin), Some(end)) = (times.iter().min(), times.iter().max()) else {
        bail!("{}: byte 0: no point cloud to show", path.display());
    };
    let (feed, controls) = serve(arguments.address)?;
    let mut playback = Playback {
        pipeline: Pipeline::new(&configuration, 0),
        configuration,
        entries,
        next: 0,
        last: None,
        feed,
        player: Player {
            at_s: 0.0,
            duration_s: (*end - *begin).seconds(),
            is_playing: true,
            speed: 1.0,
            run: 0,
        },
        begin: *begin,
        sought_s: None,
    };
    block_on(async {
        tokio::select! {
            () = playback.run(controls) => Ok(()),
            () = stop_signal() => Ok(()),
        }
    })?;
    Ok(completion)
}

/// A recording that is played, and how far.
struct Playback<'a> {
    configuration: Configuration,
    pipeline: Pipeline,
    entries: Vec<Entry<'a>>,
    next: usize,
    /// The revolution that is shown.
    last: Option<RevolutionReport>,
    feed: Feed,
    player: Player,
    begin: Time,
    /// Where it goes without showing what lies between.
    sought_s: Option<f64>,
}

/// Speeds that a viewer may choose.
const SPEEDS: std::ops::RangeInclusive<f64> = 0.1..=100.0;

/// Longest pause between two revolutions that is waited for; what is longer is a gap.
const LONGEST_PAUSE_S: f64 = 1.0;

/// How often somebody is looked for before it begins, and how often it is shown while it is paused.
const IDLE: Duration = Duration::from_millis(200);

impl Playback<'_> {
    /// Plays for ever; at its end the recording waits to be begun anew.
    async fn run(&mut self, mut controls: mpsc::Receiver<Control>) {
        while !self.feed.is_watched() {
            tokio::time::sleep(IDLE).await;
        }
        let mut due = Instant::now();
        loop {
            let is_seeking = self.sought_s.is_some();
            let wake = if is_seeking || self.player.is_playing {
                due
            } else {
                Instant::now() + IDLE
            };
            tokio::select! {
                biased;
                Some(control) = controls.recv() => {
                    self.obey(control);
                    due = Instant::now();
                    continue;
                }
                () = sleep_until(wake) => {}
            }
            if !is_seeking && !self.player.is_playing {
                // Whoever comes now sees something, too.
                self.show();
                continue;
            }
            let before_s = self.player.at_s;
            if !self.revolve() {
                self.player.is_playing = false;
                self.sought_s = None;
            }
            match self.sought_s {
                Some(sought_s) if self.player.at_s < sought_s => {
                    // Viewers and signals have their turn.
                    tokio::task::yield_now().await;
                }
                _ => {
                    self.sought_s = None;
                    self.show();
                    let passed_s = (self.player.at_s - before_s).clamp(0.0, LONGEST_PAUSE_S);
                    due = due.max(Instant::now() - IDLE);
                    due += Duration::from_secs_f64(passed_s / self.player.speed);
                }
            }
        }
    }

    fn obey(&mut self, control: Control) {
        match control {
            Control::Play(is_playing) => {
                self.player.is_playing = is_playing;
                if is_playing && self.next == self.entries.len() {
                    self.begin_anew();
                }
            }
            Control::Speed(speed) if speed.is_finite() => {
                self.player.speed = speed.clamp(*SPEEDS.start(), *SPEEDS.end());
            }
            Control::Seek(at_s) if at_s.is_finite() => {
                if at_s < self.player.at_s {
                    self.begin_anew();
                }
                self.sought_s = Some(at_s.clamp(0.0, self.player.duration_s));
            }
            Control::Step(revolutions) => {
                self.player.is_playing = false;
                if revolutions > 0 {
                    self.revolve();
                    self.show();
                } else {
                    let at_s = self.time_before(revolutions.unsigned_abs() as usize);
                    self.begin_anew();
                    self.sought_s = Some(at_s);
                }
            }
            Control::Speed(_) | Control::Seek(_) => {}
        }
    }

    /// The time of the revolution so many before the one that is shown, seconds since the begin.
    fn time_before(&self, revolutions: usize) -> f64 {
        let passed = self.entries[..self.next].iter().rev();
        let mut clouds = passed.filter(|entry| entry.envelope.data_type == POINT_CLOUD_ID);
        let entry = clouds.nth(revolutions);
        entry.map_or(0.0, |entry| (entry.envelope.time() - self.begin).seconds())
    }

    fn begin_anew(&mut self) {
        self.pipeline = Pipeline::new(&self.configuration, 0);
        (self.next, self.last) = (0, None);
        self.player.at_s = 0.0;
        self.player.run = self.player.run.wrapping_add(1);
    }

    /// Perceives up to the next revolution that can be answered. Gives whether there was one.
    fn revolve(&mut self) -> bool {
        while let Some(entry) = self.entries.get(self.next) {
            self.next += 1;
            self.feed.begin();
            let begun = Instant::now();
            let note = |step| self.feed.note(step);
            let Ok(Outcome::Revolution(report)) =
                self.pipeline.handle_watched(&entry.envelope, note)
            else {
                continue;
            };
            let processing_s = begun.elapsed().as_secs_f32();
            for frame in self.pipeline.publish_objects(report.time, processing_s) {
                self.feed.put(frame);
            }
            self.pipeline.update_map();
            self.feed.note(Step::Map);
            for frame in self.pipeline.publish_map(report.time) {
                self.feed.put(frame);
            }
            self.last = Some(report);
            self.player.at_s = (report.time - self.begin).seconds();
            return true;
        }
        false
    }

    fn show(&mut self) {
        if let Some(report) = &self.last {
            self.feed.put_message(report.time, &self.pipeline.status());
            self.feed.show(&self.pipeline, report, Some(self.player));
        }
    }
}

/// Shows a session: its points, and what a daemon says of them.
async fn watch(session: Session, mut feed: Feed) -> Result<()> {
    let configuration = Configuration::default();
    let (mut receiver, _sender) = session.join(&configuration.session)?;
    let (mut datagram, mut seen) = (Datagram::default(), Seen::default());
    loop {
        receiver.receive(&mut datagram).await?;
        let Ok((envelope, _)) = Envelope::from_datagram(datagram.bytes()) else {
            continue;
        };
        match envelope.data_type {
            POINT_CLOUD_ID => seen.take(&envelope, &configuration.cloud),
            2020..=2039 => {
                feed.put(datagram.bytes());
                if envelope.data_type == ObjectList::ID
                    && let Ok(list) = ObjectList::decode(envelope.payload, envelope.payload_offset)
                {
                    seen.show(&list, envelope.time(), &mut feed);
                }
            }
            _ => {}
        }
    }
}

/// The last point cloud of a session that is watched, and where the vehicle was before.
#[derive(Default)]
struct Seen {
    intake: Intake,
    scan: Scan,
    before: Option<Pose>,
    placements: Vec<Placement>,
}

impl Seen {
    fn take(&mut self, envelope: &Envelope<'_>, parameters: &CloudParameters) {
        let Ok(cloud) = CompactPointCloud::decode(envelope.payload, envelope.payload_offset) else {
            return;
        };
        if let Ok(revolution) = self.intake.accept(envelope, cloud, parameters) {
            self.scan
                .fill(&revolution, &OwnVehicle::default(), parameters);
        }
    }

    /// Shows the points of the revolution that a list answers, placed by what it says of the
    /// vehicle. Where its sensor is mounted a list does not say: it is taken to be where the vehicle is.
    fn show(&mut self, list: &ObjectList, time: Time, feed: &mut Feed) {
        let sensor = if list.ego_known {
            Pose {
                position_m: [list.ego_x, list.ego_y, list.ego_z],
                yaw_rad: f64::from(list.ego_yaw),
            }
        } else {
            Pose::SENSOR
        };
        let before = self.before.replace(sensor).unwrap_or(sensor);
        if self.scan.time() != time {
            self.scan = Scan::default();
        }
        let columns = self.scan.columns();
        self.placements.clear();
        self.placements.extend((1..=columns).map(|column| {
            before
                .toward(&sensor, column as f64 / columns as f64)
                .placement()
        }));
        feed.show_points(&Around {
            scan: &self.scan,
            placements: &self.placements,
            anchor: Anchor::IDENTITY,
            sensor,
            ground_below_m: 0.0,
        });
    }
}
