//! One revolution of the past as a range image: columns by layers.

use nalgebra::Vector3;

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
    columns: Vec<Bearing>,
    /// Where the sensor was at the end, and which way it looked.
    origin_m: Vector3<f64>,
    yaw_rad: f64,
    columns_per_rad: f32,
    /// Tangents of the layers' elevations, ascending, and how many layers there are.
    tangents: [f32; MAX_LAYERS],
    layers: usize,
}

/// Whence and whither a column looked.
#[derive(Debug, Clone, Copy)]
struct Bearing {
    /// Relative to where the sensor was at the end.
    origin_m: [f32; 2],
    /// The column's own directions, along its azimuth, to the right of it and along the axis of the sensor, in the odometry
    /// frame.
    ahead: [f32; 3],
    aside: [f32; 3],
    up: [f32; 3],
}

/// Metres and part of a range by which a ray must end beyond a place to have passed it, and within which it met something
/// there: noise of the range, of the pose, and of where surfaces are between rays.
const MARGIN_M: f32 = 0.25;
const MARGIN: f32 = 0.01;
/// How far around the box of what moves its returns may be: it goes on during the sweep.
const AROUND_M: f64 = 0.5;
/// Of three rays side by side, how many must have passed in the layers above and below.
const FEWEST_PASSED: u32 = 2;
/// Part of the step between layers up to which what a ray met reaches up and down.
const REACH: f32 = 1.3;
/// Layers around a place that may have met what is there: more are farther than that.
const NEIGHBOURS: usize = 4;

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
        let end_m = placements.last().map_or([0.0; 2], Placement::origin_m);
        self.origin_m = Vector3::new(end_m[0], end_m[1], sweep.attitude.translation_m.z);
        self.yaw_rad = sweep.sensor.yaw_rad;
        let level = Pose {
            position_m: [0.0; 3],
            ..Pose::of(&sweep.attitude)
        };
        let tilt = level.rigid().rotation.transpose() * sweep.attitude.rotation;
        self.columns.clear();
        self.columns.reserve(MAX_COLUMNS);
        let placed = placements.iter().enumerate();
        self.columns.extend(placed.map(|(column, placement)| {
            let [sine, cosine] = scan.direction(column).map(f64::from);
            let along = |own: Vector3<f64>| {
                let level = tilt * own;
                let [x, y] = placement.turned([level.x, level.y]);
                [x, y, level.z].map(|share| share as f32)
            };
            let own_m = placement.origin_m();
            Bearing {
                origin_m: [0, 1].map(|axis| (own_m[axis] - end_m[axis]) as f32),
                ahead: along(Vector3::new(sine, cosine, 0.0)),
                aside: along(Vector3::new(cosine, -sine, 0.0)),
                up: along(Vector3::z()),
            }
        }));
        self.layers = scan.sensor().elevation_deg.len();
        self.tangents = std::array::from_fn(|layer| {
            if layer < self.layers {
                scan.slope(layer).0 as f32
            } else {
                f32::INFINITY
            }
        });
        self.columns_per_rad = (1.0 / self.azimuths.step_rad()) as f32;
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
        let [ahead_m, aside_m, up_m] = from_m;
        let square_m2 = ahead_m * ahead_m + aside_m * aside_m;
        let tangent = up_m / square_m2.sqrt();
        // Those beyond the last layer are infinite. Counting all takes less than searching.
        let tangents = &self.tangents;
        let below = tangents.iter().map(|own| u32::from(*own <= tangent));
        let above = below.sum::<u32>() as usize;
        if above == 0 || above == self.layers {
            return Seen::Unknown;
        }
        let range_m = (square_m2 + up_m * up_m).sqrt();
        let margin_m = MARGIN_M + MARGIN * range_m;
        let met_m = [range_m - margin_m, range_m + margin_m];
        let first = above
            .saturating_sub(NEIGHBOURS / 2)
            .min(MAX_LAYERS - NEIGHBOURS);
        let mut answers = Answers::default();
        for after in [-1, 0, 1] {
            let column = self.azimuths.column_beside(column, after).unwrap_or(column);
            let begin = column * MAX_LAYERS + first;
            let Some(ranges_m) = self.range_m[begin..].first_chunk() else {
                continue;
            };
            let reached_m = self
                .reached_m
                .get(begin..)
                .and_then(|all| all.first_chunk());
            answers.add(ranges_m, reached_m.unwrap_or(ranges_m), met_m);
        }
        let reach = REACH * (tangents[above] - tangents[above - 1]);
        let is_near = |layer: usize| (tangents[first + layer] - tangent).abs() < reach;
        if (0..NEIGHBOURS).any(|layer| answers.met[layer] > 0 && is_near(layer)) {
            Seen::Occupied
        } else if [above - 1, above]
            .iter()
            .all(|layer| answers.has_passed(layer - first))
        {
            Seen::Empty
        } else {
            Seen::Unknown
        }
    }

    /// The column that looked at a place, and where the place is from the sensor along the directions of about that column,
    /// beginning with a guess.
    fn find(&self, at_m: &Vector3<f64>, guess: usize) -> Option<(usize, [f32; 3])> {
        /// Where the sensor was by then depends on the column, but by nothing that counts for one so near to the guess.
        const NEAR: f32 = 0.1;
        let mut column = guess.min(self.azimuths.columns() - 1);
        let [x, y, z]: [f32; 3] = (at_m - self.origin_m).map(|metres| metres as f32).into();
        for _ in 0..2 {
            let own = &self.columns[column];
            let from_m = [x - own.origin_m[0], y - own.origin_m[1], z];
            let along_m =
                |way: &[f32; 3]| way[0] * from_m[0] + way[1] * from_m[1] + way[2] * from_m[2];
            let (ahead_m, aside_m) = (along_m(&own.ahead), along_m(&own.aside));
            let aside = aside_m / ahead_m;
            let is_near = ahead_m > 0.0 && aside.abs() < NEAR;
            let turn_rad = if is_near {
                // The arc tangent, to 2e-6.
                aside - aside * aside * aside / 3.0
            } else {
                libm::atan2f(aside_m, ahead_m)
            };
            let after = turn_rad * self.columns_per_rad;
            column = self
                .azimuths
                .column_beside(column, (after + 0.5_f32.copysign(after)) as isize)?;
            if is_near {
                return Some((column, [ahead_m, aside_m, along_m(&own.up)]));
            }
        }
        None
    }
}

