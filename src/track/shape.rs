//! The box of an object, as it is known by now: its direction and its size, which grows with the
//! evidence.

use std::ops::Range;

use super::look::Look;
use super::spots::{Spot, places_m};
use super::view::View;
use crate::ego::wrapped_rad;
use crate::geometry::Rectangle;

/// What is known of an object's direction and size.
#[derive(Debug, Clone)]
pub(super) struct Shape {
    pub(super) yaw_rad: f64,
    pub(super) yaw_variance: f64,
    /// Length along and width across the yaw that were seen.
    pub(super) seen_m: [f64; 2],
    /// How sure it is that no more than that is there: 0 to 1.
    pub(super) whole: [f64; 2],
    pub(super) top_m: f64,
    pub(super) top_below_m: f64,
    /// From how far away that was seen.
    passed_range_m: f64,
    pub(super) floor_m: f64,
    /// Whether motion has shown which end is the front.
    pub(super) front_known: bool,
    /// How much like a lorry what drives is by its height and its class: 0 to 1.
    lorry: f64,
    /// Fits in a row that contradict the direction.
    contradictions: u32,
}

/// Size of the car whose hidden part is assumed: the average of new cars in Europe (ICCT,
/// European Vehicle Market Statistics 2019/20).
pub(super) const CAR_M: [f64; 2] = [4.3, 1.8];
/// Standard deviation of a car's length and width around it.
const CAR_DEVIATION_M: [f64; 2] = [0.4, 0.1];
/// The same of what drives and is as high as a lorry or a bus: 7 to 12 m (Directive 96/53/EC). With 10 m, hill's HOTA is
/// 65.7 instead of 67.5 (seeds 31 to 42); its lorry has 7.5 m, that of street 12 m.
const LORRY_M: [f64; 2] = [9.0, 2.5];
const LORRY_DEVIATION_M: [f64; 2] = [1.5, 0.1];
/// From a car's height to that of a lorry; vans are in between.
const LORRY_TOP_M: Range<f64> = 2.1..3.1;
/// How much higher than its highest return it is: half of what lies between two layers 17 m away. Without, 62 instead of 82 %
/// of the lorries of `street` are listed where they are (seeds 31 to 42).
const ABOVE_TOP_M: f64 = 0.3;
/// Standard deviation of a direction that nobody knows: uniform over a half turn.
pub(super) const UNKNOWN_YAW_RAD: f64 = 0.9;
/// A visible side between these is the front or rear of a car...
const END_ON_M: Range<f64> = 1.3..2.15;
/// ...if so little of the other is seen.
const END_ON_DEPTH_M: f64 = 0.9;

/// Where something goes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Course {
    /// Counter-clockwise from the local frame's x axis.
    pub(super) direction_rad: f64,
    pub(super) deviation_rad: f64,
    /// Whether there is no doubt of it.
    pub(super) is_clear: bool,
    /// Whether it may go backwards.
    pub(super) may_be_backwards: bool,
}

impl Shape {
    /// The shape of a first look.
    pub(super) fn first(spots: &[Spot], look: &Look, outline: &mut Vec<[f64; 2]>) -> Self {
        let (mut yaw_rad, deviation_rad) =
            fitted_yaw(spots, outline).unwrap_or((0.0, UNKNOWN_YAW_RAD));
        let mut extent = View::of(look, spots, yaw_rad).extent_m();
        if extent[0] < extent[1] {
            yaw_rad = wrapped_rad(yaw_rad + std::f64::consts::FRAC_PI_2);
            extent.swap(0, 1);
        }
        // A side as long as a vehicle is wide is its front or rear.
        if END_ON_M.contains(&extent[0]) && extent[1] < END_ON_DEPTH_M {
            yaw_rad = wrapped_rad(yaw_rad + std::f64::consts::FRAC_PI_2);
            extent.swap(0, 1);
        }
        Self {
            yaw_rad,
            yaw_variance: deviation_rad * deviation_rad,
            seen_m: extent,
            whole: [0.0; 2],
            top_m: look.top_m,
            top_below_m: look.top_below_m,
            passed_range_m: look.range_m,
            floor_m: look.floor_m,
            front_known: false,
            lorry: 0.0,
            contradictions: 0,
        }
    }

