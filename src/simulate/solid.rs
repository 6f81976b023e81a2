//! Solids, and rays that hit them.

use crate::random::Random;

/// A vector in metres, or a direction.
pub(super) type Vector = [f64; 3];

pub(super) fn dot(a: &Vector, b: &Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// A ray of the sensor.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ray {
    pub(super) origin: Vector,
    /// Unit vector.
    pub(super) direction: Vector,
}

impl Ray {
    pub(super) fn at(&self, range_m: f64) -> Vector {
        [0, 1, 2].map(|axis| self.origin[axis] + range_m * self.direction[axis])
    }

    /// The same ray as seen from a frame at `place`, turned by `yaw_rad`.
    pub(super) fn seen_from(&self, place: &Vector, sine: f64, cosine: f64) -> Self {
        let turned = |[x, y, z]: Vector| [x * cosine + y * sine, y * cosine - x * sine, z];
        let offset = [0, 1, 2].map(|axis| self.origin[axis] - place[axis]);
        Self {
            origin: turned(offset),
            direction: turned(self.direction),
        }
    }
}

/// What a solid is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Fabric {
    /// Every ray ends on its surface.
    Dense,
    /// Rays end somewhere within: leaves, grass. Mean way of a ray through it in metres.
    Leaves(f64),
    /// Some rays pass: glass, spokes, the gaps of a frame. Share of those that do.
    Open(f64),
}

/// A convex solid.
#[derive(Debug, Clone)]
pub(super) struct Solid {
    pub(super) shape: Shape,
    pub(super) fabric: Fabric,
    /// Share of the light that a surface throws back at right angles.
    pub(super) reflectance: f64,
}

#[derive(Debug, Clone)]
pub(super) enum Shape {
    /// Where all half-spaces overlap: outward unit normal, and distance from the origin.
    Convex(Vec<(Vector, f64)>),
    /// Upright, on a circle.
    Cylinder {
        centre_m: [f64; 2],
        radius_m: f64,
        low_m: f64,
        high_m: f64,
    },
}

/// Where a ray ends.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hit {
    pub(super) range_m: f64,
    /// Cosine of the angle between the ray and the surface's normal.
    pub(super) incidence: f64,
    pub(super) reflectance: f64,
}

impl Solid {
    /// Where a ray ends on or in the solid. `luck` decides what chance must decide.
    pub(super) fn hit(&self, ray: &Ray, luck: &mut Random) -> Option<Hit> {
        let (enter, leave, incidence) = self.shape.crossing(ray)?;
        let hit = |range_m, incidence| {
            Some(Hit {
                range_m,
                incidence,
                reflectance: self.reflectance,
            })
        };
        match self.fabric {
            Fabric::Dense if enter > 0.0 => hit(enter, incidence),
            Fabric::Dense => None,
            Fabric::Open(passes) if enter > 0.0 && luck.uniform() >= passes => {
                hit(enter, incidence)
            }
            Fabric::Open(_) => None,
            Fabric::Leaves(mean_m) => {
                // A leaf turns its face anywhere.
                let depth_m = -mean_m * libm::log(1.0 - luck.uniform());
                let (range_m, incidence) = (enter.max(0.0) + depth_m, 0.3 + 0.7 * luck.uniform());
                if range_m < leave {
                    hit(range_m, incidence)
                } else {
                    None
                }
            }
        }
    }

    /// Whether a place lies within.
    pub(super) fn contains(&self, at: &Vector) -> bool {
        match &self.shape {
            Shape::Convex(planes) => planes
                .iter()
                .all(|(normal, offset)| dot(normal, at) <= *offset),
            Shape::Cylinder {
                centre_m: [x, y],
                radius_m,
                low_m,
                high_m,
            } => {
                libm::hypot(at[0] - x, at[1] - y) <= *radius_m
                    && (*low_m..=*high_m).contains(&at[2])
            }
        }
    }

