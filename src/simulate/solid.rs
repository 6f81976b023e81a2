//! Solids that stand on the road, and rays that hit them.

/// A ray from the sensor, which is the origin.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ray {
    /// Unit vector.
    pub(super) direction: [f64; 3],
}

impl Ray {
    /// In the sensor's convention: azimuth clockwise from y.
    pub(super) fn new(azimuth_rad: f64, elevation_rad: f64) -> Self {
        let (sine_a, cosine_a) = libm::sincos(azimuth_rad);
        let (sine_e, cosine_e) = libm::sincos(elevation_rad);
        Self {
            direction: [cosine_e * sine_a, cosine_e * cosine_a, sine_e],
        }
    }

    /// Where the ray passes between two heights, as distances along it.
    fn between(&self, low_m: f64, high_m: f64) -> (f64, f64) {
        slab(0.0, self.direction[2], low_m, high_m)
    }
}

/// A solid with upright sides between two heights.
#[derive(Debug, Clone, Copy)]
pub(super) struct Solid {
    pub(super) shape: Shape,
    pub(super) low_m: f64,
    pub(super) high_m: f64,
}

/// The outline of a solid from above.
#[derive(Debug, Clone, Copy)]
pub(super) enum Shape {
    /// A rectangle around a middle.
    Box {
        centre_m: [f64; 2],
        yaw_rad: f64,
        length_m: f64,
        width_m: f64,
    },
    /// A circle.
    Cylinder { centre_m: [f64; 2], radius_m: f64 },
}

impl Solid {
    /// Distance to where a ray enters the solid.
    pub(super) fn hit(&self, ray: &Ray) -> Option<f64> {
        let [dx, dy, _] = ray.direction;
        let outline = match self.shape {
            Shape::Box {
                centre_m: [x, y],
                yaw_rad,
                length_m,
                width_m,
            } => {
                let (sine, cosine) = libm::sincos(yaw_rad);
                let along = |x: f64, y: f64| x * cosine + y * sine;
                let across = |x: f64, y: f64| y * cosine - x * sine;
                overlap(
                    slab(-along(x, y), along(dx, dy), -0.5 * length_m, 0.5 * length_m),
                    slab(-across(x, y), across(dx, dy), -0.5 * width_m, 0.5 * width_m),
                )
            }
            Shape::Cylinder {
                centre_m: [x, y],
                radius_m,
            } => circle(x, y, dx, dy, radius_m),
        };
        let (enter, leave) = overlap(outline, ray.between(self.low_m, self.high_m));
        (enter < leave && enter > 0.0).then_some(enter)
    }

    /// The middle and the radius of a circle around the outline.
    pub(super) fn bounds(&self) -> ([f64; 2], f64) {
        match self.shape {
            Shape::Box {
                centre_m,
                length_m,
                width_m,
                ..
            } => (centre_m, 0.5 * libm::hypot(length_m, width_m)),
            Shape::Cylinder { centre_m, radius_m } => (centre_m, radius_m),
        }
    }
}

/// Where `start + t * rate` lies between `low` and `high`, as an interval of t.
fn slab(start: f64, rate: f64, low: f64, high: f64) -> (f64, f64) {
    if rate.abs() < 1e-12 {
        let inside = (low..=high).contains(&start);
        return if inside {
            (f64::MIN, f64::MAX)
        } else {
            NOWHERE
        };
    }
    let (a, b) = ((low - start) / rate, (high - start) / rate);
    (a.min(b), a.max(b))
}

fn circle(x: f64, y: f64, dx: f64, dy: f64, radius_m: f64) -> (f64, f64) {
    let (a, b) = (dx * dx + dy * dy, dx * x + dy * y);
    let discriminant = b * b - a * (x * x + y * y - radius_m * radius_m);
    if discriminant < 0.0 || a < 1e-12 {
        return NOWHERE;
    }
    let root = libm::sqrt(discriminant);
    ((b - root) / a, (b + root) / a)
}

const NOWHERE: (f64, f64) = (f64::MAX, f64::MIN);

fn overlap(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    (a.0.max(b.0), a.1.min(b.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    const AHEAD: Ray = Ray {
        direction: [0.0, 1.0, 0.0],
    };

    #[test]
    fn a_box_is_hit_on_its_near_side() {
        let mut solid = Solid {
            shape: Shape::Box {
                centre_m: [0.5, 10.0],
                yaw_rad: std::f64::consts::FRAC_PI_2,
                length_m: 4.0,
                width_m: 2.0,
            },
            low_m: -1.0,
            high_m: 0.5,
        };
        assert!((solid.hit(&AHEAD).unwrap() - 8.0).abs() < 1e-9);
        solid.high_m = -0.5;
        assert_eq!(solid.hit(&AHEAD), None);
    }

    #[test]
    fn a_ray_that_falls_hits_the_top() {
        let solid = Solid {
            shape: Shape::Cylinder {
                centre_m: [0.0, 10.0],
                radius_m: 3.0,
            },
            low_m: -2.0,
            high_m: -1.0,
        };
        let down = Ray::new(0.0, -(0.125f64).atan());
        assert!((down.direction[2] * solid.hit(&down).unwrap() + 1.0).abs() < 1e-9);
        assert_eq!(solid.hit(&Ray::new(0.5, 0.0)), None);
    }

    #[test]
    fn what_lies_behind_is_not_hit() {
        let solid = Solid {
            shape: Shape::Cylinder {
                centre_m: [0.0, -10.0],
                radius_m: 1.0,
            },
            low_m: -2.0,
            high_m: 1.0,
        };
        assert_eq!(solid.hit(&AHEAD), None);
    }
}