    /// Length and width to reckon with: of a vehicle at least a car's, until it was seen whole.
    /// `vehicle` is the probability that it is one.
    pub(super) fn size_m(&self, vehicle: f64) -> [f64; 2] {
        [0, 1].map(|axis| {
            // What drives and is a lorry has its whole length, though nobody may be sure of it: else 66 instead of 82 % of
            // the lorries of `street` are listed where they are.
            let hidden = (1.0 - self.whole[axis]) * vehicle.max(self.lorry);
            let assumed_m = self.between(CAR_M, LORRY_M)[axis];
            let missing_m = (assumed_m - self.seen_m[axis]).max(0.0);
            let least_m = if vehicle > 0.5 {
                [3.2, 1.5][axis]
            } else {
                SMALLEST_M
            };
            (self.seen_m[axis] + hidden * missing_m).max(least_m)
        })
    }

    /// Standard deviations of length and width.
    pub(super) fn size_deviation_m(&self, vehicle: f64) -> [f64; 2] {
        [0, 1].map(|axis| {
            let unsure = (1.0 - self.whole[axis]) * vehicle;
            0.05 + unsure * self.between(CAR_DEVIATION_M, LORRY_DEVIATION_M)[axis]
        })
    }

    /// What holds for it of two values for a car and for a lorry.
    fn between(&self, car: [f64; 2], lorry: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| car[axis] + self.lorry * (lorry[axis] - car[axis]))
    }

    /// Learns from a further look in the axes of the yaw, of what is rather a vehicle or not, and a lorry with a probability.
    pub(super) fn learn(&mut self, view: &View, look: &Look, is_vehicle: bool, lorry: f64) {
        /// Sizes grow within a few revolutions and shrink within some seconds.
        const GROW: f64 = 0.3;
        const SHRINK: f64 = 0.03;
        /// What no vehicle can be is forgotten at once, and what of it all is clearly not there.
        const CORRECT: f64 = 0.2;
        const MUCH_LESS: f64 = 0.9;
        const TOP_UP: f64 = 0.4;
        const TOP_DOWN: f64 = 0.1;
        /// Wholes are believed within a few revolutions near the sensor.
        const WHOLE: f64 = 0.15;
        const CLEAR_RANGE_M: f64 = 25.0;
        /// What is hidden is not reckoned with at once.
        const LORRY: f64 = 0.2;
        /// Of what shows so much of its length, the end shows, too.
        const LONG_M: f64 = 1.5;
        // Seen askew, a box is longer and wider than the object.
        let askew_rad = libm::sqrt(self.yaw_variance).min(0.5);
        let extent = view.extent_m();
        for axis in 0..2 {
            let skewed_m = extent[1 - axis] * libm::sin(askew_rad) * 0.5;
            let fresh_m = (extent[axis] - skewed_m).max(0.05);
            let gain = if fresh_m > self.seen_m[axis] {
                GROW
            } else {
                SHRINK
            };
            let is_whole = view.is_whole()[axis];
            let is_too_wide = axis == 1 && self.seen_m[1] > self.widest_m();
            let is_thin = axis == 1 && is_whole && extent[0] > LONG_M;
            // People stretch their arms and turn. Vehicles stay as they are: far less than was known is not them.
            let is_news = !is_vehicle || fresh_m < MUCH_LESS * self.seen_m[axis];
            let is_apart = look.is_apart && view.is_side_on(axis) && is_news;
            let is_whole = is_whole || is_apart;
            let is_wrong = is_apart || ((is_too_wide || is_thin) && fresh_m < self.seen_m[1]);
            let gain = if is_wrong { gain.max(CORRECT) } else { gain };
            if fresh_m > self.seen_m[axis] || is_whole || is_too_wide {
                self.seen_m[axis] += gain * (fresh_m - self.seen_m[axis]);
            }
            let clear = (CLEAR_RANGE_M / look.range_m.max(1.0)).min(1.0);
            if is_whole {
                self.whole[axis] += WHOLE * clear * (1.0 - self.whole[axis]);
            }
        }
        self.check_axes();
        self.floor_m = self.floor_m.min(look.floor_m);
        let top_m = self.believed_top_m(look);
        if top_m > self.top_m {
            self.top_m += TOP_UP * (top_m - self.top_m);
        } else if look.top_below_m < self.top_m {
            // A ray passed where it was thought to be: that was the crown of a tree.
            self.top_m += TOP_DOWN * (look.top_below_m - self.top_m);
        }
        let top_below_m = self.top_below_m.min(look.top_below_m).max(self.top_m);
        if top_below_m != self.top_below_m {
            (self.top_below_m, self.passed_range_m) = (top_below_m, look.range_m);
        }
        if self.front_known {
            // By its height alone false movers in a yard are half as many again, and people in groups 61 instead of 63 %.
            let share = lorry * lorry_share(self.top_m + ABOVE_TOP_M);
            self.lorry += LORRY * (share - self.lorry);
        }
    }

    /// How high a look shows it to be. What drives does not grow on its way: over what passed it when it was clearly nearer
    /// it rises only because the ground below it is less known.
    fn believed_top_m(&self, look: &Look) -> f64 {
        /// How much of the distance the ground may be off.
        const GROUND_OFF: f64 = 0.01;
        const FARTHER: f64 = 1.3;
        let off_m = GROUND_OFF * (look.range_m + self.passed_range_m);
        let may_be_ground = self.front_known
            && look.range_m > FARTHER * self.passed_range_m
            && look.top_m < self.top_below_m + off_m;
        if may_be_ground {
            look.top_m.min(self.top_below_m)
        } else {
            look.top_m
        }
    }

    /// Greatest width of a car, or of a lorry, which is higher.
    fn widest_m(&self) -> f64 {
        const WIDEST_M: f64 = 2.1;
        const WIDEST_TALL_M: f64 = 2.75;
        if self.is_tall() {
            WIDEST_TALL_M
        } else {
            WIDEST_M
        }
    }

    /// Whether it is higher than a car.
    pub(super) fn is_tall(&self) -> bool {
        is_tall(self.top_m)
    }

    /// What is wider than any vehicle, or clearly wider than long, was taken for its own end.
    fn check_axes(&mut self) {
        let [length_m, width_m] = self.seen_m;
        if !self.front_known && width_m > self.widest_m().max(length_m) {
            self.yaw_rad = wrapped_rad(self.yaw_rad + std::f64::consts::FRAC_PI_2);
            self.seen_m.swap(0, 1);
            self.whole = [0.0; 2];
        }
    }

    /// Takes a direction in, as one of four that a box has, or one of two that its length has.
    pub(super) fn measure_yaw(&mut self, yaw_rad: f64, deviation_rad: f64) {
        let quarter = std::f64::consts::FRAC_PI_2;
        let off = yaw_rad - self.yaw_rad;
        let off = off - quarter * libm::round(off / quarter);
        // A box that fits the returns may still be wrong; none turns it far at once.
        const FARTHEST_RAD: f64 = 0.5;
        const PATIENCE: u32 = 3;
        if off.abs() < FARTHEST_RAD {
            self.contradictions = 0;
            self.correct_yaw(off, deviation_rad);
        } else if !self.front_known {
            self.contradictions += 1;
            if self.contradictions > PATIENCE {
                self.contradictions = 0;
                self.yaw_rad = wrapped_rad(self.yaw_rad + off);
                self.yaw_variance = deviation_rad * deviation_rad;
                self.seen_m = self.seen_m.map(|side_m| 0.8 * side_m);
            }
        }
    }

    /// Takes the direction of motion in.
    pub(super) fn measure_course(&mut self, course: &Course) {
        let &Course {
            direction_rad,
            deviation_rad,
            is_clear,
            may_be_backwards,
        } = course;
        let off = wrapped_rad(direction_rad - self.yaw_rad);
        if !self.front_known {
            if is_clear {
                // The first clear motion says where the front is.
                if off.abs() > 0.6 {
                    if off.abs() < 2.5 {
                        self.seen_m = quarter_turned(off, self.seen_m);
                        self.whole = [0.0; 2];
                    }
                    (self.yaw_rad, self.yaw_variance) =
                        (direction_rad, deviation_rad * deviation_rad);
                }
                self.front_known = true;
            }
            return;
        }
        let off = if may_be_backwards && off.abs() > 2.0 {
            wrapped_rad(off + std::f64::consts::PI)
        } else {
            off
        };
        if off.abs() < 1.0 {
            self.correct_yaw(off, deviation_rad);
        } else if is_clear {
            (self.yaw_rad, self.yaw_variance) = (direction_rad, deviation_rad * deviation_rad);
        }
    }

    fn correct_yaw(&mut self, off: f64, deviation_rad: f64) {
        let gain = self.yaw_variance / (self.yaw_variance + deviation_rad * deviation_rad);
        self.yaw_rad = wrapped_rad(self.yaw_rad + gain * off);
        self.yaw_variance *= 1.0 - gain;
    }

    /// The direction after some seconds of turning at a rate.
    pub(super) fn predict(&mut self, rate_radps: f64, seconds: f64) {
        /// How fast a direction becomes unsure, rad/√s.
        const DRIFT: f64 = 0.15;
        self.yaw_rad = wrapped_rad(self.yaw_rad + rate_radps * seconds);
        self.yaw_variance =
            (self.yaw_variance + DRIFT * DRIFT * seconds).min(UNKNOWN_YAW_RAD * UNKNOWN_YAW_RAD);
    }
}

