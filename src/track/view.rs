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
mod tests;
