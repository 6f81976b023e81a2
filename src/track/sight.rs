//! Hidden or gone: what the rays say about a place where an object is expected.

use crate::cloud::{MAX_LAYERS, Scan};
use crate::ego::Placement;
use crate::geometry::Rectangle;

/// Rays that should have met an object.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Sight {
    /// All of them.
    pub(super) rays: f64,
    /// Those that ended before it.
    pub(super) blocked: f64,
    /// Those that passed through its place.
    pub(super) passed: f64,
}

/// Part of an object's height, from the ground and from its top, that rays may miss.
const BELOW_M: f64 = 0.3;
const ABOVE_M: f64 = 0.2;
/// Above bonnets and handlebars only the middle of the length is certainly filled.
const BELT_M: f64 = 0.9;
const CABIN: f64 = 0.4;
/// Distance by which a ray must end before or behind the box to count.
const MARGIN_M: f64 = 0.4;
/// A ray that nothing came back from has most likely passed.
const NO_RETURN: f64 = 0.7;
/// Columns that are looked at: more say nothing new.
const MOST_COLUMNS: usize = 20;

impl Sight {
    /// Looks at where a box of some height stands, in a sensor frame `sensor_height_m` above
    /// the ground.
    pub(super) fn at(
        scan: &Scan,
        placement: &Placement,
        sensor_height_m: f64,
        place: &Rectangle,
        height_m: f64,
    ) -> Self {
        let mut sight = Self::default();
        let outline = |place: &Rectangle| place.corners().map(|corner| placement.sensor_m(corner));
        let corners = outline(place);
        let cabin = outline(&Rectangle {
            length_m: CABIN * place.length_m,
            ..*place
        });
        let Some((first, count)) = scan.columns_across(&corners) else {
            return sight;
        };
        let stride = count.div_ceil(MOST_COLUMNS).max(1);
        for step in (0..count).step_by(stride) {
            let column = scan.over_seam(first + step);
            let direction = scan.direction(column).map(f64::from);
            let Some(below_belt) = crossing(&corners, direction) else {
                continue;
            };
            let above_belt = crossing(&cabin, direction);
            for layer in 0..MAX_LAYERS {
                let (tangent, cosine) = scan.slope(layer);
                let above_m = sensor_height_m + below_belt.0 * tangent;
                if above_m < BELOW_M || above_m > height_m - ABOVE_M {
                    continue;
                }
                let crossed = if above_m < BELT_M {
                    Some(below_belt)
                } else {
                    above_belt
                };
                let Some((near_m, far_m)) = crossed else {
                    continue;
                };
                sight.rays += 1.0;
                let point = scan.index(column, layer);
                let range_m = f64::from(scan.range_m()[point]);
                let reached_m = f64::from(scan.reached_m()[point]) * cosine;
                if range_m < 0.0 {
                    sight.blocked += 1.0;
                } else if range_m == 0.0 {
                    sight.passed += NO_RETURN;
                } else if reached_m < near_m - MARGIN_M {
                    sight.blocked += 1.0;
                } else if reached_m > far_m + MARGIN_M {
                    sight.passed += 1.0;
                }
            }
        }
        sight
    }

    /// Whether most of the object cannot be seen.
    pub(super) fn is_hidden(&self) -> bool {
        self.blocked >= 0.55 * self.rays
    }

    /// Whether the sensor would have met it.
    pub(super) fn is_observable(&self) -> bool {
        self.rays - self.blocked >= 3.0
    }

    /// Whether most rays that could have met it went through its place.
    pub(super) fn is_empty(&self) -> bool {
        self.passed >= 0.6 * (self.rays - self.blocked)
    }
}

/// Where a direction from the origin crosses a convex outline.
fn crossing(corners: &[[f64; 2]; 4], [dx, dy]: [f64; 2]) -> Option<(f64, f64)> {
    let (mut near, mut far) = (f64::MAX, f64::MIN);
    for edge in 0..4 {
        let ([ax, ay], [bx, by]) = (corners[edge], corners[(edge + 1) % 4]);
        let side = |x: f64, y: f64| x * dy - y * dx;
        let (a, b) = (side(ax, ay), side(bx, by));
        if (a > 0.0) == (b > 0.0) {
            continue;
        }
        let share = a / (a - b);
        let along = (ax + share * (bx - ax)) * dx + (ay + share * (by - ay)) * dy;
        (near, far) = (near.min(along), far.max(along));
    }
    (far > 0.0 && near < far).then_some((near.max(0.0), far))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::tests::scan_of;
    use crate::ego::Pose;

    const CAR: Rectangle = Rectangle {
        centre_m: [0.0, 12.0],
        yaw_rad: 0.0,
        length_m: 4.0,
        width_m: 2.0,
    };

    fn look(range_cm: u16) -> Sight {
        let scan = scan_of(1800, |_, _| range_cm);
        Sight::at(&scan, &Pose::SENSOR.placement(), 1.8, &CAR, 1.5)
    }

    #[test]
    fn a_wall_before_it_hides_it_and_one_behind_shows_that_it_is_gone() {
        assert!(look(500).is_hidden());
        let behind = look(3000);
        assert!(!behind.is_hidden() && behind.is_empty() && behind.is_observable());
        let open = look(0);
        assert!(!open.is_hidden() && open.is_empty());
        let there = look(1150);
        assert!(!there.is_hidden() && !there.is_empty());
    }
}
