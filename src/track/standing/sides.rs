//! The box of a vehicle that stands, by all that was seen of it of late.
//!
//! A single look may hold a piece of what stands beside, or miss an end. But what stands has the same
//! sides in every look, so its direction is the one in which the returns of all looks lie close to
//! edges, and it ends where most looks do, a look counting by its returns: a poor one takes nothing
//! from what a good one told. What nobody saw is a car's, or a lorry's of what is so high, and lies behind.

use std::f64::consts::FRAC_PI_2;
use std::sync::LazyLock;

use crate::ego::wrapped_rad;
use crate::geometry::{DIRECTIONS, Extent, Rectangle, closest_rad, mean_closeness, turned};
use crate::track::shape::lorry_share;

/// What was seen of the sides.
#[derive(Debug, Clone)]
pub(super) struct Sides {
    /// Of each direction that is tried, how close all returns lie to edges.
    closeness: [f32; DIRECTIONS],
    looks: [Outermost; MOST_LOOKS],
    place: Rectangle,
    /// How high it is in the mean of what looks show.
    pub(super) height_m: f64,
}

/// The outermost returns of one look.
#[derive(Debug, Clone, Copy)]
struct Outermost {
    places_m: [[f64; 2]; WAYS],
    /// How many returns it had, the less the longer ago; 0 for none.
    worth: f64,
}

/// Looks that count: those of the greatest worth.
const MOST_LOOKS: usize = 8;
/// What is forgotten of a look with each later one.
const FORGOTTEN: f64 = 0.01;
/// Directions in which the outermost return is remembered, all around.
const WAYS: usize = 16;

/// Sizes of a kind of vehicle.
struct Kind {
    /// Size of one of which less is seen.
    size_m: [f64; 2],
    /// What is longer or wider is rather none, and what is shorter, seen side-on.
    longest_m: f64,
    widest_m: f64,
    shortest_m: f64,
}

/// The size is a little less than that of new ones on average, for corners are round.
const CAR: Kind = Kind {
    size_m: [4.2, 1.75],
    longest_m: 5.0,
    widest_m: 2.0,
    shortest_m: 2.7,
};
/// From vans to lorries with a trailer: by this length the middle of what has 4.5 to 12.5 m is within 2 m. The greatest sizes are
/// those of Directive 96/53/EC. Without, 42 instead of 60 % of the lorries and buses that stand are listed where they are
/// (`strangers`, seeds 61 to 68).
const LORRY: Kind = Kind {
    size_m: [8.5, 2.5],
    longest_m: 18.75,
    widest_m: 2.6,
    shortest_m: 5.0,
};
/// How much more a metre of width says against a way round than one of length.
const WIDE_WEIGHT: f64 = 4.0;
/// Cosine between the line of sight and an axis up to which all of it is seen.
const SIDE_ON: f64 = 0.5;

impl Sides {
    /// What a first look shows: its returns relative to the sensor, where that is, and how high it is.
    pub(super) fn new(places_m: &[[f64; 2]], sensor_m: [f64; 2], height_m: f64) -> Self {
        let nothing = Outermost {
            places_m: [[0.0; 2]; WAYS],
            worth: 0.0,
        };
        let mut sides = Self {
            closeness: [0.0; DIRECTIONS],
            looks: [nothing; MOST_LOOKS],
            place: Rectangle {
                centre_m: sensor_m,
                yaw_rad: 0.0,
                length_m: 0.0,
                width_m: 0.0,
            },
            height_m,
        };
        sides.see(places_m, sensor_m, height_m);
        sides
    }

    /// Takes a further look in.
    pub(super) fn see(&mut self, places_m: &[[f64; 2]], sensor_m: [f64; 2], height_m: f64) {
        /// Share of a look in what is known.
        const FRESH: f64 = 0.1;
        self.height_m += FRESH * (height_m - self.height_m);
        let (fresh, returns) = (mean_closeness(places_m), places_m.len() as f32);
        for (known, fresh) in self.closeness.iter_mut().zip(fresh) {
            *known += returns * fresh - FORGOTTEN as f32 * *known;
        }
        for known in &mut self.looks {
            known.worth *= 1.0 - FORGOTTEN;
        }
        let fresh = Outermost::of(places_m, sensor_m);
        let least = self
            .looks
            .iter_mut()
            .min_by(|a, b| a.worth.total_cmp(&b.worth));
        if let Some(least) = least.filter(|least| least.worth < fresh.worth) {
            *least = fresh;
        }
        self.place = self.fit(sensor_m);
    }