    /// Radius around the origin of the frame that holds the outline of a convex solid, and the
    /// middle and radius of a cylinder.
    pub(super) fn bounds(&self) -> ([f64; 2], f64) {
        match &self.shape {
            Shape::Convex(planes) => {
                // The extent along each axis direction, from the planes that face it.
                let along = |axis: usize, sign: f64| {
                    let facing = planes
                        .iter()
                        .filter(|(normal, _)| normal[axis] * sign > 0.5);
                    facing
                        .map(|(normal, offset)| offset / normal[axis].abs())
                        .fold(0.0, f64::max)
                };
                let far = |axis| along(axis, 1.0).max(along(axis, -1.0));
                ([0.0; 2], libm::hypot(far(0), far(1)))
            }
            Shape::Cylinder {
                centre_m, radius_m, ..
            } => (*centre_m, *radius_m),
        }
    }
}

impl Shape {
    /// Ranges at which a ray enters and leaves, and the cosine of its incidence.
    fn crossing(&self, ray: &Ray) -> Option<(f64, f64, f64)> {
        match self {
            Self::Convex(planes) => {
                let (mut enter, mut leave, mut incidence) = (f64::MIN, f64::MAX, 1.0);
                for (normal, offset) in planes {
                    let (rate, gap) = (
                        dot(normal, &ray.direction),
                        offset - dot(normal, &ray.origin),
                    );
                    if rate.abs() < 1e-12 {
                        if gap < 0.0 {
                            return None;
                        }
                    } else if rate < 0.0 && gap / rate > enter {
                        (enter, incidence) = (gap / rate, -rate);
                    } else if rate > 0.0 {
                        leave = leave.min(gap / rate);
                    }
                }
                (enter < leave && leave > 0.0).then_some((enter, leave, incidence))
            }
            Self::Cylinder {
                centre_m: [x, y],
                radius_m,
                low_m,
                high_m,
            } => {
                let [dx, dy, dz] = ray.direction;
                let (ox, oy) = (x - ray.origin[0], y - ray.origin[1]);
                let (a, b) = (dx * dx + dy * dy, dx * ox + dy * oy);
                let discriminant = b * b - a * (ox * ox + oy * oy - radius_m * radius_m);
                if discriminant < 0.0 || a < 1e-12 {
                    return None;
                }
                let root = libm::sqrt(discriminant);
                let around = ((b - root) / a, (b + root) / a);
                let heights = slab(ray.origin[2], dz, *low_m, *high_m);
                let (enter, leave) = (around.0.max(heights.0), around.1.min(heights.1));
                let incidence = if heights.0 > around.0 {
                    dz.abs()
                } else {
                    root / radius_m
                };
                (enter < leave && leave > 0.0).then_some((enter, leave, incidence.min(1.0)))
            }
        }
    }
}

/// Where `start + t * rate` lies between `low` and `high`, as an interval of t.
fn slab(start: f64, rate: f64, low: f64, high: f64) -> (f64, f64) {
    if rate.abs() < 1e-12 {
        return if (low..=high).contains(&start) {
            (f64::MIN, f64::MAX)
        } else {
            (f64::MAX, f64::MIN)
        };
    }
    let (a, b) = ((low - start) / rate, (high - start) / rate);
    (a.min(b), a.max(b))
}

/// A box: `middle_m` and half its sizes, along the axes of its frame.
pub(super) fn block(low_m: Vector, high_m: Vector) -> Shape {
    let faces = (0..3).flat_map(|axis| {
        [(1.0, high_m[axis]), (-1.0, -low_m[axis])].map(|(sign, offset)| {
            let mut normal = [0.0; 3];
            normal[axis] = sign;
            (normal, offset)
        })
    });
    Shape::Convex(faces.collect())
}

