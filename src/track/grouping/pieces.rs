//! Pieces of one vehicle that stand apart, because between them nothing of it is met.

use nalgebra::Vector2;

use super::{Group, Grouping, Scene, Track, bounds_m};

/// Two free groups this close may be pieces of one vehicle.
const GAP_M: f64 = 0.45;
const LONGEST_JOINED_M: f64 = 5.4;

impl Grouping {
    /// Joins free groups that stand close together and can be one vehicle.
    pub(super) fn join_pieces(&mut self, tracks: &[Track], scene: &Scene<'_>) {
        let (mut free, mut target) = (
            std::mem::take(&mut self.free),
            std::mem::take(&mut self.target),
        );
        free.clear();
        for (number, group) in self.groups.iter().enumerate() {
            if group.claimed_by.is_none() {
                free.push((number, self.bounds(group)));
            }
        }
        target.clear();
        target.extend(0..self.groups.len());
        let mut joined = false;
        for (place, (a, one)) in free.iter().enumerate() {
            for (b, other) in &free[place + 1..] {
                let gap = (other[0] - one[1]).sup(&(one[0] - other[1]));
                if gap.sup(&Vector2::zeros()).norm() > GAP_M {
                    continue;
                }
                let whole = one[1].sup(&other[1]) - one[0].inf(&other[0]);
                let is_wide = |side: &[Vector2<f64>; 2]| (side[1] - side[0]).norm() > 1.0;
                let one_is_wide = is_wide(one) || is_wide(other);
                if whole.norm() <= LONGEST_JOINED_M && one_is_wide && target[*b] == *b {
                    target[*b] = target[*a];
                    joined = true;
                }
            }
        }
        (self.free, self.target) = (free, target);
        if joined {
            self.gather_joined(tracks, scene);
        }
    }

    fn bounds(&self, group: &Group) -> [Vector2<f64>; 2] {
        let corners_m = bounds_m(self.spots(group).iter());
        corners_m.map(|corner_m| Vector2::from(corner_m.map(f64::from)))
    }
}
