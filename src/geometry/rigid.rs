//! Places and directions in space, and how they change.

use nalgebra::{Matrix3, Vector3, Vector6};

/// A turn and a shift: from the sensor frame to the odometry frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rigid {
    /// A rotation matrix.
    pub rotation: Matrix3<f64>,
    /// Where the sensor is, metres.
    pub translation_m: Vector3<f64>,
}

impl Rigid {
    /// The sensor frame itself.
    pub const IDENTITY: Self = Self {
        rotation: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        translation_m: Vector3::new(0.0, 0.0, 0.0),
    };

    /// A point of the sensor frame in the odometry frame.
    pub fn place(&self, point_m: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * point_m + self.translation_m
    }

    /// Shifted by the first half of `step` and turned about its own place by the second, both in
    /// the odometry frame.
    pub fn moved(&self, step: &Vector6<f64>) -> Self {
        Self {
            rotation: orthonormal(turn(&angular(step)) * self.rotation),
            translation_m: self.translation_m + linear(step),
        }
    }

    /// The step that leads from this one to another: the inverse of [`Rigid::moved`].
    pub fn step_to(&self, other: &Self) -> Vector6<f64> {
        let shift = other.translation_m - self.translation_m;
        let turned = turned_by(&(other.rotation * self.rotation.transpose()));
        Vector6::new(shift.x, shift.y, shift.z, turned.x, turned.y, turned.z)
    }

    /// As a unit quaternion x, y, z, w (Shepperd 1978: by the greatest of four).
    pub fn quaternion(&self) -> [f64; 4] {
        let r = |row: usize, column: usize| self.rotation[(row, column)];
        let trace = r(0, 0) + r(1, 1) + r(2, 2);
        if trace > 0.0 {
            let twice = 2.0 * libm::sqrt(1.0 + trace);
            return [
                (r(2, 1) - r(1, 2)) / twice,
                (r(0, 2) - r(2, 0)) / twice,
                (r(1, 0) - r(0, 1)) / twice,
                0.25 * twice,
            ];
        }
        let greatest = (1..3).fold(0, |i, j| if r(j, j) > r(i, i) { j } else { i });
        let (i, j, k) = (greatest, (greatest + 1) % 3, (greatest + 2) % 3);
        let twice = 2.0 * libm::sqrt((1.0 + r(i, i) - r(j, j) - r(k, k)).max(0.0));
        let mut quaternion = [0.0; 4];
        quaternion[i] = 0.25 * twice;
        quaternion[j] = (r(i, j) + r(j, i)) / twice;
        quaternion[k] = (r(i, k) + r(k, i)) / twice;
        quaternion[3] = (r(k, j) - r(j, k)) / twice;
        quaternion
    }
}

/// The shift of a step.
pub(crate) fn linear(step: &Vector6<f64>) -> Vector3<f64> {
    Vector3::new(step[0], step[1], step[2])
}

/// The turn of a step, about an axis of its direction by its length in radians.
pub(crate) fn angular(step: &Vector6<f64>) -> Vector3<f64> {
    Vector3::new(step[3], step[4], step[5])
}

/// The rotation about an axis by its length in radians (Rodrigues' formula).
pub(crate) fn turn(axis: &Vector3<f64>) -> Matrix3<f64> {
    let angle = libm::sqrt(axis.norm_squared());
    let across = axis.cross_matrix();
    let (first, second) = if angle < 1e-6 {
        (1.0, 0.5)
    } else {
        let (sine, cosine) = libm::sincos(angle);
        (sine / angle, (1.0 - cosine) / (angle * angle))
    };
    Matrix3::identity() + across * first + across * across * second
}

/// The axis and angle of a rotation of less than half a turn.
fn turned_by(rotation: &Matrix3<f64>) -> Vector3<f64> {
    let axis = 0.5
        * Vector3::new(
            rotation[(2, 1)] - rotation[(1, 2)],
            rotation[(0, 2)] - rotation[(2, 0)],
            rotation[(1, 0)] - rotation[(0, 1)],
        );
    let sine = libm::sqrt(axis.norm_squared());
    if sine < 1e-9 {
        return axis;
    }
    let cosine = 0.5 * (rotation.trace() - 1.0);
    axis * (libm::atan2(sine, cosine) / sine)
}

/// Rounding adds up over a drive: rows are made orthogonal again.
fn orthonormal(rotation: Matrix3<f64>) -> Matrix3<f64> {
    let unit = |v: Vector3<f64>| v / libm::sqrt(v.norm_squared());
    let x = unit(rotation.column(0).into_owned());
    let y = rotation.column(1).into_owned();
    let y = unit(y - x * x.dot(&y));
    Matrix3::from_columns(&[x, y, x.cross(&y)])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn somewhere() -> Rigid {
        Rigid::IDENTITY.moved(&Vector6::new(3.0, -2.0, 0.5, 0.2, -0.4, 2.6))
    }

    #[test]
    fn a_step_and_the_way_back_are_inverse() {
        let step = Vector6::new(0.3, 0.1, -0.2, 0.05, -0.3, 0.7);
        let there = somewhere().moved(&step);
        assert!((somewhere().step_to(&there) - step).norm() < 1e-12);
        assert!((there.rotation * there.rotation.transpose() - Matrix3::identity()).norm() < 1e-12);
    }

    #[test]
    fn a_quaternion_turns_as_its_matrix_does() {
        for angle in [0.0, 0.5, 2.0, 3.1, -3.1] {
            for axis in 0..3 {
                let mut step = Vector6::zeros();
                step[3 + axis] = angle;
                let [x, y, z, w] = Rigid::IDENTITY.moved(&step).quaternion();
                let (sine, cosine) = libm::sincos(0.5 * angle);
                let expected: Vec<f64> =
                    (0..3).map(|i| if i == axis { sine } else { 0.0 }).collect();
                let sign = if w * cosine < 0.0 { -1.0 } else { 1.0 };
                for (found, expected) in [x, y, z].iter().zip(expected) {
                    assert!((sign * found - expected).abs() < 1e-9, "{angle} {axis}");
                }
            }
        }
    }
}
