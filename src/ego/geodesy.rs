//! WGS84 to metres east, north and up around a reference, and back.

use nalgebra::{Matrix3, Vector3};

/// Semi-major axis of the WGS84 ellipsoid, metres (NIMA TR8350.2, table 3.1).
const SEMI_MAJOR_M: f64 = 6_378_137.0;
/// Flattening of the WGS84 ellipsoid (same table).
const FLATTENING: f64 = 1.0 / 298.257_223_563;
/// First eccentricity, squared.
const ECCENTRICITY_SQUARED: f64 = FLATTENING * (2.0 - FLATTENING);

/// A place on or above the ellipsoid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Geodetic {
    /// North positive, degrees.
    pub latitude_deg: f64,
    /// East positive, degrees.
    pub longitude_deg: f64,
    /// Above the ellipsoid, metres.
    pub altitude_m: f64,
}

impl Geodetic {
    /// Whether it is a place at all.
    pub fn is_valid(&self) -> bool {
        self.latitude_deg.abs() <= 90.0
            && self.longitude_deg.abs() <= 360.0
            && self.altitude_m.abs() <= 1e5
    }

    /// In the frame that turns with the earth, from its centre.
    fn to_earth(self) -> Vector3<f64> {
        let (sine_lat, cosine_lat) = libm::sincos(self.latitude_deg.to_radians());
        let (sine_lon, cosine_lon) = libm::sincos(self.longitude_deg.to_radians());
        let normal_m = SEMI_MAJOR_M / libm::sqrt(1.0 - ECCENTRICITY_SQUARED * sine_lat * sine_lat);
        let out_m = (normal_m + self.altitude_m) * cosine_lat;
        Vector3::new(
            out_m * cosine_lon,
            out_m * sine_lon,
            (normal_m * (1.0 - ECCENTRICITY_SQUARED) + self.altitude_m) * sine_lat,
        )
    }

    /// By iteration on the latitude; four rounds leave less than a micrometre near the ground.
    fn from_earth(earth: Vector3<f64>) -> Self {
        let out_m = libm::hypot(earth.x, earth.y);
        let mut latitude = libm::atan2(earth.z, out_m * (1.0 - ECCENTRICITY_SQUARED));
        let mut altitude_m = 0.0;
        for _ in 0..4 {
            let (sine, cosine) = libm::sincos(latitude);
            let normal_m = SEMI_MAJOR_M / libm::sqrt(1.0 - ECCENTRICITY_SQUARED * sine * sine);
            altitude_m = out_m / cosine - normal_m;
            let share = normal_m / (normal_m + altitude_m);
            latitude = libm::atan2(earth.z, out_m * (1.0 - ECCENTRICITY_SQUARED * share));
        }
        Self {
            latitude_deg: latitude.to_degrees(),
            longitude_deg: libm::atan2(earth.y, earth.x).to_degrees(),
            altitude_m,
        }
    }
}

/// East, north and up around a reference on the ellipsoid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalFrame {
    origin: Vector3<f64>,
    /// Rows are east, north and up.
    axes: Matrix3<f64>,
}

impl LocalFrame {
    /// A frame that touches the ellipsoid's parallel at `reference`.
    pub fn around(reference: Geodetic) -> Self {
        let (sine_lat, cosine_lat) = libm::sincos(reference.latitude_deg.to_radians());
        let (sine_lon, cosine_lon) = libm::sincos(reference.longitude_deg.to_radians());
        Self {
            origin: reference.to_earth(),
            axes: Matrix3::new(
                -sine_lon,
                cosine_lon,
                0.0,
                -sine_lat * cosine_lon,
                -sine_lat * sine_lon,
                cosine_lat,
                cosine_lat * cosine_lon,
                cosine_lat * sine_lon,
                sine_lat,
            ),
        }
    }

    /// Metres east, north and up.
    pub fn local_m(&self, place: Geodetic) -> [f64; 3] {
        (self.axes * (place.to_earth() - self.origin)).into()
    }

    /// Where the frame lies.
    pub fn reference(&self) -> Geodetic {
        Geodetic::from_earth(self.origin)
    }

    /// How far north at a place is turned counter-clockwise from the frame's north: meridians converge.
    pub fn north_turn_rad(&self, place: Geodetic) -> f64 {
        let [_, north, _] = Self::around(place).rows();
        let [east, ahead, _]: [f64; 3] = (self.axes * north).into();
        libm::atan2(-east, ahead)
    }

    /// East, north and up in the frame that turns with the earth.
    fn rows(&self) -> [Vector3<f64>; 3] {
        [0, 1, 2].map(|row| self.axes.row(row).transpose())
    }

    /// The place so many metres east, north and up.
    pub fn geodetic(&self, local_m: [f64; 3]) -> Geodetic {
        Geodetic::from_earth(self.origin + self.axes.transpose() * Vector3::from(local_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CHALMERS: Geodetic = Geodetic {
        latitude_deg: 57.7,
        longitude_deg: 11.97,
        altitude_m: 50.0,
    };

    #[test]
    fn north_turns_with_the_longitude_times_the_sine_of_the_latitude() {
        let frame = LocalFrame::around(CHALMERS);
        let east = Geodetic {
            longitude_deg: CHALMERS.longitude_deg + 1.6,
            ..CHALMERS
        };
        let expected_deg = 1.6 * CHALMERS.latitude_deg.to_radians().sin();
        // Seen from the west, meridians to the east lean to the west.
        assert!((frame.north_turn_rad(east).to_degrees() - expected_deg).abs() < 0.02);
        assert!(frame.north_turn_rad(CHALMERS).abs() < 1e-12);
    }

    #[test]
    fn places_keep_their_millimetre_over_a_thousand_kilometres() {
        let frame = LocalFrame::around(CHALMERS);
        let far_m = [1e6, -3e5, -8e4];
        let back_m = frame.local_m(frame.geodetic(far_m));
        assert!(
            (0..3).all(|axis| (back_m[axis] - far_m[axis]).abs() < 1e-3),
            "{back_m:?}"
        );
        let reference = frame.reference();
        assert!((reference.latitude_deg - CHALMERS.latitude_deg).abs() < 1e-9);
    }

    #[test]
    fn a_degree_is_as_long_as_on_the_ellipsoid() {
        let frame = LocalFrame::around(CHALMERS);
        let moved = |north: f64, east: f64| {
            frame.local_m(Geodetic {
                latitude_deg: CHALMERS.latitude_deg + north,
                longitude_deg: CHALMERS.longitude_deg + east,
                ..CHALMERS
            })
        };
        // Lengths of a degree at this latitude: 111,364 m of meridian, 59,633 m of parallel.
        let [_, north_m, _] = moved(0.001, 0.0);
        assert!((north_m - 111.364).abs() < 0.01, "{north_m}");
        let [east_m, _, _] = moved(0.0, 0.001);
        assert!((east_m - 59.633).abs() < 0.01, "{east_m}");
    }

    #[test]
    fn there_and_back_is_the_same_place() {
        let frame = LocalFrame::around(CHALMERS);
        for local_m in [[0.0; 3], [1000.0, -2000.0, 30.0], [-5.0, 7.0, -3.0]] {
            let back = frame.local_m(frame.geodetic(local_m));
            for (back, there) in back.iter().zip(local_m) {
                assert!((back - there).abs() < 1e-6, "{back} {there}");
            }
        }
    }
}
