//! What is seen of an object in the axes of its box.
//!
//! A sensor sees one or two sides of a vehicle. The edges that face it are measured, the others
//! follow from the size, which `shape` knows.

use nalgebra::{Matrix2, Vector2};

use super::look::Look;
use super::spots::{Spot, places_m};
use crate::geometry::{Extent, turned};

/// A group of returns in the axes of a box.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    /// Extent along and across the yaw, relative to the origin of the frame.
    low_m: [f64; 2],
    high_m: [f64; 2],
    /// Whether an end is the object's own: it faces the sensor and nothing stands before it.
    low_is_edge: [bool; 2],
    high_is_edge: [bool; 2],
    /// Whether both ends of an axis can be seen, so that its extent is the object's.
    is_whole: [bool; 2],
    /// Only a cabin or a rider is seen: what is below reaches farther to both ends.
    is_upper: bool,
    /// All that is seen is higher than a bonnet.
    is_cabin: bool,
    /// Nothing hides an end of it.
    is_free: bool,
    /// Whether the sensor looks at the side along each axis: the length, not the front or the rear, and the width.
    is_side_on: [bool; 2],
    sine: f64,
    cosine: f64,
    /// Standard deviation of an edge.
    edge_m: f64,
}

/// Cosine from which on a side is looked at rather than an end.
const SIDE_ON: f64 = 0.7;
/// Part of a length below which what is seen of a side may be any piece of it.
const PIECE: f64 = 0.4;

/// Height of the rear edge of a bonnet.
const BONNET_M: f64 = 0.95;

/// Standard deviation of an edge: noise of ranges and roundness of corners.
const EDGE_M: f64 = 0.07;
/// What half a step between columns adds for each metre of range.
const EDGE_PER_M: f64 = 0.002;

impl View {
    /// What is seen of a group in the axes of a yaw.
    pub(super) fn of(look: &Look, spots: &[Spot], yaw_rad: f64) -> Self {
        let (sine, cosine) = libm::sincos(yaw_rad);
        let extent = Extent::of(places_m(spots), sine, cosine);
        let sensor = turned(&look.sensor_m.into(), sine, cosine);
        let [low_m, high_m] =
            [extent.low, extent.high].map(|end| [0, 1].map(|axis| sensor[axis] + end[axis]));
        let sight = look.middle_m - look.sensor_m;
        let left = Vector2::new(-sight.y, sight.x).normalize();
        let left = turned(&left.into(), sine, cosine);
        let mut view = Self {
            low_m,
            high_m,
            low_is_edge: [false; 2],
            high_is_edge: [false; 2],
            is_whole: [false; 2],
            is_upper: false,
            is_cabin: look.floor_m > BONNET_M,
            is_free: look.is_cut == [false; 2],
            is_side_on: left.map(|share| share.abs() > SIDE_ON),
            sine,
            cosine,
            edge_m: EDGE_M + EDGE_PER_M * look.range_m,
        };
        for axis in 0..2 {
            // An end that lies to a hidden side is not the object's own.
            let hidden = |sign: f64| {
                (look.is_cut[0] && left[axis] * sign > 0.35)
                    || (look.is_cut[1] && -left[axis] * sign > 0.35)
            };
            let middle_m = 0.5 * (low_m[axis] + high_m[axis]);
            let reach_m = 0.5 * (high_m[axis] - low_m[axis]);
            let offset_m = sensor[axis] - middle_m;
            // The side along this axis shows where the line of sight crosses it.
            let is_across = left[axis].abs() > 0.35;
            let faces_low = offset_m < -reach_m;
            let faces_high = offset_m > reach_m;
            view.low_is_edge[axis] = (faces_low || is_across) && !hidden(-1.0);
            view.high_is_edge[axis] = (faces_high || is_across) && !hidden(1.0);
            // Of an end that faces away only the corner is seen.
            if faces_low && !(is_across && reach_m > 0.8) {
                view.high_is_edge[axis] = false;
            }
            if faces_high && !(is_across && reach_m > 0.8) {
                view.low_is_edge[axis] = false;
            }
            view.is_whole[axis] = is_across && !hidden(1.0) && !hidden(-1.0);
        }
        if look.is_upper {
            view.is_whole[0] = false;
            view.is_upper = true;
        }
        view
    }

    /// Length and width of what is seen.
    pub(super) fn extent_m(&self) -> [f64; 2] {
        [0, 1].map(|axis| self.high_m[axis] - self.low_m[axis])
    }

    /// Whether an extent is the whole of its side.
    pub(super) fn is_whole(&self) -> [bool; 2] {
        self.is_whole
    }

