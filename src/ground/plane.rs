//! Planes in Hesse normal form and their fit.

use nalgebra::Vector3;

/// A plane in the sensor frame: n . p + h = 0 with the unit normal n pointing up, so that h
/// is the height of the sensor above the plane and n . p + h the height of a point above it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    normal: Vector3<f64>,
    height_m: f64,
}

/// Determinant to go on with where the thesis' system has none.
const SMALL_DETERMINANT: f64 = 1e-9;

impl Plane {
    /// A level plane `height_m` below the sensor.
    pub fn level(height_m: f64) -> Self {
        Self {
            normal: Vector3::z(),
            height_m,
        }
    }

    /// The plane through three points, or `None` if they lie on a line or the plane is
    /// upright.
    pub fn through(a: Vector3<f64>, b: Vector3<f64>, c: Vector3<f64>) -> Option<Self> {
        let across = (b - a).cross(&(c - a));
        Self::with_normal(across, a)
    }

    fn with_normal(direction: Vector3<f64>, point: Vector3<f64>) -> Option<Self> {
        let length = direction.norm();
        if length < 1e-9 || direction.z.abs() < 1e-6 * length {
            return None;
        }
        let normal = direction * (direction.z.signum() / length);
        Some(Self {
            normal,
            height_m: -normal.dot(&point),
        })
    }

    /// The plane of least squares along z through points. `None` without points.
    pub fn fit(points: impl Iterator<Item = Vector3<f64>>) -> Option<Self> {
        let mut moments = Moments::default();
        for point in points {
            moments.count += 1.0;
            moments.x += point.x;
            moments.y += point.y;
            moments.z += point.z;
            moments.xx += point.x * point.x;
            moments.xy += point.x * point.y;
            moments.yy += point.y * point.y;
            moments.xz += point.x * point.z;
            moments.yz += point.y * point.z;
        }
        moments.plane()
    }

    /// Height of a point above the plane; negative below it.
    pub fn above_m(&self, point: &Vector3<f64>) -> f64 {
        self.normal.dot(point) + self.height_m
    }

    /// The height of points above the plane, in the precision of the scan.
    pub(super) fn heights(&self) -> impl Fn(f32, f32, f32) -> f32 + use<> {
        let [a, b, c] = self.normal().map(|component| component as f32);
        let height_m = self.height_m as f32;
        move |x, y, z| a * x + b * y + c * z + height_m
    }

    /// Height of the sensor above the plane.
    pub fn height_m(&self) -> f64 {
        self.height_m
    }

    /// The unit normal, pointing up.
    pub fn normal(&self) -> [f64; 3] {
        self.normal.into()
    }

    /// Angle between the normal and the sensor's z axis.
    pub fn tilt_rad(&self) -> f64 {
        libm::acos(self.normal.z.min(1.0))
    }

    /// Angle between two planes.
    pub fn angle_to_rad(&self, other: &Self) -> f64 {
        libm::acos(self.normal.dot(&other.normal).min(1.0))
    }
}

/// Sums over points, from which the plane follows that fits them best.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Moments {
    pub(super) count: f64,
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) z: f64,
    pub(super) xx: f64,
    pub(super) xy: f64,
    pub(super) yy: f64,
    pub(super) xz: f64,
    pub(super) yz: f64,
}

impl Moments {
    /// Least squares along z (thesis section 4.1.1, "Plane-fitting"): points relative to their
    /// mean, so that d vanishes and a 2 x 2 system is left, solved by Cramer's rule; then the
    /// Hesse form from n = (a, b, 1) and the mean. `None` without points.
    pub(super) fn plane(&self) -> Option<Plane> {
        if self.count <= 0.0 {
            return None;
        }
        let mean = Vector3::new(self.x, self.y, self.z) / self.count;
        let xx = self.xx - mean.x * self.x;
        let xy = self.xy - mean.x * self.y;
        let yy = self.yy - mean.y * self.y;
        let xz = self.xz - mean.x * self.z;
        let yz = self.yz - mean.y * self.z;
        let determinant = match xx * yy - xy * xy {
            0.0 => SMALL_DETERMINANT,
            determinant => determinant,
        };
        let a = (yz * xy - xz * yy) / determinant;
        let b = (xy * xz - xx * yz) / determinant;
        Plane::with_normal(Vector3::new(a, b, 1.0), mean)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn on_plane(a: f64, b: f64, d: f64) -> impl Iterator<Item = Vector3<f64>> + Clone {
        (0..49).map(move |n| {
            let (x, y) = (f64::from(n % 7) * 3.0 - 4.0, f64::from(n / 7) * 2.0 - 9.0);
            Vector3::new(x, y, -(a * x + b * y + d))
        })
    }

    #[test]
    fn the_fit_recovers_the_plane_that_points_lie_on() {
        let plane = Plane::fit(on_plane(0.05, -0.1, 1.7)).unwrap();
        for point in on_plane(0.05, -0.1, 1.7) {
            assert!(plane.above_m(&point).abs() < 1e-12);
        }
        let length = (1.0 + 0.05f64.powi(2) + 0.1f64.powi(2)).sqrt();
        assert!((plane.height_m() - 1.7 / length).abs() < 1e-12);
    }

    #[test]
    fn the_fit_is_the_least_squares_along_z() {
        let wave = |n: usize| ((n * 7919) % 13) as f64 * 0.01;
        let points: Vec<_> = on_plane(0.02, 0.03, 2.0)
            .enumerate()
            .map(|(n, p)| p + Vector3::z() * wave(n))
            .collect();
        let error = |plane: &Plane| {
            let [a, b, c] = plane.normal();
            let residual = |p: &Vector3<f64>| p.z + (a * p.x + b * p.y + plane.height_m()) / c;
            points.iter().map(|p| residual(p).powi(2)).sum::<f64>()
        };
        let best = Plane::fit(points.iter().copied()).unwrap();
        let nudged = |da: f64, db: f64, dd: f64| {
            let [a, b, c] = best.normal();
            Plane::fit(on_plane(a / c + da, b / c + db, best.height_m() / c + dd)).unwrap()
        };
        for (da, db, dd) in [(1e-4, 0.0, 0.0), (0.0, -1e-4, 0.0), (0.0, 0.0, 1e-3)] {
            assert!(error(&nudged(da, db, dd)) > error(&best));
        }
    }

    #[test]
    fn three_points_in_any_order_give_the_same_plane_facing_up() {
        let [a, b, c] = [[0.0, 0.0, -2.0], [5.0, 0.0, -2.0], [0.0, 5.0, -1.5]].map(Vector3::from);
        let plane = Plane::through(a, b, c).unwrap();
        let turned = Plane::through(a, c, b).unwrap();
        assert!((plane.height_m() - turned.height_m()).abs() < 1e-12);
        assert!(plane.normal()[2] > 0.0 && plane.height_m() > 0.0);
        assert_eq!(Plane::through(a, b, a), None);
    }

    #[test]
    fn points_on_a_line_do_not_divide_by_zero() {
        let line = (0..5).map(|n| Vector3::new(f64::from(n), 0.0, -2.0));
        let plane = Plane::fit(line).unwrap();
        assert!(plane.height_m().is_finite());
    }
}