/// What some rays say of each layer around a place: how many passed it, met something there, or something before it.
#[derive(Debug, Clone, Copy, Default)]
struct Answers {
    passed: [u32; NEIGHBOURS],
    met: [u32; NEIGHBOURS],
    blocked: [u32; NEIGHBOURS],
}

impl Answers {
    /// Adds what the rays of a column say that met something at some ranges and went on to others, of what is within `met_m`.
    #[inline(always)]
    fn add(
        &mut self,
        ranges_m: &[f32; NEIGHBOURS],
        reached_m: &[f32; NEIGHBOURS],
        [near_m, far_m]: [f32; 2],
    ) {
        for layer in 0..NEIGHBOURS {
            let (range_m, reached_m) = (ranges_m[layer], reached_m[layer]);
            let is_there = |metres: f32| u32::from(near_m <= metres) & u32::from(metres <= far_m);
            let is_beyond = u32::from(range_m.abs() > far_m);
            let met = (is_there(range_m) | is_there(reached_m)) & (is_beyond ^ 1);
            let passed = is_beyond | (u32::from(reached_m > far_m) & (met ^ 1));
            self.met[layer] += met;
            self.passed[layer] += passed;
            self.blocked[layer] += u32::from(range_m > 0.0) & ((met | passed) ^ 1);
        }
    }

    fn has_passed(&self, layer: usize) -> bool {
        self.blocked[layer] == 0 && self.passed[layer] >= FEWEST_PASSED
    }
}
