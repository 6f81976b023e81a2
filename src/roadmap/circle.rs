//! Circles through points.

/// A circle from above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// Its middle.
    pub centre_m: [f64; 2],
    /// From there to it.
    pub radius_m: f64,
}

/// Rounds of Gauss and Newton; three suffice for what begins with the algebraic fit.
const ROUNDS: usize = 5;

impl Circle {
    /// The circle with the least squared distances to the points: Kasa's algebraic fit, then
    /// Gauss-Newton on the distances themselves (Chernov and Lesort 2005, "Least squares fitting
    /// of circles", section 4). Nothing if they lie on a line.
    pub fn fit(points_m: &[[f64; 2]]) -> Option<Self> {
        let mut circle = Self::algebraic(points_m)?;
        for _ in 0..ROUNDS {
            circle = circle.improved(points_m)?;
        }
        circle.radius_m.is_finite().then_some(circle)
    }

    fn algebraic(points_m: &[[f64; 2]]) -> Option<Self> {
        let count = points_m.len() as f64;
        let mean = |axis: usize| points_m.iter().map(|point| point[axis]).sum::<f64>() / count;
        let middle_m = [mean(0), mean(1)];
        let mut normal = nalgebra::Matrix3::zeros();
        let mut right = nalgebra::Vector3::zeros();
        for [x, y] in points_m {
            let [u, v] = [x - middle_m[0], y - middle_m[1]];
            let row = nalgebra::Vector3::new(u, v, 1.0);
            normal += row * row.transpose();
            right += row * (u * u + v * v);
        }
        let found = normal.lu().solve(&right)?;
        let [u, v] = [found[0] / 2.0, found[1] / 2.0];
        let square = found[2] + u * u + v * v;
        (square > 0.0 && square.is_finite()).then(|| Self {
            centre_m: [middle_m[0] + u, middle_m[1] + v],
            radius_m: libm::sqrt(square),
        })
    }

    fn improved(&self, points_m: &[[f64; 2]]) -> Option<Self> {
        let mut normal = nalgebra::Matrix3::zeros();
        let mut right = nalgebra::Vector3::zeros();
        for [x, y] in points_m {
            let [dx, dy] = [x - self.centre_m[0], y - self.centre_m[1]];
            let away_m = libm::hypot(dx, dy);
            if away_m == 0.0 {
                continue;
            }
            let row = nalgebra::Vector3::new(dx / away_m, dy / away_m, 1.0);
            normal += row * row.transpose();
            right += row * (away_m - self.radius_m);
        }
        let step = normal.lu().solve(&right)?;
        Some(Self {
            centre_m: [self.centre_m[0] + step[0], self.centre_m[1] + step[1]],
            radius_m: self.radius_m + step[2],
        })
    }

    /// From the circle outward to a point.
    pub fn off_m(&self, [x, y]: [f64; 2]) -> f64 {
        libm::hypot(x - self.centre_m[0], y - self.centre_m[1]) - self.radius_m
    }

    /// Direction from the middle to a point, counter-clockwise from east.
    pub fn angle_rad(&self, [x, y]: [f64; 2]) -> f64 {
        libm::atan2(y - self.centre_m[1], x - self.centre_m[0])
    }

    /// The point of the circle in a direction.
    pub fn at(&self, angle_rad: f64) -> [f64; 2] {
        let (sine, cosine) = libm::sincos(angle_rad);
        [
            self.centre_m[0] + self.radius_m * cosine,
            self.centre_m[1] + self.radius_m * sine,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_third_of_a_circle_is_enough() {
        let truth = Circle {
            centre_m: [-218.0, 78.0],
            radius_m: 11.0,
        };
        let points_m: Vec<_> = (0..12)
            .map(|step| {
                let [x, y] = truth.at(f64::from(step) * 0.18);
                // To tenths of a metre, as maps are written.
                [x, y].map(|metres| libm::round(metres * 10.0) / 10.0)
            })
            .collect();
        let found = Circle::fit(&points_m).unwrap();
        assert!((found.radius_m - 11.0).abs() < 0.2, "{found:?}");
        assert!(found.off_m([-218.0, 89.0]).abs() < 0.2);
    }

    #[test]
    fn a_line_is_no_circle() {
        let line: Vec<_> = (0..9).map(|step| [f64::from(step), 0.0]).collect();
        assert!(Circle::fit(&line).is_none_or(|circle| circle.radius_m > 1e6));
        assert_eq!(Circle::fit(&[[1.0, 1.0]; 4]), None);
    }
}
