//! A pose of the vehicle, and what the sensor sees from it.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::Vector3;

use crate::geometry::{Rigid, turn};

/// An angle in (-pi, pi].
pub fn wrapped_rad(angle_rad: f64) -> f64 {
    angle_rad - TAU * libm::ceil((angle_rad - PI) / TAU)
}

/// Place and direction in the local frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// East, north and up, metres.
    pub position_m: [f64; 3],
    /// Direction of forward, radians counter-clockwise from east.
    pub yaw_rad: f64,
}

impl Pose {
    /// The sensor frame taken for the local frame: right is east, forward is north.
    pub const SENSOR: Self = Self {
        position_m: [0.0; 3],
        yaw_rad: FRAC_PI_2,
    };

    /// The pose of something that is mounted `forward_m`, `left_m` and `up_m` from this one and
    /// looks `yaw_rad` to the left of it.
    pub fn mounted(&self, [forward_m, left_m, up_m]: [f64; 3], yaw_rad: f64) -> Self {
        let (sine, cosine) = libm::sincos(self.yaw_rad);
        let [x, y, z] = self.position_m;
        Self {
            position_m: [
                x + forward_m * cosine - left_m * sine,
                y + forward_m * sine + left_m * cosine,
                z + up_m,
            ],
            yaw_rad: wrapped_rad(self.yaw_rad + yaw_rad),
        }
    }

    /// The pose at a share of the way to another one, which may lie below 0 or above 1.
    pub fn toward(&self, other: &Self, share: f64) -> Self {
        let turn_rad = wrapped_rad(other.yaw_rad - self.yaw_rad);
        Self {
            position_m: [0, 1, 2].map(|axis| {
                let (from, to) = (self.position_m[axis], other.position_m[axis]);
                from + share * (to - from)
            }),
            yaw_rad: wrapped_rad(self.yaw_rad + share * turn_rad),
        }
    }

    /// What of a place and direction in space is one in the plane: the heading of what looks forward.
    pub fn of(rigid: &Rigid) -> Self {
        let ahead = rigid.rotation.column(1);
        Self {
            position_m: rigid.translation_m.into(),
            yaw_rad: libm::atan2(ahead.y, ahead.x),
        }
    }

    /// The same in space: level.
    pub fn rigid(&self) -> Rigid {
        let upright = Vector3::new(0.0, 0.0, self.yaw_rad - FRAC_PI_2);
        Rigid {
            rotation: turn(&upright),
            translation_m: self.position_m.into(),
        }
    }

    /// How points in the sensor frame of a sensor with this pose are placed.
    pub fn placement(&self) -> Placement {
        let (sine, cosine) = libm::sincos(self.yaw_rad - FRAC_PI_2);
        Placement {
            origin_m: [self.position_m[0], self.position_m[1]],
            sine,
            cosine,
        }
    }
}

/// A turn and a shift in the plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    origin_m: [f64; 2],
    sine: f64,
    cosine: f64,
}

impl Placement {
    /// What lies at a share of the way to another one that is hardly turned against it.
    pub(super) fn toward(&self, other: &Self, share: f64) -> Self {
        let between = |from: f64, to: f64| from + share * (to - from);
        Self {
            origin_m: [0, 1].map(|axis| between(self.origin_m[axis], other.origin_m[axis])),
            sine: between(self.sine, other.sine),
            cosine: between(self.cosine, other.cosine),
        }
    }

    /// From the sensor frame (x right, y forward) to the local frame.
    pub fn local_m(&self, place_m: [f64; 2]) -> [f64; 2] {
        let [along_m, across_m] = self.turned(place_m);
        [self.origin_m[0] + along_m, self.origin_m[1] + across_m]
    }

    /// The same of a direction.
    pub fn turned(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [
            x * self.cosine - y * self.sine,
            x * self.sine + y * self.cosine,
        ]
    }

    /// From the local frame to the sensor frame.
    pub fn sensor_m(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [dx, dy] = [x - self.origin_m[0], y - self.origin_m[1]];
        [
            dx * self.cosine + dy * self.sine,
            dy * self.cosine - dx * self.sine,
        ]
    }

    /// Where the sensor is.
    pub fn origin_m(&self) -> [f64; 2] {
        self.origin_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_close(a: [f64; 2], b: [f64; 2]) -> bool {
        (a[0] - b[0]).abs() < 1e-9 && (a[1] - b[1]).abs() < 1e-9
    }

    #[test]
    fn without_a_pose_right_is_east_and_forward_north() {
        let placement = Pose::SENSOR.placement();
        assert!(is_close(placement.local_m([3.0, 4.0]), [3.0, 4.0]));
    }

    #[test]
    fn a_vehicle_that_looks_east_has_its_right_in_the_south() {
        let pose = Pose {
            position_m: [10.0, 20.0, 0.0],
            yaw_rad: 0.0,
        };
        let placement = pose.placement();
        assert!(is_close(placement.local_m([1.0, 5.0]), [15.0, 19.0]));
        assert!(is_close(placement.sensor_m([15.0, 19.0]), [1.0, 5.0]));
        let roof = pose.mounted([2.0, 1.0, 1.5], FRAC_PI_2);
        assert!(is_close(
            [roof.position_m[0], roof.position_m[1]],
            [12.0, 21.0]
        ));
        assert!((roof.yaw_rad - FRAC_PI_2).abs() < 1e-9);
    }

    #[test]
    fn between_two_poses_the_shorter_turn_is_taken() {
        let at = |yaw_rad: f64| Pose {
            position_m: [0.0; 3],
            yaw_rad,
        };
        let middle = at(3.0).toward(&at(-3.0), 0.5);
        assert!((middle.yaw_rad.abs() - PI).abs() < 1e-9, "{middle:?}");
        let beyond = at(0.0).toward(&at(0.2), 2.0);
        assert!((beyond.yaw_rad - 0.4).abs() < 1e-9);
    }
}
