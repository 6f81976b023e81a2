//! A session that is watched in the view, without perceiving anything: its points, and what a daemon in it says.

use std::time::{Duration, Instant};

use anyhow::Result;

use crate::cloud::{CloudParameters, Intake, OwnVehicle, Scan};
use crate::config::Configuration;
use crate::daemon::listener::Datagram;
use crate::daemon::session::Session;
use crate::ego::{Anchor, Placement, Pose};
use crate::pipeline::OWN_IDS;
use crate::time::Time;
use crate::view::{Around, Feed};
use crate::wire::object_list::ObjectList;
use crate::wire::point_cloud::{CompactPointCloud, POINT_CLOUD_ID};
use crate::wire::{Envelope, Message};

/// Shows a session: its points, and what a daemon says of them.
pub(super) async fn watch(session: Session, mut feed: Feed) -> Result<()> {
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
            // Two daemons would be shown as one that leaps.
            id if OWN_IDS.contains(&id) && seen.follows(envelope.sender_stamp) => {
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
    /// The daemon that is followed, and when it was heard last.
    followed: Option<(u32, Instant)>,
    placements: Vec<Placement>,
}

/// A daemon that is silent for so long is followed no more: it sends a list each revolution.
const SILENCE: Duration = Duration::from_secs(3);

impl Seen {
    /// Whether what a sender says is shown: that of the first one, as long as it says anything.
    fn follows(&mut self, sender_stamp: u32) -> bool {
        let is_other = |(followed, heard): (u32, Instant)| {
            followed != sender_stamp && heard.elapsed() < SILENCE
        };
        if self.followed.is_some_and(is_other) {
            return false;
        }
        self.followed = Some((sender_stamp, Instant::now()));
        true
    }

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
        let told = Pose {
            position_m: [list.ego_x, list.ego_y, list.ego_z],
            yaw_rad: f64::from(list.ego_yaw),
        };
        let is_sound =
            told.yaw_rad.is_finite() && told.position_m.iter().all(|metres| metres.is_finite());
        let sensor = if list.ego_known && is_sound {
            told
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