/// How much like a lorry a vehicle is by its height, from 0, a car, to 1.
pub(super) fn lorry_share(top_m: f64) -> f64 {
    let Range { start, end } = LORRY_TOP_M;
    ((top_m - start) / (end - start)).clamp(0.0, 1.0)
}

/// Whether what is so high is higher than a car.
pub(super) fn is_tall(top_m: f64) -> bool {
    const TALL_M: f64 = 2.3;
    top_m > TALL_M
}

/// Nothing on the road is smaller.
const SMALLEST_M: f64 = 0.3;

/// Length and width after the length turned out to lie across.
fn quarter_turned(off_rad: f64, seen_m: [f64; 2]) -> [f64; 2] {
    if (0.8..2.35).contains(&off_rad.abs()) {
        [seen_m[1], seen_m[0]]
    } else {
        seen_m
    }
}

/// The direction of a box around a group within a quarter turn, and its standard deviation;
/// `None` where there is too little to tell.
pub(super) fn fitted_yaw(spots: &[Spot], outline: &mut Vec<[f64; 2]>) -> Option<(f64, f64)> {
    /// Shorter sides show no direction.
    const SHORTEST_M: f64 = 1.0;
    const FEWEST: usize = 8;
    if spots.len() < FEWEST {
        return None;
    }
    outline.clear();
    outline.extend(places_m(spots));
    let rectangle = Rectangle::fit(outline, None);
    if rectangle.length_m < SHORTEST_M {
        return None;
    }
    // The scatter of a side divided by its length, and a grid of 3 degrees.
    let scatter_m = if rectangle.length_m > 2.2 { 0.15 } else { 0.3 };
    Some((
        rectangle.yaw_rad,
        (scatter_m / rectangle.length_m).max(0.04),
    ))
}
