//! One revolution of the past as a range image: columns by layers.

use nalgebra::{Matrix3, Vector3};

use super::Seen;
use crate::cloud::{Azimuths, CAPACITY, MAX_COLUMNS, MAX_LAYERS, Scan};
use crate::ego::{Placement, Pose, Sweep};
use crate::geometry::Rectangle;
use crate::time::Time;

/// Ranges, and where the sensor was.
#[derive(Debug, Clone, Default)]
pub(super) struct RangeImage {
    time: Time,
    azimuths: Azimuths,
    /// Negative on the ground, which a ray ends on without meeting anything; 0 where nothing is known, and not a number
    /// where something moved: what came and went says nothing of what stands.
    range_m: Vec<f32>,
    /// How far rays went beyond that; empty where pulses have one return.
    reached_m: Vec<f32>,
    placements: Vec<Placement>,
    /// Sine and cosine of the columns' azimuths.
    directions: Vec<[f32; 2]>,
    /// Which way the sensor looked at the end.
    yaw_rad: f64,
    /// Height of the sensor, and the turn from its axes to level ones.
    z_m: f64,
    tilt: Matrix3<f64>,
    columns_per_rad: f64,
    /// Tangents of the layers' elevations, ascending, and how many layers there are.
    tangents: [f64; MAX_LAYERS],
    layers: usize,
}

/// Metres and part of a range by which a ray must end beyond a place to have passed it, and within which it met something
/// there: noise of the range, of the pose, and of where surfaces are between rays.
const MARGIN_M: f64 = 0.25;
const MARGIN: f64 = 0.01;
/// How far around the box of what moves its returns may be: it goes on during the sweep.
const AROUND_M: f64 = 0.5;
/// Of three rays side by side, how many must have passed in the layers above and below.
const FEWEST_PASSED: u32 = 2;
/// Part of the step between layers up to which what a ray met reaches up and down.
const REACH: f64 = 1.3;

impl RangeImage {
    pub(super) fn forget(&mut self) {
        self.range_m.clear();
    }

    pub(super) fn time(&self) -> Time {
        self.time
    }

    pub(super) fn take(
        &mut self,
        scan: &Scan,
        ground: &[bool],
        moving: &[Rectangle],
        sweep: &Sweep,
        placements: &[Placement],
    ) {
        self.time = scan.time();
        self.azimuths = scan.azimuths();
        self.range_m.clear();
        self.range_m.reserve(CAPACITY);
        let returns = scan.range_m().iter().zip(ground);
        self.range_m.extend(returns.map(|(range_m, is_ground)| {
            if *is_ground {
                -range_m
            } else {
                range_m.max(0.0)
            }
        }));
        self.reached_m.clear();
        if scan.has_two_returns() {
            self.reached_m.extend_from_slice(scan.reached_m());
        }
        moving
            .iter()
            .for_each(|rectangle| self.leave_out(scan, rectangle));
        self.placements.clear();
        self.placements.reserve(MAX_COLUMNS);
        self.placements.extend_from_slice(placements);
        self.directions.clear();
        self.directions.reserve(MAX_COLUMNS);
        self.directions
            .extend((0..scan.columns()).map(|column| scan.direction(column)));
        self.yaw_rad = sweep.sensor.yaw_rad;
        self.z_m = sweep.attitude.translation_m.z;
        let level = Pose {
            position_m: [0.0; 3],
            ..Pose::of(&sweep.attitude)
        };
        self.tilt = level.rigid().rotation.transpose() * sweep.attitude.rotation;
        self.layers = scan.sensor().elevation_deg.len();
        self.tangents = std::array::from_fn(|layer| {
            if layer < self.layers {
                scan.slope(layer).0
            } else {
                f64::INFINITY
            }
        });
        self.columns_per_rad = 1.0 / self.azimuths.step_rad();
    }

    /// The column that looked where another azimuth points now, of a sensor that looks `yaw_rad`.
    pub(super) fn guess(&self, azimuth_rad: f64, yaw_rad: f64) -> usize {
        self.azimuths
            .column_at(azimuth_rad + self.yaw_rad - yaw_rad)
    }

    /// Leaves out what was met in and around a box in the sensor frame.
    fn leave_out(&mut self, scan: &Scan, moving: &Rectangle) {
        let around = Rectangle {
            length_m: moving.length_m + 2.0 * AROUND_M,
            width_m: moving.width_m + 2.0 * AROUND_M,
            ..*moving
        };
        let outline = around.outline();
        for columns in scan.stretches_across(&around.corners()) {
            for point in columns.start * MAX_LAYERS..columns.end * MAX_LAYERS {
                let [x, y, _] = scan.point_m(point).map(f64::from);
                if self.range_m[point] > 0.0 && outline.contains([x, y]) {
                    self.range_m[point] = f32::NAN;
                }
            }
        }
    }

