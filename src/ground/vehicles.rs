//! Vehicles that are known to be there: what is met of them is no ground.

use std::ops::Range;

use multiversion::multiversion;

use super::lowest::NO_LEVEL_M;
use crate::cloud::{MAX_LAYERS, Scan};
use crate::geometry::{Outline, Rectangle};

/// Where a vehicle stands, in the sensor frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Vehicle {
    place: Rectangle,
    outline: Outline,
    middle_m: [f32; 2],
}

/// Around it, for its way during the sweep.
const AROUND_M: f32 = 0.6;
/// Height from which on a return in its place is its bumper or a tyre.
const BUMPER_M: f32 = 0.07;

impl Vehicle {
    pub(super) fn at(place: &Rectangle) -> Self {
        Self {
            place: *place,
            outline: place.outline(),
            middle_m: place.centre_m.map(|metres| metres as f32),
        }
    }

    /// Whether it may reach into a sector whose middle is in a direction to the right and forward,
    /// and of which `slack` is the sine of half its width.
    pub(super) fn may_reach_into(&self, [right, forward]: [f64; 2], slack: f64) -> bool {
        let [x, y] = self.place.centre_m;
        let reach_m = 0.5 * (self.place.length_m + self.place.width_m) + slack * libm::hypot(x, y);
        x * right + y * forward > 0.0 && (x * forward - y * right).abs() < reach_m
    }

    /// Takes out the levels of what is met in its place, in columns that follow each other.
    pub(super) fn take_out(
        &self,
        scan: &Scan,
        columns: Range<usize>,
        levels_m: &mut [[f32; MAX_LAYERS]],
    ) {
        let points = scan.points_of(&columns);
        let at_m = [scan.x_m(), scan.y_m()].map(|metres| &metres[points.clone()]);
        take_out(self, at_m, levels_m.as_flattened_mut());
    }

    /// Takes the mark off what is clearly above the ground in its place: far away a single layer
    /// meets its bumper, as high as the ground may be unsure.
    pub(super) fn spare(&self, scan: &Scan, heights_m: &[f32], mask: &mut [bool]) {
        for columns in scan.stretches_across(&self.place.corners()) {
            let points = scan.points_of(&columns);
            let at_m = [scan.x_m(), scan.y_m()].map(|metres| &metres[points.clone()]);
            spare(self, at_m, &heights_m[points.clone()], &mut mask[points]);
        }
    }

    /// How far a return is from its edge, negative within.
    #[inline(always)]
    fn off_edge_m(&self, [x, y]: [f32; 2]) -> f32 {
        self.outline
            .off_edge_m([x - self.middle_m[0], y - self.middle_m[1]])
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn take_out(vehicle: &Vehicle, [x_m, y_m]: [&[f32]; 2], levels_m: &mut [f32]) {
    let vehicle = *vehicle;
    let (x_m, y_m) = (&x_m[..levels_m.len()], &y_m[..levels_m.len()]);
    for point in 0..levels_m.len() {
        let is_taken = vehicle.off_edge_m([x_m[point], y_m[point]]) < AROUND_M;
        // Added: what is set under a condition would be stored under a mask, slowly. Beside it any
        // level is nothing.
        levels_m[point] += if is_taken { NO_LEVEL_M } else { 0.0 };
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn spare(vehicle: &Vehicle, [x_m, y_m]: [&[f32]; 2], heights_m: &[f32], mask: &mut [bool]) {
    let vehicle = *vehicle;
    let (x_m, y_m) = (&x_m[..mask.len()], &y_m[..mask.len()]);
    let heights_m = &heights_m[..mask.len()];
    for point in 0..mask.len() {
        let is_within = vehicle.off_edge_m([x_m[point], y_m[point]]) < 0.0;
        mask[point] &= !(is_within & (heights_m[point] > BUMPER_M));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::tests::scan_of;

    /// A car across the way, 10 m ahead.
    const CAR: Rectangle = Rectangle {
        centre_m: [0.0, 10.0],
        yaw_rad: 0.0,
        length_m: 4.0,
        width_m: 2.0,
    };

    #[test]
    fn what_is_met_of_a_vehicle_or_close_to_it_lifts_no_ground() {
        let left = |range_cm: u16, columns: Range<usize>| {
            let scan = scan_of(1800, |_, _| range_cm);
            let mut levels_m = vec![[0.1; MAX_LAYERS]; columns.len()];
            Vehicle::at(&CAR).take_out(&scan, columns, &mut levels_m);
            levels_m
                .iter()
                .filter(|levels_m| levels_m[7] < NO_LEVEL_M)
                .count()
        };
        assert_eq!(left(1000, 0..40), 0);
        assert_eq!(left(860, 0..20), 0);
        assert_eq!(left(830, 0..20), 20);
        // 13 degrees to the right its side is 0.2 m away, 18 degrees 0.9 m.
        assert_eq!(left(1000, 60..70), 0);
        assert_eq!(left(1000, 90..100), 10);
    }

    #[test]
    fn a_sector_that_a_vehicle_may_reach_into_is_told_from_others() {
        let vehicle = Vehicle::at(&CAR);
        let may_reach = |azimuth_deg: f64| {
            let (sine, cosine) = libm::sincos(azimuth_deg.to_radians());
            vehicle.may_reach_into([sine, cosine], libm::sin(2.5f64.to_radians()))
        };
        assert!([-18.0, 0.0, 18.0].into_iter().all(may_reach));
        assert!(![25.0, 180.0, -90.0].into_iter().any(may_reach));
    }
}
