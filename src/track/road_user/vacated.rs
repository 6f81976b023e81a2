//! Whether the place is empty in which something was before: what moves leaves nothing behind.
//!
//! That is the other half of [`super::newness`] (Yoon et al. 2019), and tells of who walks in a row or comes from where
//! nobody looked. Another piece of a wall or a hedge leaves the one that was seen before standing.

use nalgebra::Vector2;

use super::Track;
use crate::geometry::Rectangle;
use crate::time::Span;
use crate::track::sight::Sight;

/// What is longer shows another part of itself from every side, and is asked for places that it left farther behind. At 2.5 m
/// there are three quarters more false movers in a yard where nothing moves, and no more people are found. This and the other
/// numbers here were set by hand on seeds 611 to 616 of strangers and furniture, and on the recordings of that yard.
const LONGEST_M: f64 = 1.3;
/// How far beyond its own length a place must lie to be another one.
const BESIDE_M: f64 = 0.3;
/// A sensor may see nothing where something was: the last places are asked for, step by step.
const STEP_S: f64 = 0.3;
const STEPS: u32 = 6;
/// The least size of what is met once.
const SMALLEST_M: f64 = 0.3;
/// Share of a revolution in what is known, share of it that is left where nothing can be asked, and the share of empty
/// places from which on it has left them.
const FRESH: f64 = 0.3;
const LASTING: f64 = 0.9;
const MOST_LEFT: f64 = 0.6;

/// How much farther than its own length what is long must have gone: the middle of a box that grows is not where it was
/// thought to be. Without, in slow columns 28 instead of 72 % of lorries are listed, and 95 instead of 99 % of cars, most of
/// them as if they stood (`overgrown`, seeds 61 to 68).
const FAR_M: f64 = 2.5;
/// How near it must be, and look like a vehicle: behind the sensor another part of what stands is seen at every look.
const CLEAR_RANGE_M: f64 = 25.0;

/// How empty the places were that something left.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Vacated {
    share: f64,
    footprints: Footprints,
}

/// Where something was, one place for each step of its way.
#[derive(Debug, Clone, Copy, Default)]
struct Footprints {
    places_m: [Vector2<f64>; Footprints::LONGEST],
    /// How many there ever were.
    count: usize,
}

impl Footprints {
    const LONGEST: usize = 24;
    const STEP_M: f64 = 1.0;

    fn push(&mut self, at_m: Vector2<f64>) {
        let last = self.latest().next();
        if last.is_none_or(|last| (at_m - last).norm() > Self::STEP_M) {
            self.places_m[self.count % Self::LONGEST] = at_m;
            self.count += 1;
        }
    }

    /// The places, the last one first.
    fn latest(&self) -> impl Iterator<Item = Vector2<f64>> {
        let numbers = (self.count.saturating_sub(Self::LONGEST)..self.count).rev();
        numbers.map(|number| self.places_m[number % Self::LONGEST])
    }
}

impl Vacated {
    /// Whether it has left the places where it was.
    pub(super) fn is_sure(&self) -> bool {
        self.share > MOST_LEFT
    }

    /// The places where it was are in another frame.
    pub(super) fn reframe(&mut self) {
        self.footprints = Footprints::default();
    }

    fn learn(&mut self, sight: Option<Sight>) {
        match sight {
            Some(sight) if sight.is_observable() => {
                self.share += FRESH * (f64::from(sight.is_empty()) - self.share);
            }
            Some(_) | None => self.share *= LASTING,
        }
    }
}

impl Track {
    /// Asks for the last place in which it was, of what seems to go.
    pub(in crate::track) fn look_back(&mut self, sight: impl Fn(&Rectangle, f64) -> Sight) {
        let here_m = self.motion.position_m();
        self.newness.vacated.footprints.push(here_m);
        let place = self.left_place();
        let height_m = self.height_m();
        self.newness
            .vacated
            .learn(place.map(|place| sight(&place, height_m)));
    }

