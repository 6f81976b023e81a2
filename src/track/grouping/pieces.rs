//! Pieces of one vehicle that stand apart, because between them nothing of it is met.

use nalgebra::Vector2;

use super::{Group, Grouping, Scene, Track, bounds_m, extent};

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
            if group.claimed_by.is_none() && !group.look.is_one_of_several {
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
        for (number, bounds) in &free {
            if let Some(owner) = self.missing_part(tracks, *number, bounds) {
                target[*number] = owner;
                joined = true;
            }
        }
        (self.free, self.target) = (free, target);
        if joined {
            self.gather_joined(tracks, scene);
        }
    }

    /// The group of a vehicle whose bumper or rear a free group can be: a bonnet that rises
    /// towards the screen leaves a gap between two layers.
    fn missing_part(
        &self,
        tracks: &[Track],
        free: usize,
        [low_m, high_m]: &[Vector2<f64>; 2],
    ) -> Option<usize> {
        /// Between a bumper and the foot of a screen.
        const BONNET_M: f64 = 1.6;
        /// Narrower ones are people.
        const NARROWEST_M: f64 = 0.9;
        let group = &self.groups[free];
        if (high_m - low_m).norm() < NARROWEST_M {
            return None;
        }
        self.groups.iter().position(|other| {
            let Some(track) = other.claimed_by.map(|number| &tracks[number]) else {
                return false;
            };
            let apart_m = (other.look.middle_m - group.look.middle_m).norm();
            if !track.is_moving_vehicle() || apart_m > track.rectangle().length_m {
                return false;
            }
            let axes = |group: &Group| {
                let spots = self.spots(group);
                extent(spots, track.yaw_rad())
            };
            let ([low, high], [other_low, other_high]) = (axes(group), axes(other));
            let size = [
                track.rectangle().length_m + 0.2,
                track.rectangle().width_m + 0.3,
            ];
            let gap_m = (low[0] - other_high[0]).max(other_low[0] - high[0]);
            gap_m < BONNET_M
                && (0..2).all(|axis| {
                    high[axis].max(other_high[axis]) - low[axis].min(other_low[axis]) <= size[axis]
                })
        })
    }

    fn bounds(&self, group: &Group) -> [Vector2<f64>; 2] {
        let corners_m = bounds_m(self.spots(group).iter());
        corners_m.map(|corner_m| Vector2::from(corner_m.map(f64::from)))
    }
}
