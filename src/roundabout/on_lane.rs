//! Where on the lanes of a site somebody is.

use super::site::Site;
use crate::roadmap::Polyline;

/// Who has been seen for less than this may be faster than he seems (`scripts/evaluate-roundabouts --seeds 1-29`: with 1.0
/// instead of 1.5 s 3 instead of 1 of 530 gaps at the own arm are not there).
pub(super) const NEW_S: f64 = 1.5;
/// The same beside the road, where nobody is fast (seeds 1-40: as many gaps are not there as with 1.5 s; with none three
/// instead of two of 2,700 at exits).
pub(super) const NEW_SLOW_S: f64 = 1.0;

/// A lane of the site.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Place {
    /// On a ring of this number.
    Ring(usize),
    /// On the way in of an arm: arm, lane.
    Entry(usize, usize),
    /// On the way out of an arm: arm, lane.
    Exit(usize, usize),
    /// On none.
    Elsewhere,
}

/// Where on a lane somebody is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnLane {
    /// The lane.
    pub place: Place,
    /// Probability that it is this one.
    pub probability: f64,
    /// Along it: on a ring from east, counter-clockwise; on a way from its beginning.
    pub along_m: f64,
    /// To the left of its middle positive; on a ring, outward.
    pub offset_m: f64,
    /// Along it positive: speed as far as it leads along the lane.
    pub speed_mps: f64,
    /// The same in the mean of the last moments.
    pub mean_speed_mps: f64,
    /// For how long somebody has been seen since he is listed.
    pub known_s: f64,
    /// Arm by which somebody came in, if that was seen.
    pub came_in_by: Option<usize>,
}

impl OnLane {
    /// So much further along the lane: from a way in onto the circle.
    pub(super) fn moved_on(self, site: &Site, gone_m: f64) -> Self {
        // Angles count counter-clockwise, whichever way one drives.
        let side = site.side();
        let along_m = match self.place {
            Place::Ring(_) => self.along_m + side * gone_m,
            _ => self.along_m + gone_m,
        };
        let (Place::Entry(arm, lane), Some(road)) = (self.place, site.outermost_road()) else {
            return Self { along_m, ..self };
        };
        let entry = &site.arms[arm].entries[lane];
        let past_m = along_m - entry.way.length_m();
        if past_m < 0.0 {
            return Self { along_m, ..self };
        }
        let radius_m = site.rings[road].circle.radius_m;
        Self {
            place: Place::Ring(road),
            along_m: radius_m * entry.mouth_rad + side * past_m,
            ..self
        }
    }

    /// Where that is in the local frame; nowhere on none.
    pub(super) fn place_m(&self, site: &Site) -> Option<[f64; 2]> {
        let on_way = |way: &Polyline| way.at(self.along_m).0;
        match self.place {
            Place::Ring(ring) => {
                let circle = site.rings[ring].circle;
                Some(circle.at(self.along_m / circle.radius_m))
            }
            Place::Entry(arm, lane) => Some(on_way(&site.arms[arm].entries[lane].way)),
            Place::Exit(arm, lane) => Some(on_way(&site.arms[arm].exits[lane].way)),
            Place::Elsewhere => None,
        }
    }
}
