//! How fast the sensor goes when the odometry frame begins, as far as poses tell it.

use nalgebra::Vector6;

use super::reading::Source;
use super::{Ego, Pose};
use crate::cloud::Scan;
use crate::geometry::Rigid;
use crate::time::{Span, Time};

/// How wrong a velocity may be that poses tell: two that are 0.1 m off, nearly half a sweep apart.
const BEGIN_WITHIN_MPS: f64 = 3.0;
/// Part of a sweep for which poses must be known to tell it: half of one, where the first came with it, less their interval.
const LEAST_TOLD: f64 = 0.4;

impl Ego {
    /// How fast the sensor goes when the frame begins, and to within what: as far as poses reach between a sweep before its
    /// middle and its end. By a single pose it stands, or goes anyhow.
    pub(super) fn begin_velocity(
        &self,
        source: Source,
        sensor: &Pose,
        middle: Time,
        swept_s: f64,
    ) -> Option<(Vector6<f64>, f64)> {
        let around = [-1.0, 0.5].map(|sweeps| middle + Span::from_seconds(sweeps * swept_s));
        if let Some((velocity, ..)) = self.told_motion(source, around, swept_s) {
            return Some((velocity, BEGIN_WITHIN_MPS));
        }
        let before = self.sources.pose_from(source, around[0])?;
        let before = self.parameters.sensor(&before).rigid();
        Some((before.step_to(&sensor.rigid()) / swept_s, f64::INFINITY))
    }

    /// How fast the sensor goes in a time by a source's poses, and where it is when they end; `None` if they are known of less
    /// than a part of a sweep.
    fn told_motion(
        &self,
        source: Source,
        time: [Time; 2],
        swept_s: f64,
    ) -> Option<(Vector6<f64>, Rigid, Time)> {
        let [from, to] = self.sources.known(source, time)?;
        let passed_s = (to - from).seconds();
        if passed_s < LEAST_TOLD * swept_s {
            return None;
        }
        let sensor = |time: Time| {
            let vehicle = self.sources.pose_from(source, time)?;
            Some(self.parameters.sensor(&vehicle).rigid())
        };
        let last = sensor(to)?;
        Some((sensor(from)?.step_to(&last) / passed_s, last, to))
    }

    /// Takes the first revolution of a frame anew, where poses tell only now how fast the sensor went.
    pub(super) fn lead(&mut self, scan: &Scan) {
        let (Some(source), Some(first)) = (self.source, self.odometry.begun_at()) else {
            return;
        };
        let told = self.told_motion(source, [first, scan.time()], scan.duration_s());
        if let Some((velocity, last, time)) = told {
            let pose = last.moved(&(velocity * (first - time).seconds()));
            self.odometry.lead(&pose, (velocity, BEGIN_WITHIN_MPS));
        }
    }
}
