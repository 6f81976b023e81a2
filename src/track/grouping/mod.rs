//! What may be one object: returns in the place of a known one, and clusters that none explains.
//!
//! `owners` says whose each return is, given the patches that are tracks for sure (`mains`); some of
//! what is nobody's are `pieces` of one vehicle.

mod mains;
mod owners;
mod pieces;

use std::ops::Range;

use nalgebra::Vector2;

use super::above::Climber;
use super::appearance::Eye;
use super::claims::Claims;
use super::forecast::Forecasts;
use super::look::Look;
use super::patches::Placer;
use super::road_user::Track;
use super::spots::{Spot, bounds_m};
use super::strays::Strays;
use super::{Scene, TrackParameters};
use crate::cluster::Clusters;
use mains::Mains;

/// The groups of a revolution.
#[derive(Debug, Clone, Default)]
pub(super) struct Grouping {
    placer: Placer,
    strays: Strays,
    spots: Vec<Spot>,
    /// The stretches of which groups are made, and the spots, while they are sorted.
    stretches: Vec<Stretch>,
    sorted: Vec<Spot>,
    groups: Vec<Group>,
    /// The groups before some were joined.
    former: Vec<Group>,
    /// Where the tracks are expected, and which of them may be in a patch.
    forecasts: Forecasts,
    near: Vec<usize>,
    claims: Claims,
    mains: Mains,
    /// Of every track whether it is a patch that stands apart.
    are_apart: Vec<bool>,
    /// The groups that no track claims, and their bounds.
    free: Vec<(usize, [Vector2<f64>; 2])>,
    /// The group that each one joins.
    target: Vec<usize>,
    /// Group numbers of what was cut off structure, ascending.
    suspects: Vec<u32>,
    /// Looks at what may be people, by the points of each.
    eye: Eye,
    points: Vec<u32>,
}

/// Spots side by side that belong to one group.
#[derive(Debug, Clone)]
struct Stretch {
    /// Of the group.
    number: u32,
    spots: Range<usize>,
    /// The group that they were before, if they are all of it.
    former: Option<usize>,
}

/// Returns that may be one object: a stretch of the spots.
#[derive(Debug, Clone, Copy)]
pub(super) struct Group {
    number: u32,
    begin: usize,
    end: usize,
    pub(super) look: Look,
    /// The track in whose place they were found; a new object comes of none, but for what is too
    /// large for that track.
    pub(super) claimed_by: Option<usize>,
}

/// Fewer returns are noise.
const FEWEST_RETURNS: usize = 3;

impl Grouping {
    /// Forms the groups anew, given tracks that were carried on to this revolution.
    pub(super) fn form(
        &mut self,
        tracks: &[Track],
        clusters: &Clusters,
        climber: &mut Climber,
        scene: &Scene<'_>,
        parameters: &TrackParameters,
    ) {
        let origin_m = Vector2::from(scene.sweep.sensor.placement().origin_m());
        self.forecasts.take(tracks, origin_m, scene);
        self.placer
            .place(clusters, climber, &mut self.forecasts, scene, parameters);
        self.divide(tracks, scene, parameters);
        self.strays
            .add(tracks, climber.members(), scene, &mut self.spots);
        self.gather(tracks, scene);
        self.join_pieces(tracks, scene);
    }

    pub(super) fn groups(&self) -> &[Group] {
        &self.groups
    }

    /// The returns of a group.
    pub(super) fn spots(&self, group: &Group) -> &[Spot] {
        &self.spots[group.begin..group.end]
    }

    /// Whether a group was cut off structure.
    pub(super) fn is_suspect(&self, group: &Group) -> bool {
        self.suspects.binary_search(&group.number).is_ok()
    }

    /// Puts the spots of every group side by side and looks at it.
    fn gather(&mut self, tracks: &[Track], scene: &Scene<'_>) {
        self.stretches.clear();
        let mut end = 0;
        for spots in self.spots.chunk_by(|a, b| a.group == b.group) {
            let begin = end;
            end += spots.len();
            self.stretches.push(Stretch {
                number: spots[0].group,
                spots: begin..end,
                former: None,
            });
        }
        self.put_together(tracks, scene);
    }

    /// Makes one of the groups that have the same target.
    fn gather_joined(&mut self, tracks: &[Track], scene: &Scene<'_>) {
        std::mem::swap(&mut self.groups, &mut self.former);
        self.stretches.clear();
        for (place, target) in self.target.iter().enumerate() {
            let group = &self.former[place];
            self.stretches.push(Stretch {
                number: self.former[*target].number,
                spots: group.begin..group.end,
                former: Some(place),
            });
        }
        self.put_together(tracks, scene);
    }

    /// Forms groups of stretches that have the same number, and looks at those that are new.
    fn put_together(&mut self, tracks: &[Track], scene: &Scene<'_>) {
        let sensor_m = Vector2::from(scene.sweep.sensor.placement().origin_m());
        self.groups.clear();
        self.sorted.clear();
        self.stretches
            .sort_unstable_by_key(|stretch| (stretch.number, stretch.spots.start));
        for own in self.stretches.chunk_by(|a, b| a.number == b.number) {
            let number = own[0].number;
            let begin = self.sorted.len();
            for stretch in own {
                let spots = &self.spots[stretch.spots.clone()];
                self.sorted.extend_from_slice(spots);
            }
            let spots = &self.sorted[begin..];
            let claimed_by = Some(number as usize).filter(|number| *number < tracks.len());
            if spots.len() < FEWEST_RETURNS && claimed_by.is_none() {
                continue;
            }
            let look = match own {
                [
                    Stretch {
                        former: Some(place),
                        ..
                    },
                ] => self.former[*place].look,
                _ => Look {
                    is_apart: self.are_apart.get(number as usize) == Some(&true),
                    person_log: person_log(&mut self.eye, &mut self.points, spots, scene),
                    ..Look::at(spots, scene.scan, sensor_m)
                },
            };
            self.groups.push(Group {
                number,
                begin,
                end: self.sorted.len(),
                look,
                claimed_by,
            });
        }
        std::mem::swap(&mut self.spots, &mut self.sorted);
    }
}

