//! Where the lanes of a circle end that only drivers show: by edges of the road, where they are seen, else as is built.

use super::LaneKind;
use super::roundabout::Ring;

/// Radii at which the road round a middle ends, where that is seen.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Edges {
    /// At the island.
    pub inner_m: Option<f64>,
    /// At the kerb around it.
    pub outer_m: Option<f64>,
}

/// One drives so far beside the middle of a lane at most.
const OFF_MIDDLE_M: f64 = 1.2;
/// Narrower lanes are none.
const LEAST_LANE_M: f64 = 3.0;
const MOST_LANES: usize = 3;

/// Lays rings, which are where one drives, out as lanes: as many as fill the road from edge to edge so that all drive in the
/// middle of one.
pub(super) fn lay_out(rings: &mut Vec<Ring>, edges: Edges) {
    let (mut roads, others): (Vec<Ring>, Vec<Ring>) =
        rings.iter().partition(|ring| ring.kind == LaneKind::Road);
    let driven_m: Vec<f64> = roads.iter().map(|ring| ring.circle.radius_m).collect();
    let [Some(&first_m), Some(&last_m)] = [driven_m.first(), driven_m.last()] else {
        return;
    };
    let half_m = match driven_m.len() {
        1 => built_width_m(first_m) / 2.0,
        count => (last_m - first_m) / (count - 1) as f64 / 2.0,
    };
    let built_m = [first_m - half_m, last_m + half_m];
    // The road does not reach over what leads around it.
    let around_m = others
        .iter()
        .map(|ring| ring.circle.radius_m - ring.kind.usual_width_m() / 2.0)
        .filter(|&inner_m| inner_m > last_m)
        .fold(f64::INFINITY, f64::min);
    let outer_m = edges.outer_m.filter(|&outer_m| outer_m < around_m);
    let [inner_m, outer_m] = [
        edges.inner_m.unwrap_or(built_m[0]),
        outer_m.unwrap_or(built_m[1]),
    ];
    // What else steps up there is no edge of this road: one of both, or either.
    let roads_m = [
        [inner_m, outer_m],
        [inner_m, built_m[1]],
        [built_m[0], outer_m],
    ];
    let lanes_m = roads_m.into_iter().find_map(|road_m| {
        (driven_m.len()..=MOST_LANES).find_map(|count| lanes_m(&driven_m, road_m, count))
    });
    let lanes_m = lanes_m.unwrap_or_else(|| between(&driven_m, built_m));
    let ring = roads[0];
    roads = lanes_m
        .iter()
        .map(|[inner_m, outer_m]| {
            let mut lane = ring;
            lane.circle.radius_m = (inner_m + outer_m) / 2.0;
            lane.width_m = outer_m - inner_m;
            lane
        })
        .collect();
    rings.clear();
    rings.append(&mut roads);
    rings.extend(others.into_iter().map(|ring| Ring {
        width_m: ring.kind.usual_width_m(),
        ..ring
    }));
    rings.sort_by(|a, b| a.circle.radius_m.total_cmp(&b.circle.radius_m));
}

/// A road in so many lanes, if whoever drives there drives in the middle of one that is wide enough, each in another.
fn lanes_m(driven_m: &[f64], [inner_m, outer_m]: [f64; 2], count: usize) -> Option<Vec<[f64; 2]>> {
    let width_m = (outer_m - inner_m) / count as f64;
    if width_m < LEAST_LANE_M {
        return None;
    }
    let edge_m = |number: usize| inner_m + width_m * number as f64;
    let lane_of = |driven_m: f64| {
        let number = ((driven_m - inner_m) / width_m).clamp(0.0, count as f64 - 1.0) as usize;
        let off_m = driven_m - edge_m(number) - width_m / 2.0;
        (off_m.abs() < OFF_MIDDLE_M).then_some(number)
    };
    let numbers = driven_m.iter().map(|&driven_m| lane_of(driven_m));
    let numbers: Vec<usize> = numbers.collect::<Option<_>>()?;
    if numbers.windows(2).any(|pair| pair[0] == pair[1]) {
        return None;
    }
    Some(if numbers.len() == count {
        between(driven_m, [inner_m, outer_m])
    } else {
        (0..count)
            .map(|number| [edge_m(number), edge_m(number + 1)])
            .collect()
    })
}

/// Lanes beside each other meet half way between those who drive in them.
fn between(driven_m: &[f64], [inner_m, outer_m]: [f64; 2]) -> Vec<[f64; 2]> {
    let meet_m = driven_m.windows(2).map(|pair| (pair[0] + pair[1]) / 2.0);
    let edges_m: Vec<f64> = [inner_m]
        .into_iter()
        .chain(meet_m)
        .chain([outer_m])
        .collect();
    edges_m.windows(2).map(|pair| [pair[0], pair[1]]).collect()
}

