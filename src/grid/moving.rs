//! Road users that move, for the map to leave them out.

use super::GridParameters;
use super::evidence::Evidence;
use super::map::{Map, TILE_CELLS};
use crate::cloud::{MAX_LAYERS, Scan};
use crate::ego::{Placement, Sweep};
use crate::time::Time;
use crate::track::Object;

/// Time from its first sight within which a road user that moves may have marked the map before
/// it was known to move.
const UNKNOWN_S: f64 = 1.5;
/// How unsure the edges of its box are.
const EDGE_M: f64 = 0.2;

/// Whether a road user is seen to move, without a doubt.
pub(super) fn moves(object: &Object, parameters: &GridParameters) -> bool {
    let least_mps = parameters.moving_mps + object.speed_deviation_mps;
    object.measured && libm::fabs(object.speed_mps) > least_mps
}

/// Marks the obstacles that are returns on a road user that moves. Its box is valid at the end of the
/// sweep; each return is compared with where it was when it was seen.
pub(super) fn mark_returns(
    object: &Object,
    scan: &Scan,
    sweep: &Sweep,
    placements: &[Placement],
    margin_m: f64,
    evidence: &Evidence,
    is_moving: &mut [bool],
) {
    let (sine, cosine) = libm::sincos(object.yaw_rad);
    let velocity_mps = [object.speed_mps * cosine, object.speed_mps * sine];
    let mut way = object.rectangle();
    way.length_m += 2.0 * (margin_m + libm::fabs(object.speed_mps) * scan.duration_s());
    way.width_m += 2.0 * margin_m;
    let placement = sweep.sensor.placement();
    let corners = way.corners().map(|corner| placement.sensor_m(corner));
    let columns = scan.columns();
    let (first, count) = scan.columns_across(&corners).unwrap_or((0, columns));
    let outline = object.rectangle().outline();
    for column in (first..first + count).map(|column| scan.over_seam(column)) {
        let age_s = scan.age_s(column);
        for layer in 0..MAX_LAYERS {
            let point = scan.index(column, layer);
            if evidence.is_obstacle(column, layer) {
                let [x, y, _] = scan.point_m(point).map(f64::from);
                let [x, y] = placements[column].local_m([x, y]);
                let at_end = [x + age_s * velocity_mps[0], y + age_s * velocity_mps[1]];
                is_moving[point] |= outline.distance_m(at_end) <= margin_m;
            }
        }
    }
}