    fn left_place(&self) -> Option<Rectangle> {
        let [length_m, width_m] = self.shape.seen_m;
        let longest_m = length_m.max(width_m);
        let is_long = longest_m > LONGEST_M;
        let is_vehicle = self.looks_like_vehicle && self.range_m < CLEAR_RANGE_M;
        if !self.goes() || (is_long && !is_vehicle) {
            return None;
        }
        let here_m = self.motion.position_m();
        let is_beyond = |by_m: f64| move |at_m: &Vector2<f64>| (at_m - here_m).norm() > by_m;
        let place_m = if is_long {
            let mut places = self.newness.vacated.footprints.latest();
            places.find(is_beyond(longest_m + FAR_M))
        } else {
            let mut places = (1..=STEPS).filter_map(|step| {
                let before = Span::from_seconds(-STEP_S * f64::from(step));
                self.trace.at(self.time() + before)
            });
            places.find(is_beyond(longest_m + BESIDE_M))
        };
        place_m.map(|at_m| Rectangle {
            centre_m: at_m.into(),
            yaw_rad: self.shape.yaw_rad,
            length_m: length_m.max(SMALLEST_M),
            width_m: width_m.max(SMALLEST_M),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::tests::{later, scan_of};
    use crate::ego::Pose;
    use crate::track::look::Look;
    use crate::track::tests::spots_of;

    /// Somebody 10 m away who goes 0.14 m in each revolution, before what lies behind in every column.
    fn after(revolutions: usize, behind_cm: impl Fn(usize) -> u16) -> Track {
        let mut outline = vec![];
        let mut known: Option<Track> = None;
        for revolution in 0..revolutions {
            let first = 100 + 4 * revolution;
            let own = first..first + 14;
            let scan = scan_of(1800, |column, layer| match layer {
                3..9 if own.contains(&column) => 1000,
                0..12 => behind_cm(column),
                _ => 0,
            });
            let scan = later(&scan, 0.1 * revolution as f64);
            let mut spots = spots_of(&scan);
            spots.retain(|spot| {
                let point = spot.point as usize;
                own.contains(&scan.column(point)) && (3..9).contains(&scan.layer(point))
            });
            let (look, end) = (Look::at(&spots, &scan, Vector2::zeros()), scan.time());
            match &mut known {
                Some(track) => track.measure(&spots, &look, end, 0.0, &mut outline),
                None => known = Some(Track::new(0, false, &spots, &look, end, 0.0, &mut outline)),
            }
            if let Some(track) = &mut known {
                track.look_back(|place, height_m| {
                    Sight::at(&scan, &Pose::SENSOR.placement(), 1.8, place, height_m)
                });
            }
        }
        known.expect("at least one revolution")
    }

    #[test]
    fn who_walks_leaves_an_empty_place_and_what_is_seen_of_a_wall_leaves_the_wall() {
        assert!(after(25, |_| 3000).newness.vacated.is_sure());
        assert!(after(25, |_| 0).newness.vacated.is_sure());
        let wall = after(25, |_| 1000);
        assert!(wall.goes() && !wall.newness.vacated.is_sure());
    }

    /// The rear of a car 10 m ahead that drives on at 2 m/s, so that its end is never seen, and what is behind it.
    fn ahead(revolutions: usize, looks_like_vehicle: bool) -> Track {
        let mut outline = vec![];
        let mut known: Option<Track> = None;
        for revolution in 0..revolutions {
            let own_cm = 1000 + 20 * revolution as u16;
            let is_own = |column: usize| !(20..1780).contains(&column);
            let scan = scan_of(1800, |column, layer| match layer {
                3..9 if is_own(column) => own_cm,
                0..12 => 9000,
                _ => 0,
            });
            let scan = later(&scan, 0.1 * revolution as f64);
            let mut spots = spots_of(&scan);
            spots.retain(|spot| {
                let point = spot.point as usize;
                is_own(scan.column(point)) && (3..9).contains(&scan.layer(point))
            });
            let (look, end) = (Look::at(&spots, &scan, Vector2::zeros()), scan.time());
            let track = known
                .get_or_insert_with(|| Track::new(0, false, &spots, &look, end, 0.0, &mut outline));
            if revolution > 0 {
                track.measure(&spots, &look, end, 0.0, &mut outline);
            }
            track.looks_like_vehicle = looks_like_vehicle;
            track.look_back(|place, height_m| {
                Sight::at(&scan, &Pose::SENSOR.placement(), 1.8, place, height_m)
            });
        }
        known.expect("at least one revolution")
    }

    #[test]
    fn a_vehicle_that_drives_on_leaves_an_empty_place_and_of_anything_else_so_long_nobody_knows() {
        assert!(ahead(40, true).newness.vacated.is_sure());
        assert!(!ahead(40, false).newness.vacated.is_sure());
        assert!(!ahead(8, true).newness.vacated.is_sure());
    }

    #[test]
    fn nothing_is_known_of_a_place_that_something_hides() {
        let hidden = after(25, |column| if column < 200 { 500 } else { 3000 });
        assert!(!hidden.newness.vacated.is_sure());
    }

    #[test]
    fn what_has_only_begun_to_go_has_left_nothing() {
        assert!(!after(4, |_| 3000).newness.vacated.is_sure());
    }
}
