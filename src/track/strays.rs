//! Returns of no cluster in the places of known road users that moved: far away too few meet a cyclist to be
//! a cluster.

use std::ops::Range;

use multiversion::multiversion;

use super::Scene;
use super::road_user::Track;
use super::spots::{Spot, seen_before};
use crate::beams::Hints;
use crate::geometry::Rectangle;
use crate::marks::marked;

/// Finds them. Its buffers are made once.
#[derive(Debug, Clone, Default)]
pub(super) struct Strays {
    /// Of every track whether it is seen otherwise.
    is_seen: Vec<bool>,
    /// Points that are looked at closer.
    marks: Vec<bool>,
}

/// Heights above the ground, and above the object, at which a return of no cluster may be its.
const LOW_M: f64 = 0.25;
const ABOVE_M: f64 = 0.3;
/// Distance from a known box up to which it may be: at least, and if nobody knows where the box is.
const NEAR_M: f64 = 0.4;
const FARTHEST_M: f64 = 1.0;

impl Strays {
    /// Adds them to the spots of tracks that may be no cluster, given which points are `members` of
    /// one.
    pub(super) fn add(
        &mut self,
        tracks: &[Track],
        members: &[bool],
        scene: &Scene<'_>,
        spots: &mut Vec<Spot>,
    ) {
        let Scene { scan, sweep, .. } = *scene;
        let placement = sweep.sensor.placement();
        let origin_m = placement.origin_m();
        self.note_seen(tracks.len(), spots);
        for (number, track) in tracks.iter().enumerate() {
            // Of what stands, strays would show another piece in each revolution, and it would seem to move: for whatever either
            // moved or was likely there are 0.07 instead of 0.02 false movers a revolution in `yard_dev` and `yard_poses_dev`.
            let is_known = track.was_likely && track.has_moved();
            if !is_known || !track.is_confirmed() || !track.is_sparse() {
                continue;
            }
            let place = track.rectangle();
            // Who is seen otherwise is there; of who is not, nobody knows where.
            let (near_m, more_m) = if track.is_hardly_met() && !self.is_seen[number] {
                let near_m = track.spread_m().clamp(NEAR_M, FARTHEST_M);
                (near_m, near_m)
            } else {
                (NEAR_M, 0.0)
            };
            let around = Rectangle {
                length_m: place.length_m + 2.0 * more_m,
                width_m: place.width_m + 2.0 * more_m,
                ..place
            };
            let corners = around.corners().map(|corner| placement.sensor_m(corner));
            let outline = place.outline();
            let heights_m = [LOW_M, track.height_m() + ABOVE_M].map(|metres| metres as f32);
            let mut hints = Hints::default();
            for columns in scan.stretches_across(&corners) {
                let points = scan.points_of(&columns);
                self.mark(scene, members, points.clone(), heights_m);
                for point in marked(&self.marks).map(|place| points.start + place) {
                    let [x, y, _] = scan.point_m(point).map(f64::from);
                    let at_m = scene.placements[scan.column(point)].local_m([x, y]);
                    if outline.distance_m(at_m) < near_m {
                        let (point, group) = (point as u32, number as u32);
                        let offset_m = [0, 1].map(|axis| (at_m[axis] - origin_m[axis]) as f32);
                        spots.push(Spot {
                            before: seen_before(scene, point, offset_m, &mut hints, |_| true),
                            ..Spot::new(scene, point, offset_m, group)
                        });
                    }
                }
            }
        }
    }

    /// Notes which of so many tracks have spots.
    fn note_seen(&mut self, tracks: usize, spots: &[Spot]) {
        self.is_seen.clear();
        self.is_seen.resize(tracks, false);
        for spot in spots {
            // The numbers behind those of tracks are others' groups.
            if let Some(is_seen) = self.is_seen.get_mut(spot.group as usize) {
                *is_seen = true;
            }
        }
    }

    /// Marks the returns of no cluster between two heights.
    fn mark(
        &mut self,
        scene: &Scene<'_>,
        members: &[bool],
        points: Range<usize>,
        heights_m: [f32; 2],
    ) {
        self.marks.clear();
        self.marks.resize(points.len(), false);
        mark_strays(
            &members[points.clone()],
            &scene.scan.range_m()[points.clone()],
            &scene.heights_m[points],
            heights_m,
            &mut self.marks,
        );
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn mark_strays(
    is_member: &[bool],
    ranges_m: &[f32],
    heights_m: &[f32],
    [low_m, high_m]: [f32; 2],
    marks: &mut [bool],
) {
    let count = marks.len();
    let (is_member, ranges_m) = (&is_member[..count], &ranges_m[..count]);
    let heights_m = &heights_m[..count];
    for point in 0..count {
        marks[point] = !is_member[point]
            & (ranges_m[point] > 0.0)
            & (heights_m[point] >= low_m)
            & (heights_m[point] < high_m);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::beams::Seen;
    use crate::cloud::tests::scan_of;
    use crate::track::tests::{followed, spots_of, with_scene};

    #[test]
    fn only_a_known_road_user_that_moved_gets_returns_of_no_cluster() {
        // Two columns of a body 20 m away, which are too few for a cluster.
        let scan = scan_of(1800, |column, layer| match column {
            100..102 if (6..8).contains(&layer) => 2000,
            _ => 0,
        });
        let own = spots_of(&scan);
        let (mut track, _) = followed(std::iter::repeat_n(&scan, 6));
        assert!(track.is_confirmed() && track.is_sparse() && !track.has_moved());
        let strays = |track: &Track| {
            let (mut strays, mut spots) = (Strays::default(), vec![]);
            let members = vec![false; scan.len()];
            with_scene(&scan, |scene| {
                strays.add(std::slice::from_ref(track), &members, scene, &mut spots);
            });
            spots.len()
        };
        assert_eq!(strays(&track), 0);
        track.was_likely = true;
        assert_eq!(strays(&track), 0);
        track.moves_for_tests();
        assert_eq!(strays(&track), own.len());
    }

    #[test]
    fn a_track_is_seen_if_it_has_spots_of_this_revolution() {
        let spot = |group| Spot {
            at_m: [0.0; 2],
            above_m: 0.0,
            age_s: 0.0,
            returns: 1.0,
            point: 0,
            group,
            before: Seen::Unknown,
        };
        let mut strays = Strays::default();
        strays.note_seen(3, &[spot(1), spot(7)]);
        assert_eq!(strays.is_seen, [false, true, false]);
        strays.note_seen(3, &[]);
        assert_eq!(strays.is_seen, [false; 3]);
    }
}
