//! Whether the place is empty in which something was before: what moves leaves nothing behind.
//!
//! That is the other half of [`super::newness`] (Yoon et al. 2019), and tells of who walks in a row or comes from where
//! nobody looked. Another piece of a wall or a hedge leaves the one that was seen before standing.

use nalgebra::Vector2;

use super::Track;
use crate::geometry::Rectangle;
use crate::time::Span;
use crate::track::sight::Sight;

/// What is longer shows another part of itself from every side: at 2.5 m there are three quarters more false movers in a yard
/// where nothing moves, and no more people are found. This and the other numbers here were set by hand on seeds 611 to 616 of
/// strangers and furniture, and on the recordings of that yard.
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

/// How empty the places were that something left.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Vacated {
    share: f64,
}

impl Vacated {
    /// Whether it has left the places where it was.
    pub(super) fn is_sure(&self) -> bool {
        self.share > MOST_LEFT
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
    /// Asks for the last place in which it was, of what is small and seems to go.
    pub(in crate::track) fn look_back(&mut self, sight: impl Fn(&Rectangle, f64) -> Sight) {
        let place = self.left_place();
        let height_m = self.height_m();
        self.newness
            .vacated
            .learn(place.map(|place| sight(&place, height_m)));
    }

    fn left_place(&self) -> Option<Rectangle> {
        let [length_m, width_m] = self.shape.seen_m;
        let longest_m = length_m.max(width_m);
        if longest_m > LONGEST_M || !self.goes() {
            return None;
        }
        let here_m = self.motion.position_m();
        let places = (1..=STEPS).filter_map(|step| {
            let before = Span::from_seconds(-STEP_S * f64::from(step));
            self.trace.at(self.time() + before)
        });
        let is_beside = |at_m: &Vector2<f64>| (at_m - here_m).norm() > longest_m + BESIDE_M;
        let mut beside = places.filter(is_beside);
        beside.next().map(|at_m| Rectangle {
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
