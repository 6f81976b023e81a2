//! The ground: level but for swells, with the unevenness of a road.

use super::solid::{Hit, Ray};

/// Ground as a height over every place.
#[derive(Debug, Clone, Default)]
pub(super) struct Terrain {
    pub(super) swells: Vec<Swell>,
    /// Half of the height between hollows and humps some metres apart.
    pub(super) unevenness_m: f64,
}

/// A rise from one level to another along a direction.
#[derive(Debug, Clone, Copy)]
pub(super) struct Swell {
    /// Unit vector.
    pub(super) direction: [f64; 2],
    /// Where along the direction it begins.
    pub(super) from_m: f64,
    pub(super) length_m: f64,
    pub(super) rise_m: f64,
}

/// Share of the light that asphalt throws back.
const ASPHALT: f64 = 0.22;
const FARTHEST_M: f64 = 130.0;

impl Terrain {
    /// Height at a place.
    pub(super) fn height_m(&self, x: f64, y: f64) -> f64 {
        let swells: f64 = self.swells.iter().map(|swell| swell.height_m(x, y)).sum();
        if self.unevenness_m == 0.0 {
            return swells;
        }
        let waves = libm::sin(0.31 * x + 0.17 * y)
            + libm::sin(0.83 * y - 0.29 * x + 1.0)
            + libm::sin(0.55 * x + 0.71 * y + 2.0);
        swells + self.unevenness_m * waves / 3.0
    }

    /// A slope that is nowhere exceeded: the steepest place of a cubic is half way, and the
    /// waves' slopes add up to no more than their frequencies.
    fn steepest(&self) -> f64 {
        let swells = self
            .swells
            .iter()
            .map(|swell| 1.5 * swell.rise_m.abs() / swell.length_m);
        swells.sum::<f64>() + 0.72 * self.unevenness_m + 1e-6
    }

    /// Where a ray meets the ground.
    pub(super) fn hit(&self, ray: &Ray) -> Option<Hit> {
        let [dx, dy, dz] = ray.direction;
        let across = libm::hypot(dx, dy);
        // The gap closes by no more than this for each metre along the ray.
        let closing = self.steepest() * across - dz;
        let gap_m = |range_m: f64| {
            let [x, y, z] = ray.at(range_m);
            z - self.height_m(x, y)
        };
        let mut range_m = 0.0;
        if self.swells.is_empty() && self.unevenness_m == 0.0 {
            range_m = -ray.origin[2] / dz;
            if dz >= 0.0 {
                return None;
            }
        } else if closing > 0.0 {
            loop {
                let gap_m = gap_m(range_m);
                if gap_m < 0.002 {
                    break;
                }
                range_m += (gap_m / closing).max(0.002);
                if range_m > FARTHEST_M {
                    return None;
                }
            }
        } else {
            return None;
        }
        let [x, y, _] = ray.at(range_m);
        let slope = |dx: f64, dy: f64| {
            (self.height_m(x + dx, y + dy) - self.height_m(x - dx, y - dy)) / 0.1
        };
        let (slope_x, slope_y) = (slope(0.05, 0.0), slope(0.0, 0.05));
        let length = libm::sqrt(1.0 + slope_x * slope_x + slope_y * slope_y);
        Some(Hit {
            range_m,
            incidence: ((slope_x * dx + slope_y * dy - dz) / length).clamp(0.0, 1.0),
            reflectance: ASPHALT,
        })
        .filter(|hit| hit.range_m < FARTHEST_M)
    }
}

impl Swell {
    fn height_m(&self, x: f64, y: f64) -> f64 {
        let along_m = x * self.direction[0] + y * self.direction[1] - self.from_m;
        let share = (along_m / self.length_m).clamp(0.0, 1.0);
        // Even at both ends (a cubic).
        self.rise_m * share * share * (3.0 - 2.0 * share)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn down(slope: f64) -> Ray {
        let (sine, cosine) = libm::sincos(libm::atan(slope));
        Ray {
            origin: [0.0, 0.0, 2.0],
            direction: [0.0, cosine, -sine],
        }
    }

    #[test]
    fn level_ground_is_met_where_the_ray_has_fallen() {
        let hit = Terrain::default().hit(&down(0.1)).unwrap();
        let [_, y, z] = down(0.1).at(hit.range_m);
        assert!((y - 20.0).abs() < 1e-9 && z.abs() < 1e-9);
        assert!(Terrain::default().hit(&down(-0.1)).is_none());
    }

    #[test]
    fn a_hill_is_met_before_the_level_and_on_its_surface() {
        let hill = Terrain {
            swells: vec![Swell {
                direction: [0.0, 1.0],
                from_m: 10.0,
                length_m: 20.0,
                rise_m: 2.0,
            }],
            unevenness_m: 0.02,
        };
        let hit = hill.hit(&down(0.05)).unwrap();
        let [x, y, z] = down(0.05).at(hit.range_m);
        assert!(y > 15.0 && y < 25.0, "{y}");
        assert!((z - hill.height_m(x, y)).abs() < 0.003);
    }
}
