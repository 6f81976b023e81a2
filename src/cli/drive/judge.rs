//! What becomes of a drive: collisions and near misses, by the boxes of all at all times.

use super::driver::{Driver, Part};
use crate::ego::wrapped_rad;
use crate::geometry::turned;
use crate::roundabout::RoundaboutParameters;
use crate::simulate::Truth;

/// Who comes to where the vehicle was, within this time after it, is nearly missed (Allen and others 1978: the
/// post-encroachment time).
const NEAR_MISS_S: f64 = 1.0;
/// Width of the vehicle.
const WIDTH_M: f64 = 1.8;
/// Traffic does not see the vehicle: who goes its way, within this, and faster, runs into it where others would brake.
const SAME_WAY_RAD: f64 = 0.6;
/// Who came into the circle so shortly before he was met would have had to give way (the thesis' margin).
const CAME_IN_S: f64 = 2.0;

/// A rectangle on the ground.
#[derive(Debug, Clone, Copy)]
struct Footprint {
    centre_m: [f64; 2],
    yaw_rad: f64,
    half_m: [f64; 2],
}

pub(super) struct Judge {
    own_length_m: f64,
    own_front_m: f64,
    revolutions: Vec<Revolution>,
    entered_s: Option<f64>,
}

struct Revolution {
    time_s: f64,
    part: Part,
    /// Middle of the circle, as its driver takes it to lie.
    middle_m: [f64; 2],
    own: Footprint,
    others: Vec<Footprint>,
}

/// What became of a drive.
pub(super) struct Outcome {
    /// When the vehicle was on the circle, from the begin of the drive.
    pub(super) entered_s: Option<f64>,
    /// With how many it collided.
    pub(super) collisions: usize,
    /// How many it nearly missed on its way in or out.
    pub(super) near_misses: usize,
    /// How many ran into it, on the circle or out of it, who would have had to give way.
    pub(super) run_into: usize,
}

impl Judge {
    pub(super) fn new(parameters: &RoundaboutParameters) -> Self {
        Self {
            own_length_m: parameters.own_length_m,
            own_front_m: parameters.own_front_m,
            revolutions: vec![],
            entered_s: None,
        }
    }

    pub(super) fn take(&mut self, truth: &Truth, driver: &Driver) {
        let time_s = truth.time.seconds();
        let begin_s = self
            .revolutions
            .first()
            .map_or(time_s, |first| first.time_s);
        if driver.is_on_circle() {
            self.entered_s.get_or_insert(time_s - begin_s);
        }
        let [x, y, _] = truth.sensor_m;
        let ahead_m = self.own_front_m - self.own_length_m / 2.0;
        let (sine, cosine) = libm::sincos(truth.sensor_yaw_rad);
        let others = truth.objects.iter().map(|user| Footprint {
            centre_m: user.centre_m,
            yaw_rad: user.yaw_rad,
            half_m: [user.size_m[0] / 2.0, user.size_m[1] / 2.0],
        });
        let [to_x_m, to_y_m] = turned(&driver.to_middle_m(), -sine, cosine);
        self.revolutions.push(Revolution {
            time_s,
            part: driver.part(),
            middle_m: [x + to_x_m, y + to_y_m],
            own: Footprint {
                centre_m: [x + ahead_m * cosine, y + ahead_m * sine],
                yaw_rad: truth.sensor_yaw_rad,
                half_m: [self.own_length_m / 2.0, WIDTH_M / 2.0],
            },
            others: others.collect(),
        });
    }

    pub(super) fn outcome(&self) -> Outcome {
        let count = self
            .revolutions
            .first()
            .map_or(0, |first| first.others.len());
        let mut outcome = Outcome {
            entered_s: self.entered_s,
            collisions: 0,
            near_misses: 0,
            run_into: 0,
        };
        for other in 0..count {
            match self.encounter(other) {
                Some(Encounter::Collision) => outcome.collisions += 1,
                Some(Encounter::RunInto) => outcome.run_into += 1,
                Some(Encounter::NearMiss) => outcome.near_misses += 1,
                None => {}
            }
        }
        outcome
    }

    /// The worst encounter with one of the others.
    fn encounter(&self, other: usize) -> Option<Encounter> {
        self.contact(other).or_else(|| {
            let is_missed = |index| self.is_missed(index, other);
            (0..self.revolutions.len())
                .any(is_missed)
                .then_some(Encounter::NearMiss)
        })
    }

    /// The first time that both are at one place.
    fn contact(&self, other: usize) -> Option<Encounter> {
        let revolutions = self.revolutions.iter();
        let now = revolutions
            .clone()
            .find(|now| now.own.overlaps(&now.others[other]))?;
        let just_before =
            |then: &&Revolution| (now.time_s - CAME_IN_S..now.time_s).contains(&then.time_s);
        let there = &now.others[other];
        let is_run_into = match now.part {
            Part::Entry => false,
            // Who comes into the circle, or comes up from behind, would have had to give way.
            Part::Circle => {
                let mut before = revolutions.filter(just_before);
                let came_in = before.any(|then| !then.others[other].goes_round(then.middle_m));
                came_in || !now.own.runs_into(there)
            }
            Part::Exit => now.own.is_run_into_by(there),
        };
        Some(if is_run_into {
            Encounter::RunInto
        } else {
            Encounter::Collision
        })
    }