    pub(super) fn reframe(&mut self, turn_rad: f64, moved: impl Fn([f64; 2]) -> [f64; 2]) {
        let steps = libm::round(turn_rad / FRAC_PI_2 * DIRECTIONS as f64) as isize;
        self.closeness
            .rotate_right(steps.rem_euclid(DIRECTIONS as isize) as usize);
        for look in &mut self.looks {
            look.places_m = look.places_m.map(&moved);
        }
        self.place.centre_m = moved(self.place.centre_m);
        self.place.yaw_rad = wrapped_rad(self.place.yaw_rad + turn_rad);
    }

    /// The box.
    pub(super) fn place(&self) -> Rectangle {
        self.place
    }

    /// Which way round the seen box is a vehicle's, and where what was not seen lies.
    fn fit(&self, sensor_m: [f64; 2]) -> Rectangle {
        let kind = Kind::of(self.height_m);
        let yaw_rad = closest_rad(&self.closeness);
        let (sine, cosine) = libm::sincos(yaw_rad);
        let extents = self.looks.each_ref().map(|look| Shown {
            extent: Extent::of(look.places_m.iter().copied(), sine, cosine),
            worth: look.worth,
        });
        let end_m = |end: fn(&Extent) -> [f64; 2]| {
            [0, 1].map(|axis| usual_m(&extents, |extent| end(extent)[axis]))
        };
        let (low_m, high_m) = (end_m(|extent| extent.low), end_m(|extent| extent.high));
        let seen_m = [0, 1].map(|axis| high_m[axis] - low_m[axis]);
        let middle_m = [0, 1].map(|axis| 0.5 * (low_m[axis] + high_m[axis]));
        let sensor = turned(&sensor_m, sine, cosine);
        let away_m = [0, 1].map(|axis| middle_m[axis] - sensor[axis]);
        let range_m = libm::hypot(away_m[0], away_m[1]).max(1e-3);
        let sight = away_m.map(|away_m| away_m / range_m);
        let misfit_m = |length: usize| {
            let short_m = if sight[length].abs() < SIDE_ON {
                kind.shortest_m - seen_m[length]
            } else {
                0.0
            };
            let wide_m = (seen_m[1 - length] - kind.widest_m).max(0.0);
            short_m.max(seen_m[length] - kind.longest_m).max(0.0) + WIDE_WEIGHT * wide_m
        };
        let misfits_m = [0, 1].map(misfit_m);
        let length = usize::from((misfits_m[1], seen_m[0]) < (misfits_m[0], seen_m[1]));
        let (mut size_m, mut centre) = (seen_m, middle_m);
        for (axis, least_m) in [(length, kind.size_m[0]), (1 - length, kind.size_m[1])] {
            size_m[axis] = seen_m[axis].max(least_m);
            let behind = (3.0 * sight[axis]).clamp(-1.0, 1.0);
            centre[axis] += 0.5 * behind * (size_m[axis] - seen_m[axis]);
        }
        Rectangle {
            centre_m: turned(&centre, -sine, cosine),
            yaw_rad: yaw_rad + FRAC_PI_2 * length as f64,
            length_m: size_m[length],
            width_m: size_m[1 - length],
        }
    }
}

impl Kind {
    /// What a vehicle so high is like.
    fn of(height_m: f64) -> Self {
        let lorry = lorry_share(height_m);
        let between = |car: f64, of_lorry: f64| car + lorry * (of_lorry - car);
        Self {
            size_m: [0, 1].map(|axis| between(CAR.size_m[axis], LORRY.size_m[axis])),
            longest_m: between(CAR.longest_m, LORRY.longest_m),
            widest_m: between(CAR.widest_m, LORRY.widest_m),
            shortest_m: between(CAR.shortest_m, LORRY.shortest_m),
        }
    }
}

impl Outermost {
    fn of(places_m: &[[f64; 2]], [x_m, y_m]: [f64; 2]) -> Self {
        let mut outermost_m = [[0.0; 2]; WAYS];
        let (ahead_m, behind_m) = outermost_m.split_at_mut(WAYS / 2);
        for ((sine, cosine), ends_m) in AHEAD.iter().zip(ahead_m.iter_mut().zip(behind_m)) {
            let (mut farthest_m, mut nearest_m) = (f64::NEG_INFINITY, f64::INFINITY);
            for place_m in places_m {
                let along_m = turned(place_m, *sine, *cosine)[0];
                if along_m > farthest_m {
                    (farthest_m, *ends_m.0) = (along_m, *place_m);
                }
                if along_m < nearest_m {
                    (nearest_m, *ends_m.1) = (along_m, *place_m);
                }
            }
        }
        Self {
            places_m: outermost_m.map(|[x, y]| [x_m + x, y_m + y]),
            worth: places_m.len() as f64,
        }
    }
}

