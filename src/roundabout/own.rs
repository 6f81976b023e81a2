//! Where the vehicle is on the site, and how it goes on.

use super::advice::State;
use super::gap::OwnMotion;
use super::site::{Conflict, Entry, Site};
use super::{RoundaboutParameters, Situation};
use crate::ego::wrapped_rad;
use crate::roadmap::Polyline;

/// Distance before a conflict zone at which one stands.
const STOP_M: f64 = 1.0;

/// A vehicle that waits: as near to the circle as it can stand without being in anybody's way.
pub(super) fn standing(site: &Site, entry: &Entry, own_length_m: f64) -> OwnMotion {
    let zone_m = |conflict: &Conflict| {
        let half_m = site.rings[conflict.ring].width_m / 2.0;
        [conflict.along_m - half_m, conflict.along_m + half_m]
    };
    // From the circle outward, to where the next zone leaves room for it.
    let mut stop_m = entry.way.length_m();
    for (index, conflict) in entry.conflicts.iter().enumerate().rev() {
        stop_m = zone_m(conflict)[0] - STOP_M;
        let before = index
            .checked_sub(1)
            .and_then(|index| entry.conflicts.get(index));
        let room_m = before.map_or(f64::INFINITY, |before| stop_m - zone_m(before)[1]);
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

    pub(super) fn of(
        site: &Site,
        situation: &Situation<'_>,
        parameters: &RoundaboutParameters,
    ) -> Self {
        /// A vehicle is on a way if it is no farther off than half a lane, and points along it.
        const ASIDE_M: f64 = 2.5;
        const TURNED_RAD: f64 = 0.6;
        let Some(pose) = situation.vehicle else {
            return Self::WATCHING;
        };
        let [x, y, _] = pose.position_m;
        let (sine, cosine) = libm::sincos(pose.yaw_rad);
        let front_m = [
            x + parameters.own_front_m * cosine,
            y + parameters.own_front_m * sine,
        ];
        let is_on = |way: &Polyline| {
            let station = way.nearest([x, y])?;
            let turned_rad = wrapped_rad(pose.yaw_rad - station.heading_rad);
            (station.distance_m < ASIDE_M && turned_rad.abs() < TURNED_RAD).then_some(station)
        };
        let speed_mps = situation.vehicle_speed_mps.max(0.0);
        for (arm, ways) in site.arms.iter().enumerate() {
            for (lane, entry) in ways.entries.iter().enumerate() {
                let Some(station) = is_on(&entry.way) else {
                    continue;
                };
                let motion = OwnMotion {
                    front_m: station.along_m + parameters.own_front_m,
                    speed_mps,
                };
                if motion.front_m < entry.way.length_m() + parameters.own_length_m {
                    return Self {
                        state: motion.state(site, entry, parameters),
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
            if ways.exits.iter().any(|exit| is_on(&exit.way).is_some()) {
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

impl OwnMotion {
    /// Whether it is time to brake.
    fn state(&self, site: &Site, entry: &Entry, parameters: &RoundaboutParameters) -> State {
        let stop_m = standing(site, entry, parameters.own_length_m).front_m - self.front_m;
        let brakes_m = self.speed_mps * self.speed_mps / (2.0 * parameters.deceleration_mps2);
        // A second of way is left to begin with it.
        if stop_m < brakes_m + self.speed_mps + STOP_M {
            State::Braking
        } else {
            State::Approaching
        }
    }
}