    /// Whether one of the others comes too soon to where the vehicle is in a revolution.
    fn is_missed(&self, index: usize, other: usize) -> bool {
        let now = &self.revolutions[index];
        let later = self.revolutions[index + 1..]
            .iter()
            .take_while(|later| later.time_s - now.time_s < NEAR_MISS_S);
        let mut later = later.map(|later| &later.others[other]);
        match now.part {
            Part::Circle => false,
            Part::Entry => later.any(|there| now.own.overlaps(there)),
            // Who follows it out comes later than who crosses.
            Part::Exit => {
                later.any(|there| now.own.overlaps(there) && !now.own.goes_along_with(there))
            }
        }
    }
}

enum Encounter {
    Collision,
    NearMiss,
    RunInto,
}

impl Footprint {
    /// Whether two rectangles have a place in common: no side of either parts them.
    fn overlaps(&self, other: &Self) -> bool {
        let apart_m = [0, 1].map(|axis| other.centre_m[axis] - self.centre_m[axis]);
        [self, other].iter().all(|one| {
            [0.0, std::f64::consts::FRAC_PI_2].iter().all(|turn_rad| {
                let (sine, cosine) = libm::sincos(one.yaw_rad + turn_rad);
                let along_m = (apart_m[0] * cosine + apart_m[1] * sine).abs();
                along_m < self.reach_m([cosine, sine]) + other.reach_m([cosine, sine])
            })
        })
    }

    /// How far it reaches from its middle in a direction.
    fn reach_m(&self, [x, y]: [f64; 2]) -> f64 {
        let (sine, cosine) = libm::sincos(self.yaw_rad);
        let [length_m, width_m] = self.half_m;
        length_m * (x * cosine + y * sine).abs() + width_m * (y * cosine - x * sine).abs()
    }

    fn goes_along_with(&self, other: &Self) -> bool {
        wrapped_rad(other.yaw_rad - self.yaw_rad).abs() < SAME_WAY_RAD
    }

    /// Whether it goes round a middle counter-clockwise.
    fn goes_round(&self, middle_m: [f64; 2]) -> bool {
        let [x, y] = [0, 1].map(|axis| self.centre_m[axis] - middle_m[axis]);
        let round_rad = libm::atan2(x, -y);
        wrapped_rad(self.yaw_rad - round_rad).abs() < SAME_WAY_RAD
    }

    /// Whether another one comes from behind, the same way.
    fn is_run_into_by(&self, other: &Self) -> bool {
        self.goes_along_with(other) && self.is_behind(other)
    }

    /// Whether it comes from behind another one, the same way.
    fn runs_into(&self, other: &Self) -> bool {
        self.goes_along_with(other) && !self.is_behind(other)
    }

    /// Whether another one is behind it.
    fn is_behind(&self, other: &Self) -> bool {
        let (sine, cosine) = libm::sincos(self.yaw_rad);
        let [x, y] = [0, 1].map(|axis| other.centre_m[axis] - self.centre_m[axis]);
        x * cosine + y * sine < 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn footprint(x: f64, y: f64, yaw_rad: f64) -> Footprint {
        Footprint {
            centre_m: [x, y],
            yaw_rad,
            half_m: [2.0, 1.0],
        }
    }

    #[test]
    fn rectangles_overlap_where_no_side_parts_them() {
        let own = footprint(0.0, 0.0, 0.0);
        assert!(own.overlaps(&footprint(3.9, 0.0, 0.0)));
        assert!(!own.overlaps(&footprint(4.1, 0.0, 0.0)));
        assert!(!own.overlaps(&footprint(0.0, 3.1, std::f64::consts::FRAC_PI_2)));
        assert!(own.overlaps(&footprint(0.0, 2.9, std::f64::consts::FRAC_PI_2)));
        // Corner to corner.
        assert!(own.overlaps(&footprint(2.9, 1.9, 0.78)));
        assert!(!own.overlaps(&footprint(3.6, 2.6, 0.78)));
    }

    #[test]
    fn who_goes_round_is_told_from_who_comes_in() {
        let goes_round = |yaw_rad: f64| footprint(10.0, 0.0, yaw_rad).goes_round([0.0; 2]);
        assert!(goes_round(std::f64::consts::FRAC_PI_2) && goes_round(1.2));
        // Towards the middle, and the other way round.
        assert!(!goes_round(std::f64::consts::PI) && !goes_round(-std::f64::consts::FRAC_PI_2));
    }

    #[test]
    fn who_cuts_in_had_to_give_way_and_who_went_round_before_had_not() {
        let own = footprint(0.0, -10.0, 0.0);
        let judged = |before: Footprint| {
            let at = |time_s: f64, other: Footprint| Revolution {
                time_s,
                part: Part::Circle,
                middle_m: [0.0; 2],
                own,
                others: vec![other],
            };
            let judge = Judge {
                own_length_m: 4.0,
                own_front_m: 2.0,
                revolutions: vec![at(0.0, before), at(1.0, footprint(3.5, -10.0, 0.3))],
                entered_s: None,
            };
            let outcome = judge.outcome();
            [outcome.collisions, outcome.run_into]
        };
        // From below, and from behind on the circle.
        assert_eq!(judged(footprint(4.0, -16.0, 1.5)), [0, 1]);
        assert_eq!(judged(footprint(-7.0, -7.0, -0.7)), [1, 0]);
    }

    #[test]
    fn who_comes_from_behind_runs_into_it_and_who_comes_across_does_not() {
        let own = footprint(0.0, 0.0, 0.0);
        assert!(own.is_run_into_by(&footprint(-3.0, 0.5, 0.2)));
        assert!(!own.is_run_into_by(&footprint(3.0, 0.5, 0.2)));
        assert!(!own.is_run_into_by(&footprint(-3.0, 0.5, 1.5)));
        assert!(own.runs_into(&footprint(3.0, 0.5, 0.2)));
        assert!(!own.runs_into(&footprint(3.0, 0.5, 0.8)));
    }
}
