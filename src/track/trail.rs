//! The way that something went lately, and whether it is one.

use nalgebra::Vector2;

use super::look::Look;

/// The last places of something.
#[derive(Debug, Clone, Copy, Default)]
struct Trail {
    places_m: [Vector2<f64>; Trail::LONGEST],
    count: usize,
}

impl Trail {
    const LONGEST: usize = 10;

    fn push(&mut self, place_m: Vector2<f64>) {
        if self.count == Self::LONGEST {
            self.places_m.rotate_left(1);
            self.count -= 1;
        }
        self.places_m[self.count] = place_m;
        self.count += 1;
    }

    fn reframe(&mut self, moved: impl Fn([f64; 2]) -> [f64; 2]) {
        for place_m in &mut self.places_m[..self.count] {
            *place_m = Vector2::from(moved((*place_m).into()));
        }
    }

    /// Whether the places lie one after the other on a way, of something so long.
    fn shows_motion(&self, length_m: f64) -> bool {
        const FEWEST: usize = 4;
        /// Share of the way that is left from end to end.
        const STRAIGHT: f64 = 0.75;
        const LEAST_M: f64 = 0.6;
        const LEAST_PER_LENGTH: f64 = 0.12;
        let places_m = &self.places_m[..self.count];
        let (Some(first), Some(last)) = (places_m.first(), places_m.last()) else {
            return false;
        };
        let way_m: f64 = places_m
            .windows(2)
            .map(|two| (two[1] - two[0]).norm())
            .sum();
        let net_m = (last - first).norm();
        places_m.len() >= FEWEST
            && net_m > LEAST_M + LEAST_PER_LENGTH * length_m
            && net_m > STRAIGHT * way_m
    }
}

/// Returns from which on a place tells a motion.
const FEWEST_RETURNS: usize = 4;
/// Looks from one place of a long trail to the next: who walks slowly shows it in four seconds, not in one. Without the
/// long trail 81 instead of 88 % of the strangers that move are listed (`scripts/evaluate --seeds 74-75 --duration 20`).
const LONG_STRIDE: u32 = 4;

/// The ways of a thing's middle and of its two ends, as far as they were seen.
#[derive(Debug, Clone, Copy, Default)]
struct Ways {
    middle_m: Trail,
    ends_m: [Trail; 2],
}

/// The ways of a thing, of the last second and of the last four.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Trails {
    short: Ways,
    long: Ways,
    looks: u32,
}

impl Ways {
    fn push(&mut self, middle_m: Vector2<f64>, look: &Look) {
        if look.is_cut == [false; 2] {
            self.middle_m.push(middle_m);
        }
        for side in [0, 1] {
            if !look.is_cut[side] {
                self.ends_m[side].push(look.ends_m[side]);
            }
        }
    }

    fn reframe(&mut self, moved: impl Fn([f64; 2]) -> [f64; 2] + Copy) {
        self.middle_m.reframe(moved);
        for end_m in &mut self.ends_m {
            end_m.reframe(moved);
        }
    }

    fn shows_motion(&self, length_m: f64, look: &Look) -> bool {
        match look.is_cut {
            [false, false] => self.middle_m.shows_motion(length_m),
            [false, true] => self.ends_m[0].shows_motion(length_m),
            [true, false] => self.ends_m[1].shows_motion(length_m),
            [true, true] => false,
        }
    }
}

impl Trails {
    /// The first place.
    pub(super) fn begin(&mut self, middle_m: Vector2<f64>) {
        self.short.middle_m.push(middle_m);
        self.long.middle_m.push(middle_m);
    }

    /// Goes on with a look. The hidden end of a thing shows the motion of what hides it, and a few
    /// returns from far away come from another part of a thing each time.
    pub(super) fn push(&mut self, middle_m: Vector2<f64>, look: &Look) {
        if look.points < FEWEST_RETURNS {
            return;
        }
        self.short.push(middle_m, look);
        self.looks += 1;
        if self.looks.is_multiple_of(LONG_STRIDE) {
            self.long.push(middle_m, look);
        }
    }

    pub(super) fn reframe(&mut self, moved: impl Fn([f64; 2]) -> [f64; 2] + Copy) {
        self.short.reframe(moved);
        self.long.reframe(moved);
    }

    /// Whether what nothing hides in a look went a way, of something so long.
    pub(super) fn shows_motion(&self, length_m: f64, look: &Look) -> bool {
        self.short.shows_motion(length_m, look) || self.long.shows_motion(length_m, look)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn trail(place_m: impl Fn(f64) -> [f64; 2]) -> Trail {
        let mut trail = Trail::default();
        for step in 0..20 {
            trail.push(Vector2::from(place_m(f64::from(step))));
        }
        trail
    }

    #[test]
    fn a_walk_is_a_way_and_a_change_of_view_is_none() {
        assert!(trail(|step| [0.14 * step, 3.0]).shows_motion(0.5));
        let leaps = trail(|step| if step < 15.0 { [0.0, 3.0] } else { [0.8, 3.0] });
        assert!(!leaps.shows_motion(4.0));
    }

    #[test]
    fn who_walks_slowly_goes_a_way_in_four_seconds_that_does_not_show_in_one() {
        let scan = crate::cloud::tests::scan_of(1800, |column, layer| match column {
            100..110 if (5..9).contains(&layer) => 1000,
            _ => 0,
        });
        let spots = crate::track::tests::spots_of(&scan);
        let look = Look::at(&spots, &scan, Vector2::zeros());
        let mut trails = Trails::default();
        trails.begin(Vector2::new(0.0, 10.0));
        let mut shown = None;
        for step in 1..40 {
            trails.push(Vector2::new(0.05 * f64::from(step), 10.0), &look);
            if trails.shows_motion(0.5, &look) {
                shown.get_or_insert(step);
            }
        }
        assert!(
            shown.is_some_and(|step| (15..25).contains(&step)),
            "{shown:?}"
        );
        assert!(!trails.short.shows_motion(0.5, &look));
    }

    #[test]
    fn scatter_is_no_way() {
        let mut random = Random::new(4);
        let mut trail = Trail::default();
        for _ in 0..200 {
            trail.push(Vector2::new(0.2 * random.normal(), 0.2 * random.normal()));
            assert!(!trail.shows_motion(0.5));
        }
    }
}
