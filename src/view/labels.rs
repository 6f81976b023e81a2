//! What every point of a revolution is, and where it is at the end of the sweep.

use crate::cloud::{MAX_LAYERS, Scan};
use crate::ego::{Anchor, Placement, Pose};
use crate::pipeline::Pipeline;
use crate::track::Object;

/// What a point is: ground.
const GROUND: u8 = 0;
/// Neither ground nor of a cluster.
pub(super) const LOOSE: u8 = 1;
/// Of a cluster that is no object: this and the numbers up to [`FIRST_OBJECT`], in turn.
const FIRST_CLUSTER: u8 = 2;
/// Of an object: this and the number of its class.
pub(super) const FIRST_OBJECT: u8 = 128;
/// Returns so far outside of an object's box are taken for its own, metres: boxes are tight.
pub(super) const MARGIN_M: f64 = 0.3;

/// A revolution as the picture needs it.
#[derive(Debug, Clone, Copy)]
pub struct Around<'a> {
    /// Its points.
    pub scan: &'a Scan,
    /// How each column's points are placed in the odometry frame.
    pub placements: &'a [Placement],
    /// Where that lies in the local frame.
    pub anchor: Anchor,
    /// The sensor at the end of the sweep, in the local frame.
    pub sensor: Pose,
    /// How far below the sensor the ground is, metres.
    pub ground_below_m: f64,
}

/// What the points of a revolution are.
#[derive(Debug, Default)]
pub(crate) struct Labels {
    kinds: Vec<u8>,
    /// By how much the points of an object went on until the end of the sweep.
    shifts_m: Vec<[f32; 2]>,
}

impl Labels {
    /// Says of every point of the pipeline's last revolution what it is.
    pub(crate) fn label(&mut self, around: &Around<'_>, pipeline: &Pipeline) {
        self.label_none(around.scan);
        for (cluster, points) in pipeline.clusters().iter().enumerate() {
            let kind = FIRST_CLUSTER + (cluster % usize::from(FIRST_OBJECT - FIRST_CLUSTER)) as u8;
            for point in points {
                self.kinds[*point as usize] = kind;
            }
        }
        for object in pipeline.objects() {
            let kind = FIRST_OBJECT + object.class.number() as u8;
            self.label_object(around, object, kind);
        }
        let ground = pipeline.ground_mask();
        for (kind, _) in self.kinds.iter_mut().zip(ground).filter(|(_, is)| **is) {
            *kind = GROUND;
        }
    }

    /// The same where nobody knows.
    pub(super) fn label_none(&mut self, scan: &Scan) {
        self.kinds.clear();
        self.kinds.resize(scan.len(), LOOSE);
        self.shifts_m.clear();
        self.shifts_m.resize(scan.len(), [0.0; 2]);
    }

    /// Marks the points within an object's box, each where the box was at its time, and moves them to
    /// where they are at the end of the sweep.
    fn label_object(&mut self, around: &Around<'_>, object: &Object, kind: u8) {
        let (sine, cosine) = libm::sincos(object.yaw_rad);
        let half_m = [object.length_m, object.width_m].map(|side| 0.5 * side + MARGIN_M);
        let [east, north, up] = object.centre_m;
        let seen = around.sensor.placement().sensor_m([east, north]);
        let scan = around.scan;
        let age_s = scan.age_s(scan.column_at(libm::atan2(seen[0], seen[1])));
        let shift_m = [cosine, sine].map(|part| part * object.speed_mps * age_s);
        let corners_m =
            [[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]].map(|[along, across]| {
                let (along, across) = (along * half_m[0], across * half_m[1]);
                around.sensor.placement().sensor_m([
                    east - shift_m[0] + along * cosine - across * sine,
                    north - shift_m[1] + along * sine + across * cosine,
                ])
            });
        let height_m = 0.5 * object.height_m + MARGIN_M;
        for column in scan.stretches_across(&corners_m).into_iter().flatten() {
            for point in column * MAX_LAYERS..(column + 1) * MAX_LAYERS {
                if !scan.has_return(point) {
                    continue;
                }
                let [x, y, z] = around.place_m(point);
                let (x, y) = (x - east + shift_m[0], y - north + shift_m[1]);
                let is_within = libm::fabs(x * cosine + y * sine) < half_m[0]
                    && libm::fabs(y * cosine - x * sine) < half_m[1]
                    && libm::fabs(z - up) < height_m;
                if is_within {
                    self.kinds[point] = kind;
                    self.shifts_m[point] = shift_m.map(|shift| shift as f32);
                }
            }
        }
    }

    /// What a point is: 0 ground, 1 neither ground nor of a cluster, from 2 on of a cluster, from 128 on of an object of
    /// the class with that number.
    pub(crate) fn kind(&self, point: usize) -> u8 {
        self.kinds[point]
    }

    /// Where a point is at the end of the sweep, from the sensor, along the axes of the local frame.
    pub(crate) fn offset_m(&self, around: &Around<'_>, point: usize) -> [f64; 3] {
        let (place_m, [dx, dy]) = (around.place_m(point), self.shifts_m[point].map(f64::from));
        let [x, y, z] = [0, 1, 2].map(|axis| place_m[axis] - around.sensor.position_m[axis]);
        [x + dx, y + dy, z]
    }
}

impl<'a> Around<'a> {
    /// The last revolution of a pipeline, which found the ground so far below the sensor.
    pub(crate) fn of(pipeline: &'a Pipeline, ground_below_m: f64) -> Self {
        Self {
            scan: pipeline.scan(),
            placements: pipeline.placements(),
            anchor: pipeline.sweep().anchor,
            sensor: pipeline.sweep().local_sensor(),
            ground_below_m,
        }
    }

    /// Where a point lies in the local frame.
    fn place_m(&self, point: usize) -> [f64; 3] {
        let [x, y, z] = self.scan.point_m(point).map(f64::from);
        let placement = &self.placements[self.scan.column(point)];
        let [x, y] = placement.local_m([x, y]);
        let [x, y, _] = self.anchor.place_m([x, y, 0.0]);
        [x, y, self.sensor.position_m[2] + z]
    }
}