    /// Whether the sensor looks at the side along an axis.
    pub(super) fn is_side_on(&self, axis: usize) -> bool {
        self.is_side_on[axis]
    }

    /// Where the middle of a box of this size is, given where it is expected, how sure its direction
    /// is and whether it is a vehicle that moves, and how sure that is, as a covariance in the local
    /// frame.
    pub(super) fn centre(
        &self,
        size_m: [f64; 2],
        size_deviation_m: [f64; 2],
        expected_m: Vector2<f64>,
        yaw_variance: f64,
        drives: bool,
    ) -> (Vector2<f64>, Matrix2<f64>) {
        let expected = [
            expected_m.x * self.cosine + expected_m.y * self.sine,
            expected_m.y * self.cosine - expected_m.x * self.sine,
        ];
        let along =
            [0, 1].map(|axis| self.middle(axis, size_m, size_deviation_m, expected[axis], drives));
        let centre = along.map(|(middle, _)| middle);
        let deviation = along.map(|(_, deviation)| deviation);
        // What a direction is off turns the hidden middle about what is seen.
        let seen = [0, 1].map(|axis| 0.5 * (self.low_m[axis] + self.high_m[axis]));
        let askew = [1, 0].map(|other: usize| {
            let lever_m = centre[other] - seen[other];
            yaw_variance * lever_m * lever_m
        });
        let local = |u: f64, v: f64| {
            Vector2::new(
                u * self.cosine - v * self.sine,
                u * self.sine + v * self.cosine,
            )
        };
        let turn = Matrix2::new(self.cosine, -self.sine, self.sine, self.cosine);
        let spread = Matrix2::new(
            deviation[0] * deviation[0] + askew[0],
            0.0,
            0.0,
            deviation[1] * deviation[1] + askew[1],
        );
        (
            local(centre[0], centre[1]),
            turn * spread * turn.transpose(),
        )
    }

