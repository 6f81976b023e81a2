//! How drivers come to the bend before a roundabout: slower and slower, until they are as fast as one goes round.

use crate::roadmap::Polyline;

/// A bend before somebody.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bend {
    /// Until it begins.
    pub(super) left_m: f64,
    /// As fast as he drives through it.
    pub(super) speed_mps: f64,
}

/// As fast as drivers go round a circle: National Cooperative Highway Research Program, Research Report 1043 (2023),
/// equation 9.4, for lanes that fall outward by 2 %; it gives km/h.
pub(super) fn round_mps(radius_m: f64) -> f64 {
    8.6169 * libm::pow(radius_m, 0.3673) / 3.6
}

/// And as fast as anybody goes round it: on a circle of 11 m with 5.1 m/s^2 across, half of his weight.
pub(super) fn fastest_round_mps(radius_m: f64) -> f64 {
    const FASTER: f64 = 1.3;
    FASTER * round_mps(radius_m)
}

/// As hard as drivers brake on the way in: the same programme's Report 572 (2007), 4.2 ft/s^2.
const BRAKES_MPS2: f64 = 1.3;

impl Bend {
    /// When somebody has gone so far who is so fast now.
    pub(super) fn time_s(&self, way_m: f64, speed_mps: f64) -> f64 {
        if self.left_m <= 0.0 || speed_mps <= self.speed_mps || way_m <= 0.0 {
            return way_m / speed_mps;
        }
        let square = speed_mps * speed_mps;
        let fall = square - self.speed_mps * self.speed_mps;
        let even_m = (self.left_m - fall / (2.0 * BRAKES_MPS2)).max(0.0);
        let braking_m = self.left_m - even_m;
        // Braking evenly he loses the same of the square of his speed on every metre.
        let braked_m = (way_m - even_m).clamp(0.0, braking_m);
        let then_mps = libm::sqrt(square - fall * braked_m / braking_m);
        let bent_m = (way_m - self.left_m).max(0.0);
        way_m.min(even_m) / speed_mps
            + 2.0 * braked_m / (speed_mps + then_mps)
            + bent_m / self.speed_mps
    }

    /// How hard somebody brakes before it who is so fast now.
    pub(super) fn braking_mps2(&self, speed_mps: f64) -> f64 {
        /// Who needs less than this share of it rolls on.
        const BEGINS_SHARE: f64 = 0.5;
        let fall = speed_mps * speed_mps - self.speed_mps * self.speed_mps;
        let needed_mps2 = fall / (2.0 * self.left_m);
        if self.left_m > 0.0 && needed_mps2 >= BEGINS_SHARE * BRAKES_MPS2 {
            needed_mps2.min(BRAKES_MPS2)
        } else {
            0.0
        }
    }

    /// How long so far takes him at least who comes so fast, if nobody drives through the bend faster.
    pub(super) fn soonest_s(&self, way_m: f64, speed_mps: f64) -> f64 {
        if self.left_m > 0.0 {
            self.time_s(way_m, speed_mps)
        } else {
            way_m / self.speed_mps
        }
    }
}

/// Where a way begins to bend before it meets a circle; its end if it does not.
pub(super) fn begin_m(way: &Polyline, radius_m: f64) -> f64 {
    const STEP_M: f64 = 0.5;
    /// Curvature is measured from so far before to so far behind.
    const HALF_M: f64 = 2.0;
    /// Less bent than half of the circle is straight.
    const BENT_SHARE: f64 = 0.5;
    let mut begin_m = way.length_m();
    while begin_m > STEP_M && way.curvature_per_m(begin_m - HALF_M).abs() * radius_m > BENT_SHARE {
        begin_m -= STEP_M;
    }
    begin_m
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drivers_go_round_as_fast_as_the_radius_lets_them() {
        // 20.8 km/h on a circle of 11 m.
        assert!((round_mps(11.0) - 5.78).abs() < 0.01);
        assert!(round_mps(6.5) < round_mps(19.0));
    }

    #[test]
    fn who_comes_fast_slows_down_before_the_bend() {
        let bend = Bend {
            left_m: 20.0,
            speed_mps: 5.0,
        };
        // From 8 to 5 m/s he brakes on 15 m; before them he goes on.
        assert!((bend.time_s(5.0, 8.0) - 0.625).abs() < 1e-9);
        let bent_s = bend.time_s(20.0, 8.0);
        assert!((bent_s - 0.625 - 15.0 / 6.5).abs() < 0.01, "{bent_s}");
        assert!((bend.time_s(25.0, 8.0) - bent_s - 1.0).abs() < 1e-9);
        // Near the bend he brakes harder, and is as fast in it.
        let near = Bend {
            left_m: 6.5,
            ..bend
        };
        assert!((near.time_s(6.5, 8.0) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn who_is_near_the_bend_and_faster_brakes() {
        let bend = |left_m| Bend {
            left_m,
            speed_mps: 5.0,
        };
        // From 8 m/s he has to begin 15 m before it.
        assert_eq!(bend(40.0).braking_mps2(8.0), 0.0);
        assert!((bend(15.0).braking_mps2(8.0) - 1.3).abs() < 1e-6);
        assert_eq!(bend(2.0).braking_mps2(8.0), BRAKES_MPS2);
        assert_eq!(bend(2.0).braking_mps2(4.0), 0.0);
        assert_eq!(bend(0.0).braking_mps2(8.0), 0.0);
    }

    #[test]
    fn who_is_slow_or_in_the_bend_goes_on_as_he_does() {
        let bend = Bend {
            left_m: 20.0,
            speed_mps: 5.0,
        };
        assert_eq!(bend.time_s(40.0, 4.0), 10.0);
        assert_eq!(bend.time_s(-4.0, 8.0), -0.5);
        let past = Bend {
            left_m: 0.0,
            ..bend
        };
        assert_eq!(past.time_s(40.0, 8.0), 5.0);
        // Of whom nothing is known but that he is in it, nobody is faster than the bend lets him.
        assert_eq!(past.soonest_s(40.0, 8.0), 8.0);
        assert_eq!(bend.soonest_s(40.0, 8.0), bend.time_s(40.0, 8.0));
    }

    #[test]
    fn a_way_bends_where_it_leaves_the_straight() {
        let straight = (0..40).map(|m| [f64::from(m), 0.0]);
        let bent = (0..=20).map(|step| {
            let (sine, cosine) = libm::sincos(0.05 * f64::from(step));
            [40.0 + 12.0 * sine, 12.0 * (cosine - 1.0)]
        });
        let way = Polyline::through(straight.clone().chain(bent));
        let found_m = begin_m(&way, 11.0);
        assert!((found_m - 40.0).abs() < 2.0, "{found_m}");
        let way = Polyline::through(straight);
        assert_eq!(begin_m(&way, 11.0), way.length_m());
    }
}