/// Where something moves nothing stands: takes back what was seen in its box, and, as long as it
/// is new, in those before.
pub(super) fn clear_way(object: &Object, now: Time, map: &mut Map, cell_m: f64, revolution: u32) {
    const SIDE: i32 = TILE_CELLS as i32;
    let age_s = (now - object.seen_since).seconds();
    let is_new = age_s < UNKNOWN_S;
    let back_m = if is_new {
        object.speed_mps * age_s
    } else {
        0.0
    };
    let mut way = object.rectangle();
    let (sine, cosine) = libm::sincos(object.yaw_rad);
    way.centre_m[0] -= 0.5 * back_m * cosine;
    way.centre_m[1] -= 0.5 * back_m * sine;
    way.length_m += libm::fabs(back_m) + 2.0 * EDGE_M;
    way.width_m += 2.0 * EDGE_M;
    let outline = way.outline();
    let corners = way.corners();
    let bound = |axis: usize, pick: fn(f64, f64) -> f64| {
        let places = corners.iter().map(|corner| corner[axis] / cell_m);
        libm::floor(places.reduce(pick).unwrap_or(0.0)) as i32
    };
    let cells = [0, 1].map(|axis| (bound(axis, f64::min), bound(axis, f64::max)));
    let [across, along] = cells.map(|(low, high)| low.div_euclid(SIDE)..=high.div_euclid(SIDE));
    for place in along.flat_map(|y| across.clone().map(move |x| [x, y])) {
        let Some(tile) = map.known_mut(place) else {
            continue;
        };
        let corner = place.map(|tile| tile * SIDE);
        let [columns, rows] = [0, 1].map(|axis: usize| {
            let ((low, high), first) = (cells[axis], corner[axis]);
            low.max(first)..=high.min(first + SIDE - 1)
        });
        for y in rows {
            let cell = |x: i32| (y - corner[1]) as usize * TILE_CELLS + (x - corner[0]) as usize;
            let row = &tile.log_odds[cell(*columns.start())..=cell(*columns.end())];
            // Hardly anything was ever seen where something moves.
            if row.iter().all(|log_odds| *log_odds <= 0) {
                continue;
            }
            for x in columns.clone() {
                let middle_m = [x, y].map(|at| (f64::from(at) + 0.5) * cell_m);
                if tile.log_odds[cell(x)] > 0 && outline.distance_m(middle_m) <= 0.0 {
                    tile.set(cell(x), 0, revolution);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Tile;
    use crate::track::Class;

    /// A road user that was seen for the first time.
    fn object(length_m: f64, width_m: f64) -> Object {
        let now = Time::from_micros(1_700_000_000_000_000);
        Object {
            id: 1,
            class: Class::Cyclist,
            class_probability: 0.9,
            measured: true,
            centre_m: [-0.005, -0.005, 0.0],
            yaw_rad: 0.0,
            speed_mps: 5.0,
            yaw_rate_radps: 0.0,
            length_m,
            width_m,
            height_m: 1.5,
            position_deviation_m: [0.1; 2],
            yaw_deviation_rad: 0.1,
            speed_deviation_mps: 0.1,
            existence: 0.9,
            first_seen: now,
            seen_since: now,
            last_measured: now,
            points: 9,
        }
    }

    #[test]
    fn only_what_is_occupied_in_a_box_that_is_turned_is_cleared() {
        const SIDE: i32 = TILE_CELLS as i32;
        let object = Object {
            yaw_rad: 0.5,
            ..object(1.2, 0.4)
        };
        let mut way = object.rectangle();
        way.length_m += 2.0 * EDGE_M;
        way.width_m += 2.0 * EDGE_M;
        let outline = way.outline();
        for [x, y] in (-12..12).flat_map(|y| (-12..12).map(move |x| [x, y])) {
            let mut map = Map::new(8);
            for place in [[-1, -1], [0, -1], [-1, 0], [0, 0]] {
                map.tile_mut(place).log_odds.fill(-900);
            }
            let place = [x, y].map(|at: i32| at.div_euclid(SIDE));
            let [column, row] = [x, y].map(|at: i32| at.rem_euclid(SIDE) as usize);
            let cell = row * TILE_CELLS + column;
            map.tile_mut(place).log_odds[cell] = 900;
            clear_way(&object, object.seen_since, &mut map, 0.1, 3);
            let middle_m = [x, y].map(|at| (f64::from(at) + 0.5) * 0.1);
            let left = if outline.distance_m(middle_m) <= 0.0 {
                0
            } else {
                900
            };
            let log_odds = |tile: &Tile| tile.log_odds().to_vec();
            assert_eq!(
                map.tile(place).map(log_odds).unwrap()[cell],
                left,
                "{x} {y}"
            );
            let others = map.tiles().flat_map(log_odds);
            assert_eq!(others.filter(|log_odds| *log_odds != -900).count(), 1);
        }
    }

    #[test]
    fn a_way_is_cleared_up_to_its_edges_in_all_known_tiles_that_it_meets() {
        const SIDE: i32 = TILE_CELLS as i32;
        let mut map = Map::new(8);
        let places: Vec<_> = (-2..2).flat_map(|y| (-3..3).map(move |x| [x, y])).collect();
        for place in &places {
            // Nothing was seen in the first one that it meets.
            if *place != [-2, -1] {
                map.tile_mut(*place).log_odds.fill(900);
            }
        }
        // With its unsure edges from -6.98 m to 6.97 m, and from -0.98 m to 0.97 m.
        let object = object(13.55, 1.55);
        let now = object.seen_since;
        clear_way(&object, now, &mut map, 0.1, 3);
        assert!(map.tile([-2, -1]).is_none());
        for tile in map.tiles() {
            let [x, y] = tile.place().map(|place| place * SIDE);
            for (cell, log_odds) in tile.log_odds().iter().enumerate() {
                let (x, y) = (x + cell as i32 % SIDE, y + cell as i32 / SIDE);
                let is_met = (-70..70).contains(&x) && (-10..10).contains(&y);
                assert_eq!(*log_odds == 0, is_met, "{x} {y}");
            }
        }
    }
}