/// Width of a circular path of one lane by the radius of its middle. A mini roundabout's is 4 to 6 m wide; a small one's
/// 9 m where its outer diameter is 26 m, 8 at 30, 7 at 35, 6.5 from 40 m on (FGSV 2006, "Merkblatt fuer die Anlage von
/// Kreisverkehren").
fn built_width_m(radius_m: f64) -> f64 {
    /// Outer diameter and width.
    const BUILT_M: [[f64; 2]; 6] = [
        [13.0, 4.0],
        [22.0, 6.0],
        [26.0, 9.0],
        [30.0, 8.0],
        [35.0, 7.0],
        [40.0, 6.5],
    ];
    let middle_m = |[diameter_m, width_m]: [f64; 2]| (diameter_m - width_m) / 2.0;
    let mut pairs = BUILT_M.windows(2);
    let between =
        pairs.rfind(|pair| middle_m(pair[0]) <= radius_m && radius_m <= middle_m(pair[1]));
    match between {
        Some(pair) => {
            let [low_m, high_m] = [middle_m(pair[0]), middle_m(pair[1])];
            let share = (radius_m - low_m) / (high_m - low_m).max(1e-9);
            pair[0][1] + share * (pair[1][1] - pair[0][1])
        }
        None if radius_m < middle_m(BUILT_M[0]) => BUILT_M[0][1],
        None => BUILT_M[BUILT_M.len() - 1][1],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::roadmap::Circle;

    fn ring(radius_m: f64, kind: LaneKind) -> Ring {
        Ring {
            circle: Circle {
                centre_m: [0.0; 2],
                radius_m,
            },
            width_m: 0.0,
            kind,
            is_marked: false,
        }
    }

    fn laid_out(driven_m: &[f64], inner_m: Option<f64>, outer_m: Option<f64>) -> Vec<[f64; 2]> {
        let rings = driven_m
            .iter()
            .map(|&radius_m| ring(radius_m, LaneKind::Road));
        let mut rings = rings.collect();
        lay_out(&mut rings, Edges { inner_m, outer_m });
        let lanes = rings.iter().map(|ring| [ring.inner_m(), ring.outer_m()]);
        lanes
            .map(|lane| lane.map(|m| libm::round(10.0 * m) / 10.0))
            .collect()
    }

    #[test]
    fn a_road_whose_edges_are_seen_reaches_from_one_to_the_other() {
        assert_eq!(laid_out(&[11.0], Some(7.0), Some(15.0)), [[7.0, 15.0]]);
        // One keeps beside the middle of a mini roundabout.
        assert_eq!(laid_out(&[6.8], Some(3.2), Some(9.0)), [[3.2, 9.0]]);
        let two = [[13.0, 17.0], [17.0, 21.0]];
        assert_eq!(laid_out(&[15.0, 19.0], Some(13.0), Some(21.0)), two);
    }

    #[test]
    fn a_kerb_beyond_the_bikeway_is_no_edge_of_the_road() {
        let outer_m = |edge_m: f64| {
            let mut rings = vec![ring(11.0, LaneKind::Road), ring(16.7, LaneKind::Bikeway)];
            let edges = Edges {
                inner_m: Some(7.2),
                outer_m: Some(edge_m),
            };
            lay_out(&mut rings, edges);
            rings[0].outer_m()
        };
        assert!((outer_m(14.8) - 14.8).abs() < 1e-9);
        assert!((outer_m(16.5) - 15.0).abs() < 0.3, "{}", outer_m(16.5));
    }

    #[test]
    fn a_lane_that_nobody_uses_is_where_there_is_room_for_it() {
        let two = [[13.0, 17.0], [17.0, 21.0]];
        assert_eq!(laid_out(&[15.0], Some(13.0), Some(21.0)), two);
        assert_eq!(laid_out(&[19.0], Some(13.0), Some(21.0)), two);
    }

    #[test]
    fn where_no_edge_is_seen_lanes_are_as_built() {
        assert_eq!(laid_out(&[11.0], None, None), [[7.0, 15.0]]);
        assert_eq!(
            laid_out(&[15.0, 19.0], None, None),
            [[13.0, 17.0], [17.0, 21.0]]
        );
    }

    #[test]
    fn what_steps_up_far_from_the_road_is_no_edge_of_it() {
        assert_eq!(laid_out(&[11.0], None, Some(40.0)), [[7.0, 15.0]]);
        assert_eq!(laid_out(&[11.0], Some(7.5), Some(40.0)), [[7.5, 15.0]]);
    }

    #[test]
    fn widths_are_as_built() {
        for (radius_m, width_m) in [(3.0, 4.0), (8.0, 6.0), (8.5, 9.0), (11.0, 8.0), (30.0, 6.5)] {
            assert!(
                (built_width_m(radius_m) - width_m).abs() < 1e-9,
                "{radius_m}"
            );
        }
    }
}