    /// What was seen of a place in the odometry frame, by about the column that is guessed, which gives way to the one
    /// that looked there.
    pub(super) fn seen(&self, at_m: &Vector3<f64>, guess: &mut usize) -> Seen {
        if self.range_m.is_empty() {
            return Seen::Unknown;
        }
        let Some((column, from_m)) = self.find(at_m, *guess) else {
            return Seen::Unknown;
        };
        *guess = column;
        let square_m2 = from_m.x * from_m.x + from_m.y * from_m.y;
        let tangent = from_m.z / square_m2.sqrt();
        // Those beyond the last layer are infinite. Counting all takes less than searching.
        let below = self.tangents.iter().map(|own| usize::from(*own <= tangent));
        let above: usize = below.sum();
        let tangents = &self.tangents;
        if above == 0 || above == self.layers {
            return Seen::Unknown;
        }
        let range_m = (square_m2 + from_m.z * from_m.z).sqrt();
        let margin_m = MARGIN_M + MARGIN * range_m;
        let beside = |after| self.azimuths.column_beside(column, after).unwrap_or(column);
        let place = Place {
            columns: [-1, 0, 1].map(beside),
            near_m: (range_m - margin_m) as f32,
            far_m: (range_m + margin_m) as f32,
        };
        let reach = REACH * (tangents[above] - tangents[above - 1]);
        let is_near = |layer: &usize| (tangents[*layer] - tangent).abs() < reach;
        let farther = [above.wrapping_sub(2), above + 1];
        let farther = farther
            .into_iter()
            .filter(|layer| *layer < self.layers && is_near(layer));
        let [below, above] = [above - 1, above].map(|layer| self.ask(layer, &place));
        if below.met || above.met || farther.into_iter().any(|layer| self.ask(layer, &place).met) {
            Seen::Occupied
        } else if [below, above].iter().all(Answer::has_passed) {
            Seen::Empty
        } else {
            Seen::Unknown
        }
    }

    /// The column that looked at a place, and where the place is from its sensor, beginning with a guess.
    fn find(&self, at_m: &Vector3<f64>, guess: usize) -> Option<(usize, Vector3<f64>)> {
        /// Where the sensor was by then depends on the column, but by nothing that counts for one so near to the guess.
        const NEAR: f64 = 0.1;
        let mut column = guess.min(self.azimuths.columns() - 1);
        for _ in 0..2 {
            let [x, y] = self.placements[column].sensor_m([at_m.x, at_m.y]);
            let from_m = self.tilt.tr_mul(&Vector3::new(x, y, at_m.z - self.z_m));
            let [sine, cosine] = self.directions[column].map(f64::from);
            let ahead_m = from_m.x * sine + from_m.y * cosine;
            let aside = (from_m.x * cosine - from_m.y * sine) / ahead_m;
            if ahead_m > 0.0 && aside.abs() < NEAR {
                // The arc tangent, to 2e-6.
                let turn_rad = aside - aside * aside * aside / 3.0;
                let after = turn_rad * self.columns_per_rad;
                let after = (after + libm::copysign(0.5, after)) as isize;
                let column = self.azimuths.column_beside(column, after)?;
                return Some((column, from_m));
            }
            column = self.azimuths.column_at(libm::atan2(from_m.x, from_m.y));
        }
        None
    }

    /// What the rays of a layer around a place say of it.
    fn ask(&self, layer: usize, place: &Place) -> Answer {
        let mut answer = Answer::default();
        for column in place.columns {
            let point = column * MAX_LAYERS + layer;
            let range_m = self.range_m[point];
            let reached_m = self
                .reached_m
                .get(point)
                .map_or(range_m, |reached_m| *reached_m);
            let met = place.near_m..=place.far_m;
            if range_m.abs() > place.far_m {
                answer.passed += 1;
            } else if met.contains(&range_m) || met.contains(&reached_m) {
                answer.met = true;
            } else if reached_m > place.far_m {
                answer.passed += 1;
            } else if range_m > 0.0 {
                answer.is_blocked = true;
            }
        }
        answer
    }
}

/// Where a place is: in which column and those beside it, and nearer and farther by the margin.
struct Place {
    columns: [usize; 3],
    near_m: f32,
    far_m: f32,
}

/// What some rays say.
#[derive(Debug, Clone, Copy, Default)]
struct Answer {
    passed: u32,
    met: bool,
    is_blocked: bool,
}

impl Answer {
    fn has_passed(&self) -> bool {
        !self.is_blocked && self.passed >= FEWEST_PASSED
    }
}
