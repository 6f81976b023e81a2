//! The bytes of a picture.
//!
//! Little-endian: the length of a heading in bytes and the heading, which is JSON; the number of
//! points, then x, y and z of all of them as 16-bit centimetres from the heading's origin in the
//! local frame's directions, and a byte for each that says what it is; how many of them have a reflectivity (all or none),
//! and a byte for each of these; then the frames that were published, as they were sent.

use serde::Serialize;

use super::labels::{Around, Labels};

/// Farther from the sensor along an axis than 16 bits of centimetres reach, metres.
const FARTHEST_M: f64 = 327.0;

/// Bytes of points in a picture. With so many a picture, its map tiles among it, stays below 200 kB.
const MOST_BYTES: usize = 154_000;
/// Bytes of a point without its reflectivity.
const POINT_BYTES: usize = 7;

/// Where a recording that is played is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Player {
    /// Seconds since its begin.
    pub at_s: f64,
    /// Seconds from begin to end.
    pub duration_s: f64,
    /// Whether it goes on by itself.
    pub is_playing: bool,
    /// Times as fast as recorded.
    pub speed: f64,
    /// Counts how often it was begun anew.
    pub run: u32,
}

#[derive(Serialize)]
struct Heading<'a> {
    origin_m: [f64; 3],
    yaw_rad: f64,
    ground_below_m: f64,
    steps_ms: &'a [(&'static str, f32)],
    player: Option<Player>,
}

/// Makes pictures, one after the other.
#[derive(Debug, Default)]
pub(super) struct Painter {
    /// What the points are.
    pub(super) labels: Labels,
    /// Places from the origin in centimetres, what is there, and its reflectivity.
    points: Vec<([i16; 3], u8, u8)>,
}

