//! Where the vehicle is on the site, and how it goes on.

use super::advice::State;
use super::gap::{OwnMotion, Users};
use super::on_lane::Place;
use super::site::{Entry, Exit, Site};
use super::{RoundaboutParameters, Situation};
use crate::ego::Pose;
use crate::ego::wrapped_rad;
use crate::roadmap::{Polyline, Station};

/// Distance before a conflict zone at which one stands.
const STOP_M: f64 = 1.0;

/// A vehicle that waits to leave, before the first way that it has to cross.
pub(super) fn standing_inside(exit: &Exit) -> OwnMotion {
    let first = exit.conflicts.first();
    OwnMotion {
        front_m: first.map_or(0.0, |conflict| conflict.zone_m[0] - STOP_M),
        speed_mps: 0.0,
    }
}

/// A vehicle that waits: as near to the circle as it can stand without being in anybody's way.
pub(super) fn standing(entry: &Entry, own_length_m: f64) -> OwnMotion {
    // From the circle outward, to where the next zone leaves room for it.
    let mut stop_m = entry.way.length_m();
    for (index, conflict) in entry.conflicts.iter().enumerate().rev() {
        stop_m = conflict.zone_m[0] - STOP_M;
        let before = index
            .checked_sub(1)
            .and_then(|index| entry.conflicts.get(index));
        let room_m = before.map_or(f64::INFINITY, |before| stop_m - before.zone_m[1]);
        if room_m >= own_length_m {
            break;
        }
    }
    OwnMotion {
        front_m: stop_m,
        speed_mps: 0.0,
    }
}

/// Where the vehicle is on the site.
pub(super) struct Own {
    pub(super) state: State,
    pub(super) arm: Option<usize>,
    pub(super) lane: usize,
    pub(super) motion: Option<OwnMotion>,
}

impl Own {
    const WATCHING: Self = Self {
        state: State::Watching,
        arm: None,
        lane: 0,
        motion: None,
    };

    /// `last_arm` is the one that it was at before: who is on the circle comes past the ends of other ways in.
    pub(super) fn of(
        site: &Site,
        situation: &Situation<'_>,
        last_arm: Option<usize>,
        parameters: &RoundaboutParameters,
    ) -> Self {
        let Some(pose) = situation.vehicle else {
            return Self::WATCHING;
        };
        let [x, y, _] = pose.position_m;
        let (sine, cosine) = libm::sincos(pose.yaw_rad);
        let front_m = [
            x + parameters.own_front_m * cosine,
            y + parameters.own_front_m * sine,
        ];
        let speed_mps = situation.vehicle_speed_mps.max(0.0);
        let away_m = libm::hypot(x - site.centre_m[0], y - site.centre_m[1]);
        let is_inside = away_m < site.outer_m;
        for (arm, ways) in site.arms.iter().enumerate() {
            for (lane, entry) in ways.entries.iter().enumerate() {
                let Some(station) = on_way(&entry.way, pose) else {
                    continue;
                };
                if is_inside && last_arm != Some(arm) {
                    continue;
                }
                let motion = OwnMotion {
                    front_m: station.along_m + parameters.own_front_m,
                    speed_mps,
                };
                if motion.front_m < entry.way.length_m() + parameters.own_length_m {
                    return Self {
                        state: motion.state(entry, parameters),
                        arm: Some(arm),
                        lane,
                        motion: Some(motion),
                    };
                }
            }
        }
        let out_m = libm::hypot(front_m[0] - site.centre_m[0], front_m[1] - site.centre_m[1]);
        if out_m < site.outer_m {
            return Self {
                state: State::Circling,
                ..Self::WATCHING
            };
        }
        for (arm, ways) in site.arms.iter().enumerate() {
            if ways
                .exits
                .iter()
                .any(|exit| on_way(&exit.way, pose).is_some())
            {
                return Self {
                    state: State::Leaving,
                    arm: Some(arm),
                    ..Self::WATCHING
                };
            }
        }
        Self::WATCHING
    }
}

/// Where a vehicle is on a way, if it is no farther off than half a lane, and points along it.
fn on_way(way: &Polyline, pose: Pose) -> Option<Station> {
    const ASIDE_M: f64 = 2.5;
    const TURNED_RAD: f64 = 0.6;
    let station = way.nearest([pose.position_m[0], pose.position_m[1]])?;
    let turned_rad = wrapped_rad(pose.yaw_rad - station.heading_rad);
    (station.distance_m < ASIDE_M && turned_rad.abs() < TURNED_RAD).then_some(station)
}

impl Own {
    /// The vehicle on its way to leave by an exit, if it is on the circle or on that way.
    pub(super) fn leaving(
        &self,
        site: &Site,
        exit: &Exit,
        situation: &Situation<'_>,
        parameters: &RoundaboutParameters,
    ) -> Option<OwnMotion> {
        let pose = situation.vehicle?;
        let at_m = [pose.position_m[0], pose.position_m[1]];
        if !matches!(self.state, State::Circling | State::Leaving) {
            return None;
        }
        // Before its begin the way is that of the circle.
        let station = on_way(&exit.way, pose).filter(|station| station.along_m > 0.0);
        let along_m = match station {
            Some(station) => station.along_m,
            None if self.state == State::Circling => {
                let circle = site.rings[site.outermost_road()?].circle;
                -circle.radius_m * site.round_rad(circle.angle_rad(at_m), exit.mouth_rad)
            }
            None => return None,
        };
        Some(OwnMotion {
            front_m: along_m + parameters.own_front_m,
            speed_mps: situation.vehicle_speed_mps.max(0.0),
        })
    }

    /// Somebody who stands or goes before the vehicle on its own way in.
    pub(super) fn ahead(&self, entry: &Entry, users: Users<'_>) -> Option<u32> {
        let front_m = self.motion?.front_m;
        let ahead = users.iter().filter_map(|user| {
            let object = user.object;
            let station = entry
                .way
                .nearest([object.centre_m[0], object.centre_m[1]])?;
            // Across the way and along it, whichever way it is turned.
            let half_m = object.width_m / 2.0;
            let is_beside = station.distance_m > entry.width_m / 2.0 + half_m;
            let is_ahead = station.along_m + half_m > front_m;
            // Who is on the circle has a window of his own, and who leaves it is gone.
            let is_before_circle = station.along_m < entry.way.length_m() - half_m;
            let is_crossing = user
                .lanes
                .first()
                .is_some_and(|on| matches!(on.place, Place::Ring(_) | Place::Exit(..)));
            let counts = !is_beside && is_ahead && is_before_circle && !is_crossing;
            counts.then_some((station.along_m, object.id))
        });
        ahead.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, id)| id)
    }
}

impl OwnMotion {
    /// Whether it is time to brake.
    fn state(&self, entry: &Entry, parameters: &RoundaboutParameters) -> State {
        let stop_m = standing(entry, parameters.own_length_m).front_m - self.front_m;
        let brakes_m = self.speed_mps * self.speed_mps / (2.0 * parameters.deceleration_mps2);
        // A second of way is left to begin with it.
        if stop_m < brakes_m + self.speed_mps + STOP_M {
            State::Braking
        } else {
            State::Approaching
        }
    }
}