/// A convex outline in (along, up), counter-clockwise, drawn out to `half_width_m` on either
/// side.
pub(super) fn extruded(outline_m: &[[f64; 2]], half_width_m: f64) -> Vec<(Vector, f64)> {
    let next = outline_m.iter().cycle().skip(1);
    let edges = outline_m.iter().zip(next).map(|([u, z], [u2, z2])| {
        let length = libm::hypot(u2 - u, z2 - z);
        let (normal_u, normal_z) = ((z2 - z) / length, (u - u2) / length);
        ([normal_u, 0.0, normal_z], normal_u * u + normal_z * z)
    });
    edges
        .chain([
            ([0.0, 1.0, 0.0], half_width_m),
            ([0.0, -1.0, 0.0], half_width_m),
        ])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ray(origin: Vector, direction: Vector) -> Ray {
        let length = dot(&direction, &direction).sqrt();
        Ray {
            origin,
            direction: direction.map(|part| part / length),
        }
    }

    fn dense(shape: Shape) -> Solid {
        Solid {
            shape,
            fabric: Fabric::Dense,
            reflectance: 0.5,
        }
    }

    #[test]
    fn a_box_is_hit_on_its_near_side() {
        let solid = dense(block([-2.0, -1.0, 0.0], [2.0, 1.0, 1.5]));
        let luck = &mut Random::new(1);
        let hit = solid
            .hit(&ray([-10.0, 0.0, 1.0], [1.0, 0.0, 0.0]), luck)
            .unwrap();
        assert!((hit.range_m - 8.0).abs() < 1e-9 && (hit.incidence - 1.0).abs() < 1e-9);
        let over = ray([-10.0, 0.0, 1.6], [1.0, 0.0, 0.0]);
        assert!(solid.hit(&over, luck).is_none());
        let away = ray([-10.0, 0.0, 1.0], [-1.0, 0.0, 0.0]);
        assert!(solid.hit(&away, luck).is_none());
    }

    #[test]
    fn a_sloped_screen_is_hit_where_it_slopes() {
        // A wedge that rises from 0 to 1 over a metre.
        let wedge = dense(Shape::Convex(extruded(
            &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]],
            1.0,
        )));
        let luck = &mut Random::new(1);
        let hit = wedge
            .hit(&ray([-5.0, 0.0, 0.5], [1.0, 0.0, 0.0]), luck)
            .unwrap();
        assert!((hit.range_m - 5.5).abs() < 1e-9);
        assert!((hit.incidence - 0.5f64.sqrt()).abs() < 1e-9);
    }

    #[test]
    fn a_cylinder_is_hit_around_and_on_top() {
        let drum = dense(Shape::Cylinder {
            centre_m: [0.0, 10.0],
            radius_m: 3.0,
            low_m: 0.0,
            high_m: 1.0,
        });
        let luck = &mut Random::new(1);
        let level = ray([0.0, 0.0, 0.5], [0.0, 1.0, 0.0]);
        assert!((drum.hit(&level, luck).unwrap().range_m - 7.0).abs() < 1e-9);
        let down = ray([0.0, 10.0, 5.0], [0.0, 0.0, -1.0]);
        assert!(drum.hit(&down, luck).is_none_or(|hit| hit.range_m > 3.9));
        let falling = ray([0.0, 0.0, 2.0], [0.0, 8.0, -1.0]);
        let top = falling.at(drum.hit(&falling, luck).unwrap().range_m);
        assert!((top[2] - 1.0).abs() < 1e-9);
    }

    #[test]
    fn half_of_the_rays_pass_a_half_open_solid_and_leaves_stop_them_within() {
        let shape = block([-1.0, -1.0, 0.0], [1.0, 1.0, 2.0]);
        let along = ray([-5.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
        let mut luck = Random::new(5);
        let mut ranges = |fabric| {
            let solid = Solid {
                shape: shape.clone(),
                fabric,
                reflectance: 0.5,
            };
            let hits = (0..1000).filter_map(|_| solid.hit(&along, &mut luck));
            hits.map(|hit| hit.range_m).collect::<Vec<_>>()
        };
        let open = ranges(Fabric::Open(0.5)).len();
        assert!((400..600).contains(&open), "{open}");
        let leaves = ranges(Fabric::Leaves(0.5));
        assert!(leaves.len() > 950 && leaves.iter().all(|range| (4.0..6.0).contains(range)));
    }
}