impl Painter {
    /// Appends the heading and the points; what they are was said before.
    pub(super) fn paint(
        &mut self,
        around: &Around<'_>,
        steps_ms: &[(&'static str, f32)],
        player: Option<Player>,
        out: &mut Vec<u8>,
    ) {
        let heading = Heading {
            origin_m: around.sensor.position_m,
            yaw_rad: around.sensor.yaw_rad,
            ground_below_m: around.ground_below_m,
            steps_ms,
            player,
        };
        // A struct of numbers is always JSON.
        let json = serde_json::to_vec(&heading).unwrap_or_default();
        put_length(out, json.len());
        out.extend_from_slice(&json);

        self.points.clear();
        let reflectivity = around.scan.reflectivity();
        for point in (0..around.scan.len()).filter(|point| around.scan.has_return(*point)) {
            let from_origin_m = self.labels.offset_m(around, point);
            if from_origin_m.iter().all(|metres| metres.abs() < FARTHEST_M) {
                let centimetres = from_origin_m.map(|metres| (100.0 * metres) as i16);
                let bright = reflectivity.get(point).copied().unwrap_or_default();
                self.points
                    .push((centimetres, self.labels.kind(point), bright));
            }
        }
        let bytes = POINT_BYTES + usize::from(!reflectivity.is_empty());
        let step = self.points.len().div_ceil(MOST_BYTES / bytes).max(1);
        let points = self.points.iter().step_by(step);
        put_length(out, points.len());
        for axis in 0..3 {
            let along = points.clone().map(|(centimetres, ..)| centimetres[axis]);
            out.extend(along.flat_map(i16::to_le_bytes));
        }
        out.extend(points.clone().map(|(_, kind, _)| kind));
        if reflectivity.is_empty() {
            put_length(out, 0);
        } else {
            put_length(out, points.len());
            out.extend(points.map(|(.., bright)| bright));
        }
    }
}

fn put_length(out: &mut Vec<u8>, length: usize) {
    out.extend_from_slice(&(length as u32).to_le_bytes());
}

/// Every how many points are left of a picture for a slow viewer.
const THINNING: usize = 4;

/// The same picture with a fourth of its points, for a viewer that cannot keep up.
pub(super) fn thinned(picture: &[u8]) -> Option<Vec<u8>> {
    let length = |at: usize| {
        let bytes = picture.get(at..at + 4)?.try_into().ok()?;
        Some(u32::from_le_bytes(bytes) as usize)
    };
    let points_at = 4 + length(0)?;
    let points = length(points_at)?;
    let begin = points_at + 4;
    let (places, rest) = picture.get(begin..)?.split_at_checked(6 * points)?;
    let (kinds, rest) = rest.split_at_checked(points)?;
    let bright_at = begin + 7 * points;
    let (bright, frames) = rest.get(4..)?.split_at_checked(length(bright_at)?)?;
    let mut thin = picture[..points_at].to_vec();
    put_length(&mut thin, points.div_ceil(THINNING));
    for axis in places.chunks(2 * points.max(1)) {
        thin.extend(axis.chunks(2).step_by(THINNING).flatten());
    }
    thin.extend(kinds.iter().step_by(THINNING));
    put_length(&mut thin, bright.len().div_ceil(THINNING));
    thin.extend(bright.iter().step_by(THINNING));
    thin.extend_from_slice(frames);
    Some(thin)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Configuration;
    use crate::pipeline::{Outcome, Pipeline};
    use crate::simulate::{Simulation, scenario};
    use crate::track::Object;
    use crate::view::labels::{FIRST_OBJECT, LOOSE, MARGIN_M};
    use crate::wire::Recording;

    /// The picture of a simulated roundabout after 4 s.
    fn roundabout() -> (Pipeline, f64) {
        let scene = scenario::all()
            .iter()
            .find(|scene| scene.name == "roundabout");
        let mut simulation = Simulation::new(*scene.unwrap(), 1);
        let mut pipeline = Pipeline::new(&Configuration::default(), 0);
        let (mut bytes, mut ground_below_m) = (vec![], 0.0);
        for _ in 0..40 {
            bytes.clear();
            simulation.revolve(&mut bytes);
            for entry in Recording::new(&bytes).flatten() {
                if let Ok(Outcome::Revolution(report)) = pipeline.handle(&entry.envelope) {
                    ground_below_m = report.ground.plane.height_m();
                }
            }
        }
        (pipeline, ground_below_m)
    }

    struct Read {
        heading: serde_json::Value,
        places_m: Vec<[f64; 3]>,
        kinds: Vec<u8>,
        bright: Vec<u8>,
        rest: Vec<u8>,
    }

    fn read(picture: &[u8]) -> Read {
        let length =
            |at: usize| u32::from_le_bytes(picture[at..at + 4].try_into().unwrap()) as usize;
        let (json, points) = (length(0), length(4 + length(0)));
        let begin = 8 + json;
        let bright = begin + 7 * points;
        let bright = bright + 4..bright + 4 + length(bright);
        let centimetres = |axis: usize, point: usize| {
            let at = begin + 2 * (axis * points + point);
            f64::from(i16::from_le_bytes([picture[at], picture[at + 1]]))
        };
        Read {
            heading: serde_json::from_slice(&picture[4..4 + json]).unwrap(),
            places_m: (0..points)
                .map(|point| [0, 1, 2].map(|axis| 0.01 * centimetres(axis, point)))
                .collect(),
            kinds: picture[begin + 6 * points..begin + 7 * points].to_vec(),
            rest: picture[bright.end..].to_vec(),
            bright: picture[bright].to_vec(),
        }
    }

    #[test]
    fn returns_of_an_object_lie_in_its_box_at_the_end_of_the_sweep() {
        let (pipeline, ground_below_m) = roundabout();
        let around = Around::of(&pipeline, ground_below_m);
        let (mut painter, mut bytes) = (Painter::default(), vec![]);
        painter.labels.label(&around, &pipeline);
        painter.paint(&around, &[("cloud", 0.1)], None, &mut bytes);
        assert!(bytes.len() < 200_000, "{}", bytes.len());
        let picture = read(&bytes);
        assert_eq!(picture.kinds.len(), pipeline.scan().returns());
        assert_eq!(picture.heading["steps_ms"][0][0], "cloud");
        let [east, north, _] = around.sensor.position_m;
        let is_within = |object: &Object, [x, y, _]: &[f64; 3]| {
            let (sine, cosine) = libm::sincos(object.yaw_rad);
            let (x, y) = (
                x + east - object.centre_m[0],
                y + north - object.centre_m[1],
            );
            let half_m = |side_m: f64| 0.5 * side_m + MARGIN_M + 0.02;
            libm::fabs(x * cosine + y * sine) < half_m(object.length_m)
                && libm::fabs(y * cosine - x * sine) < half_m(object.width_m)
        };
        let mut returns = vec![0; pipeline.objects().len()];
        for (place_m, kind) in picture.places_m.iter().zip(&picture.kinds) {
            if *kind >= FIRST_OBJECT {
                let objects = pipeline.objects();
                let owner = objects.iter().position(|object| is_within(object, place_m));
                let owner = owner.expect("an object where its return lies");
                assert_eq!(
                    objects[owner].class.number(),
                    u32::from(kind - FIRST_OBJECT)
                );
                returns[owner] += 1;
            }
        }
        let moving = pipeline.objects().iter().zip(&returns);
        let moving = moving.filter(|(object, _)| object.measured && object.speed_mps > 3.0);
        assert!(moving.clone().count() > 1);
        for (object, returns) in moving {
            assert!(
                2 * returns > object.points,
                "{returns} of {}",
                object.points
            );
        }
    }

    #[test]
    fn points_of_a_sensors_own_packets_have_a_reflectivity() {
        let scene = scenario::find("roundabout").unwrap();
        let mut simulation = Simulation::in_packets(scene, 1);
        let mut pipeline = Pipeline::new(&Configuration::default(), 0);
        for _ in 0..2 {
            simulation.revolve_in_packets(|packet| {
                if pipeline.take_packet(packet) == Ok(true) {
                    pipeline.perceive_packets(|_| ());
                }
            });
        }
        let around = Around::of(&pipeline, 1.9);
        let (mut painter, mut bytes) = (Painter::default(), vec![]);
        painter.labels.label_none(around.scan);
        painter.paint(&around, &[], None, &mut bytes);
        assert!(bytes.len() < 180_000, "{}", bytes.len());
        let (whole, thin) = (read(&bytes), read(&thinned(&bytes).unwrap()));
        assert_eq!(whole.bright.len(), whole.kinds.len());
        assert!(whole.bright.iter().all(|bright| (1..=100).contains(bright)));
        let fourth: Vec<_> = whole.bright.iter().copied().step_by(4).collect();
        assert_eq!(thin.bright, fourth);
    }

    #[test]
    fn a_slow_viewer_gets_a_fourth_of_the_points_and_all_frames() {
        let (pipeline, ground_below_m) = roundabout();
        let around = Around::of(&pipeline, ground_below_m);
        let (mut painter, mut bytes) = (Painter::default(), vec![]);
        painter.labels.label_none(around.scan);
        painter.paint(&around, &[], None, &mut bytes);
        bytes.extend_from_slice(b"frames");
        let (whole, thin) = (read(&bytes), read(&thinned(&bytes).unwrap()));
        assert_eq!(thin.heading, whole.heading);
        assert_eq!(thin.rest, b"frames");
        let fourth: Vec<_> = whole.places_m.iter().copied().step_by(4).collect();
        assert_eq!(thin.places_m, fourth);
        assert_eq!(thin.kinds, vec![LOOSE; fourth.len()]);
        for cut in [0, 3, 100, bytes.len() - 7] {
            assert!(thinned(&bytes[..cut]).is_none(), "{cut}");
        }
    }
}