/// How much likelier what is as near and as small as the people of `scripts/fit-appearance` is one of them than anything
/// else.
fn person_log(
    eye: &mut Eye,
    points: &mut Vec<u32>,
    spots: &[Spot],
    scene: &Scene<'_>,
) -> Option<f64> {
    const FARTHEST_M: f32 = 30.0;
    const LONGEST_M: f32 = 1.8;
    let [low_m, high_m] = bounds_m(spots.iter());
    let length_m = |[x, y]: [f32; 2]| libm::hypotf(x, y);
    let diagonal_m = length_m([0, 1].map(|axis| high_m[axis] - low_m[axis]));
    let range_m = length_m([0, 1].map(|axis| 0.5 * (low_m[axis] + high_m[axis])));
    if diagonal_m > LONGEST_M || range_m > FARTHEST_M {
        return None;
    }
    points.clear();
    points.extend(spots.iter().map(|spot| spot.point));
    points.sort_unstable();
    let appearance = eye.look(points, scene)?;
    Some(appearance.person_log_ratio())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::Scan;
    use crate::cloud::tests::scan_of;
    use crate::track::tests::with_scene;

    /// Spots in columns of one layer, 10 m away, each of a group.
    fn grouping(scan: &Scan, groups: &[(Range<usize>, u32)]) -> Grouping {
        let mut grouping = Grouping::default();
        with_scene(scan, |scene| {
            for (columns, group) in groups {
                for column in columns.clone() {
                    let point = scan.index(column, 7);
                    let [x, y, _] = scan.point_m(point);
                    let spot = Spot::new(scene, point as u32, [x, y], *group);
                    grouping.spots.push(spot);
                }
            }
            grouping.gather(&[], scene);
        });
        grouping
    }

    fn columns(grouping: &Grouping, group: &Group, scan: &Scan) -> Vec<usize> {
        let spots = grouping.spots(group).iter();
        spots.map(|spot| scan.column(spot.point as usize)).collect()
    }

    #[test]
    fn the_spots_of_a_group_are_put_side_by_side_and_too_few_are_none() {
        let scan = scan_of(1800, |_, layer| if layer == 7 { 1000 } else { 0 });
        let groups = [
            (100..102, 5),
            (102..106, 2),
            (106..108, 9),
            (108..112, 5),
            (112..113, 2),
        ];
        let grouping = grouping(&scan, &groups);
        let found: Vec<_> = grouping
            .groups()
            .iter()
            .map(|group| (group.number, columns(&grouping, group, &scan)))
            .collect();
        assert_eq!(
            found,
            [
                (2, vec![102, 103, 104, 105, 112]),
                (5, vec![100, 101, 108, 109, 110, 111])
            ]
        );
    }

    #[test]
    fn only_what_is_as_near_and_as_small_as_people_is_looked_at_as_one_of_them() {
        let looked_at = |columns: Range<usize>, range_cm: u16| {
            let scan = scan_of(1800, |_, layer| if layer == 7 { range_cm } else { 0 });
            let grouping = grouping(&scan, &[(columns, 3)]);
            grouping.groups()[0].look.person_log.is_some()
        };
        assert!(looked_at(100..116, 1000));
        assert!(!looked_at(100..170, 1000), "too wide");
        assert!(!looked_at(100..106, 3500), "too far");
        assert!(!looked_at(100..104, 1000), "too few");
    }

    #[test]
    fn pieces_of_a_vehicle_become_one_group_that_is_looked_at_anew() {
        let scan = scan_of(1800, |_, layer| if layer == 7 { 1000 } else { 0 });
        // 10 m away a column is 0.035 m wide: pieces of 1.4 m and 0.7 m, 0.35 m apart.
        let groups = [(100..140, 3), (150..170, 4), (300..340, 8)];
        let mut grouping = grouping(&scan, &groups);
        let far = grouping.groups()[2].look.middle_m;
        with_scene(&scan, |scene| grouping.join_pieces(&[], scene));
        let [vehicle, other] = grouping.groups() else {
            panic!("{:?}", grouping.groups());
        };
        let expected: Vec<usize> = (100..140).chain(150..170).collect();
        assert_eq!(columns(&grouping, vehicle, &scan), expected);
        assert_eq!((vehicle.number, vehicle.look.points), (3, 60));
        let sum_m = grouping.spots(vehicle).iter().fold([0.0; 2], |sum, spot| {
            [0, 1].map(|axis| sum[axis] + f64::from(spot.at_m[axis]))
        });
        assert!((vehicle.look.middle_m - Vector2::from(sum_m) / 60.0).norm() < 1e-6);
        assert_eq!((other.number, other.look.middle_m), (8, far));
    }
}
