//! What moves over the seam of the sweep.
//!
//! The first columns of a revolution and the last ones lie beside each other, and are a revolution
//! apart: a vehicle straight ahead is seen in two halves, of which one has driven on by metres
//! where the sensor follows it, though both are as far away as each other.

use nalgebra::Vector2;

use super::Scene;
use super::road_user::Track;
use super::spots::Spot;
use crate::cloud::{MAX_LAYERS, Scan};

/// Columns on either side of the seam that are compared.
const BESIDE: usize = 4;
/// What the sensor must advance: less hardly parts two halves.
const LEAST_ADVANCE_M: f32 = 0.3;

/// How much farther away the newer side of a cluster on the seam is than its older side, if it
/// rather drives along with the sensor than stands. The points are in the order of the scan.
pub(super) fn step_m(points: &[u32], scene: &Scene<'_>) -> Option<f32> {
    let scan = scene.scan;
    let column_of = |point: &u32| scan.column(*point as usize);
    let is_older = |point: &&u32| column_of(point) < BESIDE;
    let is_newer = |point: &&u32| column_of(point) + BESIDE >= scan.columns();
    let ends = (points.first()?, points.last()?);
    if !(scan.sensor().sees_all_round() && is_older(&ends.0) && is_newer(&ends.1)) {
        return None;
    }
    let (begin, end) = (scene.placements.first()?, scene.placements.last()?);
    let ahead = Vector2::from(end.turned(scan.direction(0).map(f64::from)));
    let [from_m, to_m] = [begin, end].map(|placement| Vector2::from(placement.origin_m()));
    let advance_m = (to_m - from_m).dot(&ahead) as f32;
    if advance_m < LEAST_ADVANCE_M {
        return None;
    }
    let older = nearest(points.iter().take_while(is_older), scan);
    let newer = nearest(points.iter().rev().take_while(is_newer), scan);
    let (mut steps_m, mut count) = ([0.0; MAX_LAYERS], 0);
    for (older_m, newer_m) in older.into_iter().zip(newer) {
        if let (Some(older_m), Some(newer_m)) = (older_m, newer_m) {
            steps_m[count] = newer_m - older_m;
            count += 1;
        }
    }
    if count == 0 {
        return None;
    }
    let (_, step_m, _) = steps_m[..count].select_nth_unstable_by(count / 2, f32::total_cmp);
    // What stands has come nearer by as much as the sensor advanced.
    (step_m.abs() < (*step_m + advance_m).abs()).then_some(*step_m)
}

/// The range of the first of some points in each layer.
fn nearest<'a>(points: impl Iterator<Item = &'a u32>, scan: &Scan) -> [Option<f32>; MAX_LAYERS] {
    let mut ranges_m = [None; MAX_LAYERS];
    for point in points.map(|point| *point as usize) {
        ranges_m[scan.layer(point)].get_or_insert(scan.range_m()[point]);
    }
    ranges_m
}

/// What moves is seen twice at the seam of the sweep, a revolution apart: brings the older part
/// of a known object, of which spots are in the order of the scan, to the time of the newer.
pub(super) fn align(spots: &mut [Spot], tracks: &[Track], duration_s: f64) {
    let half_s = 0.5 * duration_s as f32;
    let (Some(oldest), Some(newest)) = (spots.first(), spots.last()) else {
        return;
    };
    if oldest.age_s - newest.age_s <= half_s {
        return;
    }
    for spot in spots.iter_mut().filter(|spot| spot.age_s > half_s) {
        if let Some(track) = tracks.get(spot.group as usize) {
            let moved_m = track.velocity_mps() * duration_s;
            for axis in 0..2 {
                spot.at_m[axis] += moved_m[axis] as f32;
            }
            spot.age_s -= duration_s as f32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::tests::scan_of;
    use crate::ego::Pose;
    use crate::track::placing::Placing;
    use crate::track::tests::with_scene;

    /// A face 0.7 m wide straight ahead, of which the older side is so much farther away, its
    /// points, and a sensor that drives on by so many metres meanwhile.
    fn ahead<T>(farther_cm: u16, advance_m: f64, look: impl FnOnce(&[u32], &Scene<'_>) -> T) -> T {
        let scan = scan_of(1800, |column, layer| match column {
            ..10 if (5..8).contains(&layer) => 2000 + farther_cm,
            1790.. if (5..8).contains(&layer) => 2000,
            _ => 0,
        });
        let points: Vec<u32> = (0..scan.len() as u32)
            .filter(|point| scan.has_return(*point as usize))
            .collect();
        with_scene(&scan, |scene| {
            let first = scene.sweep.sensor;
            let placement = |column: usize| {
                let ahead_m = advance_m * column as f64 / 1800.0;
                let (sine, cosine) = libm::sincos(first.yaw_rad);
                let [x, y, z] = first.position_m;
                let position_m = [x + ahead_m * cosine, y + ahead_m * sine, z];
                Pose {
                    position_m,
                    ..first
                }
                .placement()
            };
            let placements: Vec<_> = (0..1800).map(placement).collect();
            let scene = Scene {
                placements: &placements,
                ..*scene
            };
            look(&points, &scene)
        })
    }

    #[test]
    fn what_drives_along_is_as_far_away_on_both_sides_and_what_stands_is_not() {
        assert_eq!(ahead(0, 1.4, step_m), Some(0.0));
        let slower = ahead(40, 1.4, step_m);
        assert!(slower.is_some_and(|step_m| (step_m + 0.4).abs() < 0.01));
        assert_eq!(ahead(140, 1.4, step_m), None);
        assert_eq!(ahead(0, 0.1, step_m), None);
        let one_side = ahead(0, 1.4, |points, scene| step_m(&points[..20], scene));
        assert_eq!(one_side, None);
    }

    #[test]
    fn both_sides_of_what_drives_along_are_placed_beside_each_other() {
        let depth_m = |farther_cm: u16, advance_m: f64| {
            ahead(farther_cm, advance_m, |points, scene| {
                let origin_m = scene.placements[1799].origin_m();
                let mut placing = Placing::default();
                placing.begin(scene, origin_m);
                placing.place(points, scene);
                let brought = placing.iter().filter(|placed| placed.is_brought);
                let bounds = placing.bounds();
                let sides_m = [0, 1].map(|axis| bounds.high_m[axis] - bounds.low_m[axis]);
                (sides_m[0].min(sides_m[1]), brought.count())
            })
        };
        for (farther_cm, advance_m, brought) in [(0, 1.4, 30), (40, 1.4, 30), (140, 1.4, 0)] {
            let (metres, count) = depth_m(farther_cm, advance_m);
            assert!(metres < 0.4, "{farther_cm} {metres}");
            assert_eq!(count, brought);
        }
    }
}