    /// Along one axis: where the middle of the box is, and its standard deviation.
    fn middle(
        &self,
        axis: usize,
        size_m: [f64; 2],
        size_deviation_m: [f64; 2],
        expected_m: f64,
        drives: bool,
    ) -> (f64, f64) {
        /// Share of what is missing below a cabin by which its middle is off the vehicle's.
        const UPPER: f64 = 0.4;
        /// Share of the length that reaches out below a cabin where the front is known, behind it and before it: in a
        /// compact car 1.2 m above the ground 0.35 and 1.3 m.
        const INSETS: [f64; 2] = [0.08, 0.3];
        /// To either end where it is not.
        const INSET: f64 = 0.1;
        /// What is no longer is somebody, or has a rider, who is in the middle within this.
        const LONGEST_WITH_RIDER_M: f64 = 2.5;
        const RIDER_M: f64 = 0.15;
        /// What is longer is a lorry or a bus, as long above as below.
        const LONGEST_WITH_BONNET_M: f64 = 6.5;
        let (low, high) = (self.low_m[axis], self.high_m[axis]);
        let half_m = 0.5 * size_m[axis].max(high - low);
        let unsure_m = 0.5 * size_deviation_m[axis];
        let is_inset = self.is_upper && axis == 0 && size_m[axis] < LONGEST_WITH_BONNET_M;
        // Of a bicycle of which the rider is seen nobody knows which end is nearer.
        let is_rider = is_inset && size_m[axis] < LONGEST_WITH_RIDER_M;
        let slack_m = (half_m - 0.5 * (high - low)).max(0.0);
        let shares = match (is_inset, self.is_cabin && drives && !is_rider) {
            (false, _) => [0.0; 2],
            (true, false) => [INSET; 2],
            (true, true) => INSETS,
        };
        let reach_m = (shares[0] + shares[1]) * size_m[axis];
        let part = (2.0 * slack_m).min(reach_m) / reach_m.max(1e-9);
        let [rear_m, front_m] = shares.map(|share| part * share * size_m[axis]);
        let edge_m = self.edge_m + rear_m;
        // Few layers may miss either end of a side: what is seen ends there, and the car goes on (without: kitti of the
        // shared recordings MOTA 0.709 instead of 0.721).
        let is_side = axis == 0 && drives && self.is_side_on[0];
        let is_car_side = is_side && !is_rider && size_m[0] < LONGEST_WITH_BONNET_M;
        let beyond_m: [f64; 2] = std::array::from_fn(|end| {
            let most_m = (INSETS[end] * size_m[0]).min(2.0 * slack_m);
            let told_m = [rear_m, front_m][end];
            f64::from(is_car_side) * (most_m - told_m).max(0.0)
        });
        // What drives out of sight is not seen up to its ends, whatever hides it.
        let is_piece = is_side && high - low < PIECE * size_m[axis];
        let is_edge = [self.low_is_edge[axis], self.high_is_edge[axis]];
        let is_edge = is_edge.map(|is_edge| (is_edge || is_rider) && !is_piece);
        match is_edge.into() {
            (true, true) if is_rider && self.is_free => (0.5 * (low + high), edge_m + RIDER_M),
            (true, true) if is_inset => (
                0.5 * (low - rear_m + high + front_m),
                edge_m + UPPER * slack_m,
            ),
            // Seen from end to end; if it is shorter than known, some of it was missed.
            (true, true) => {
                let missed_m = half_m - 0.5 * (high - low);
                (
                    expected_m.clamp(
                        0.5 * (low + high) - 0.5 * missed_m,
                        0.5 * (low + high) + 0.5 * missed_m,
                    ),
                    edge_m + 0.5 * missed_m,
                )
            }
            (true, false) => {
                let (at_m, more_m) = (low - rear_m + half_m, beyond_m[0]);
                (
                    expected_m.clamp(at_m - more_m, at_m),
                    libm::hypot(edge_m + 0.5 * more_m, unsure_m),
                )
            }
            (false, true) => {
                let (at_m, more_m) = (high + front_m - half_m, beyond_m[1]);
                (
                    expected_m.clamp(at_m, at_m + more_m),
                    libm::hypot(edge_m + 0.5 * more_m, unsure_m),
                )
            }
            (false, false) => {
                let middle = 0.5 * (low + high);
                (
                    expected_m.clamp(middle - slack_m, middle + slack_m),
                    edge_m + slack_m,
                )
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::tests::scan_of;
    use crate::track::tests::spots_of;

    #[test]
    fn a_short_piece_of_the_side_of_what_drives_may_be_any_part_of_it() {
        // A metre of a car that stands across the line of sight, 33 m away.
        let scan = scan_of(1800, |column, layer| match column {
            5..14 if (6..8).contains(&layer) => 3300,
            _ => 0,
        });
        let spots = spots_of(&scan);
        let look = Look::at(&spots, &scan, Vector2::zeros());
        let view = View::of(&look, &spots, 0.0);
        let centre_x_m = |expected_x_m: f64, drives: bool| {
            let expected_m = Vector2::new(expected_x_m, 33.8);
            let (centre_m, noise) = view.centre([4.3, 1.8], [0.1; 2], expected_m, 0.0, drives);
            (centre_m.x, libm::sqrt(noise[(0, 0)]))
        };
        for expected_x_m in [0.0, 2.0] {
            let (x_m, deviation_m) = centre_x_m(expected_x_m, true);
            assert!((x_m - expected_x_m).abs() < 1e-9 && deviation_m > 1.0);
        }
        let (x_m, deviation_m) = centre_x_m(0.0, false);
        assert_eq!(x_m, centre_x_m(2.0, false).0);
        assert!(deviation_m < 0.3);
    }

    #[test]
    fn a_car_may_go_on_beyond_the_end_of_its_side_that_is_seen() {
        // 3 m of a side, 20 m away, of which something nearer hides the right end.
        let scan = scan_of(1800, |column, layer| match column {
            0..43 if (5..8).contains(&layer) => 2000,
            43..60 if (3..12).contains(&layer) => 700,
            _ => 0,
        });
        let mut spots = spots_of(&scan);
        spots.retain(|spot| spot.at_m[1] > 15.0);
        let look = Look::at(&spots, &scan, Vector2::zeros());
        let centre_x_m = |yaw_rad: f64, expected_x_m: f64, drives: bool| {
            let view = View::of(&look, &spots, yaw_rad);
            let expected_m = Vector2::new(expected_x_m, 20.9);
            view.centre([4.3, 1.8], [0.1; 2], expected_m, 0.0, drives)
                .0
                .x
        };
        // Its left end is the rear, and then the front with the bonnet.
        for (yaw_rad, beyond_m) in [(0.0, 0.3), (std::f64::consts::PI, 1.2)] {
            let seen_x_m = centre_x_m(yaw_rad, 0.0, false);
            let expected_x_m = |more_m: f64| centre_x_m(yaw_rad, seen_x_m - more_m, true);
            assert!((expected_x_m(beyond_m) - (seen_x_m - beyond_m)).abs() < 1e-6);
            assert!(expected_x_m(beyond_m + 1.0) > seen_x_m - beyond_m - 0.2);
            assert!((expected_x_m(-0.5) - seen_x_m).abs() < 1e-6);
        }
    }

    #[test]
    fn a_rider_of_whom_a_ray_is_seen_is_in_the_middle_of_the_bicycle() {
        // At the height of a chest, 40 m away and askew.
        let scan = scan_of(1800, |column, layer| match column {
            300..302 if layer == 7 => 4000,
            _ => 0,
        });
        let spots = spots_of(&scan);
        let look = Look::at(&spots, &scan, Vector2::zeros());
        let view = View::of(&look, &spots, 0.0);
        for off_m in [-0.6, 0.6] {
            let expected_m = look.middle_m + Vector2::new(off_m, 0.0);
            let (centre_m, noise) = view.centre([1.7, 0.6], [0.1; 2], expected_m, 0.0, false);
            let deviation_m = libm::sqrt(noise[(0, 0)]);
            assert!((centre_m.x - look.middle_m.x).abs() < 0.01);
            assert!(deviation_m < 0.5, "{deviation_m}");
        }
        // Beside what hides the rest it may be any part of the rider.
        let look = Look {
            is_cut: [true, false],
            ..look
        };
        let view = View::of(&look, &spots, 0.0);
        let (_, noise) = view.centre([1.7, 0.6], [0.1; 2], look.middle_m, 0.0, false);
        assert!(libm::sqrt(noise[(0, 0)]) > 0.55);
    }

    #[test]
    fn the_middle_is_the_less_sure_the_farther_it_is_from_what_is_seen_askew() {
        // The rear of a car straight ahead, 20 m away.
        let scan = scan_of(1800, |column, layer| match column {
            0..26 if (5..8).contains(&layer) => 2000,
            _ => 0,
        });
        let spots = spots_of(&scan);
        let look = Look::at(&spots, &scan, Vector2::zeros());
        let view = View::of(&look, &spots, std::f64::consts::FRAC_PI_2);
        let across_m = |length_m: f64, yaw_variance: f64| {
            let expected_m = Vector2::new(0.9, 20.0 + 0.5 * length_m);
            let (_, noise) = view.centre([length_m, 1.8], [0.0; 2], expected_m, yaw_variance, true);
            libm::sqrt(noise[(0, 0)])
        };
        let sure_m = across_m(4.3, 0.0);
        assert!((across_m(8.0, 0.0) - sure_m).abs() < 1e-9);
        // 0.2 rad over half the length.
        let askew_m = libm::hypot(sure_m, 0.2 * 2.15);
        assert!((across_m(4.3, 0.04) - askew_m).abs() < 0.02);
        assert!(across_m(8.0, 0.04) > across_m(4.3, 0.04));
    }

    #[test]
    fn what_is_seen_of_a_bus_above_the_belt_ends_where_the_bus_ends() {
        // The upper part of a rear, 25 m away.
        let scan = scan_of(1800, |column, layer| match column {
            0..28 if (7..9).contains(&layer) => 2500,
            _ => 0,
        });
        let spots = spots_of(&scan);
        let look = Look {
            is_upper: true,
            ..Look::at(&spots, &scan, Vector2::zeros())
        };
        let view = View::of(&look, &spots, std::f64::consts::FRAC_PI_2);
        let rear_m = |length_m: f64| {
            let expected_m = Vector2::new(1.2, 25.0 + 0.5 * length_m);
            let (centre_m, _) = view.centre([length_m, 2.5], [0.1; 2], expected_m, 0.0, true);
            centre_m.y - 0.5 * length_m
        };
        assert!((rear_m(12.0) - 25.0).abs() < 0.2, "{}", rear_m(12.0));
        assert!(rear_m(4.3) < 24.8, "{}", rear_m(4.3));
    }

    #[test]
    fn a_cabin_lies_behind_the_middle_of_a_car_whose_front_is_known() {
        // The side of a cabin, 2.6 m of it, 40 m away, higher than bonnets.
        let scan = scan_of(1800, |column, layer| match column {
            0..19 if layer == 7 => 4000,
            _ => 0,
        });
        let spots = spots_of(&scan);
        let look = Look {
            floor_m: 1.2,
            is_upper: true,
            ..Look::at(&spots, &scan, Vector2::zeros())
        };
        let view = View::of(&look, &spots, 0.0);
        let ahead_m = |drives: bool| {
            let (centre_m, _) = view.centre([4.3, 1.8], [0.1; 2], look.middle_m, 0.0, drives);
            centre_m.x - look.middle_m.x
        };
        assert!(ahead_m(false).abs() < 0.1, "{}", ahead_m(false));
        assert!((0.3..0.6).contains(&ahead_m(true)));
    }
}