/// Sines and cosines of the ways ahead; the others are opposite to them.
static AHEAD: LazyLock<[(f64, f64); WAYS / 2]> = LazyLock::new(|| {
    std::array::from_fn(|way| libm::sincos(4.0 * FRAC_PI_2 * way as f64 / WAYS as f64))
});

/// How far one look reaches, and what it counts.
struct Shown {
    extent: Extent,
    worth: f64,
}

/// The median of what looks show, each counted by its worth.
fn usual_m(looks: &[Shown; MOST_LOOKS], end_m: impl Fn(&Extent) -> f64) -> f64 {
    let mut shown = looks
        .each_ref()
        .map(|look| (end_m(&look.extent), look.worth));
    shown.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * shown.iter().map(|(_, worth)| worth).sum::<f64>();
    let mut worth = 0.0;
    let middle = shown.iter().find(|(_, own)| {
        worth += own;
        worth >= half
    });
    middle.map_or(0.0, |(metres, _)| *metres)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns on the side and on the rear of a car, each this long, of which the corner is at a place.
    fn corner(at_m: [f64; 2], yaw_rad: f64, side_m: f64, rear_m: f64) -> Vec<[f64; 2]> {
        let (sine, cosine) = libm::sincos(yaw_rad);
        let steps = |length_m: f64| (0..=20).map(move |step| length_m * f64::from(step) / 20.0);
        let side = steps(side_m).map(|along_m| [along_m, 0.0]);
        let rear = steps(rear_m).map(|across_m| [0.0, across_m]);
        side.chain(rear)
            .map(|place_m| turned(&place_m, -sine, cosine))
            .map(|[x, y]| [at_m[0] + x, at_m[1] + y])
            .collect()
    }

    fn is_near(place: Rectangle, centre_m: [f64; 2], yaw_rad: f64) -> bool {
        let off = [0, 1].map(|axis| place.centre_m[axis] - centre_m[axis]);
        let turn = libm::sin(place.yaw_rad - yaw_rad);
        libm::hypot(off[0], off[1]) < 0.15 && turn.abs() < 0.06
    }

    #[test]
    fn a_look_with_a_piece_of_something_else_changes_nothing() {
        let car = corner([8.0, 5.0], 0.2, 4.2, 1.7);
        let mut with_a_hedge = car.clone();
        with_a_hedge.extend((0..10).map(|step| [7.0, 7.0 + 0.2 * f64::from(step)]));
        let mut sides = Sides::new(&car, [100.0, 0.0], 1.5);
        for look in [&with_a_hedge, &car, &car] {
            sides.see(look, [100.0, 0.0], 1.5);
        }
        let (sine, cosine) = libm::sincos(0.2);
        let [x, y] = turned(&[2.1, 0.875], -sine, cosine);
        let place = sides.place();
        assert!(is_near(place, [108.0 + x, 5.0 + y], 0.2), "{place:?}");
        assert!((place.length_m - 4.2).abs() < 0.15 && (place.width_m - 1.75).abs() < 0.15);
    }

    #[test]
    fn of_a_car_from_behind_the_rest_lies_before_it() {
        let rear = corner([10.0, -0.9], 0.0, 0.2, 1.7);
        let place = Sides::new(&rear, [0.0; 2], 1.5).place();
        assert!(is_near(place, [12.1, -0.05], 0.0), "{place:?}");
        assert_eq!(place.length_m, CAR.size_m[0]);
    }

    #[test]
    fn a_high_rear_is_a_lorrys_and_not_a_car_from_the_side() {
        let rear = corner([10.0, -1.25], 0.0, 0.2, 2.5);
        let place = Sides::new(&rear, [0.0; 2], 3.5).place();
        assert!(is_near(place, [14.25, 0.0], 0.0), "{place:?}");
    }

    #[test]
    fn another_frame_moves_all_of_it() {
        let car = corner([8.0, 5.0], 0.2, 4.2, 1.7);
        let turn_rad = 10.0 * FRAC_PI_2 / DIRECTIONS as f64;
        let (sine, cosine) = libm::sincos(turn_rad);
        let moved = |[x, y]: [f64; 2]| turned(&[x - 3.0, y + 1.0], -sine, cosine);
        let mut sides = Sides::new(&car, [0.0; 2], 1.5);
        let before = sides.place();
        sides.reframe(turn_rad, moved);
        let expected_m = moved(before.centre_m);
        assert!(is_near(
            sides.place(),
            expected_m,
            before.yaw_rad + turn_rad
        ));
        let seen: Vec<[f64; 2]> = car.into_iter().map(moved).collect();
        sides.see(&seen, [0.0; 2], 1.5);
        assert!(is_near(
            sides.place(),
            expected_m,
            before.yaw_rad + turn_rad
        ));
    }
}
