use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::curve::Vertex;
use super::*;

fn id(road: u32, lane: u32) -> LaneId {
    LaneId {
        layer: 1,
        road,
        lane,
    }
}

fn lane(id: LaneId, points_m: impl IntoIterator<Item = [f64; 2]>) -> Lane {
    let vertices = (1..).zip(points_m);
    Lane {
        id,
        road_name: String::new(),
        kind: LaneKind::Road,
        width_m: Some(4.0),
        left_marking: None,
        right_marking: None,
        curve: Curve::Points(
            vertices
                .map(|(id, place_m)| Vertex { id, place_m })
                .collect(),
        ),
        is_circular: false,
    }
}

fn arc(radius_m: f64, from_rad: f64, sweep_rad: f64) -> impl Iterator<Item = [f64; 2]> {
    let steps = 40;
    (0..=steps).map(move |step| {
        let angle_rad = from_rad + sweep_rad * f64::from(step) / f64::from(steps);
        [radius_m * angle_rad.cos(), radius_m * angle_rad.sin()]
    })
}

fn leads(from: LaneId, to: LaneId) -> Connector {
    let [from, to] = [from, to].map(|lane| PointId { lane, point: 1 });
    Connector { from, to }
}

/// A circle of two halves about the origin, and an arm in the south: in to the east of its
/// middle, out to the west.
fn circle_and_arm(radius_m: f64) -> Roadmap {
    let [east, west, entry, exit] = [id(1, 1), id(1, 2), id(2, 1), id(2, 2)];
    let out_m = radius_m + 4.0;
    Roadmap {
        lanes: vec![
            lane(east, arc(radius_m, -FRAC_PI_2, PI)),
            lane(west, arc(radius_m, FRAC_PI_2, PI)),
            lane(entry, [[4.0, -80.0], [4.0, -out_m]]),
            lane(exit, [[-4.0, -out_m], [-4.0, -80.0]]),
        ],
        connectors: vec![
            leads(east, west),
            leads(west, east),
            leads(entry, east),
            leads(west, exit),
        ],
        ..Roadmap::default()
    }
}

#[test]
fn lanes_that_close_a_circle_are_a_roundabout() {
    let map = circle_and_arm(13.0);
    let found = roundabouts(&map);
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].source, Source::Closed);
    let elements = Elements::of(&found[0]);
    assert_eq!(elements.kind, Kind::Small);
    assert!((elements.outer_diameter_m - 30.0).abs() < 0.01);
    assert!((elements.inner_diameter_m - 22.0).abs() < 0.01);
    assert_eq!(elements.contradictions, []);
    let [arm] = &elements.arms[..] else {
        panic!("{:?}", elements.arms);
    };
    assert!((arm.bearing_rad + FRAC_PI_2).abs() < 0.1, "{arm:?}");
    assert_eq!(
        (arm.entry_width_m, arm.exit_width_m),
        (Some(4.0), Some(4.0))
    );
    assert!((arm.divider_m.unwrap() - 4.0).abs() < 0.01, "{arm:?}");
}

/// A race track has such bends, too.
#[test]
fn bends_that_close_nothing_are_no_roundabout() {
    let mut map = circle_and_arm(13.0);
    map.connectors.clear();
    assert_eq!(roundabouts(&map), []);
}

#[test]
fn what_a_map_calls_a_roundabout_need_not_be_closed() {
    let mut map = circle_and_arm(13.0);
    map.connectors.clear();
    for ring in &mut map.lanes[..2] {
        ring.is_circular = true;
    }
    map.lanes.remove(1);
    // The eastern half alone, with a piece of the road before it.
    let points_m = [[2.0, -23.0], [1.0, -18.0]].into_iter();
    map.lanes[0].curve = lane(id(1, 1), points_m.chain(arc(13.0, -FRAC_PI_2, 1.2 * PI))).curve;
    let found = roundabouts(&map);
    let elements = Elements::of(&found[0]);
    assert!(
        (elements.outer_diameter_m - 30.0).abs() < 0.5,
        "{elements:?}"
    );
    let is_open = |one: &Contradiction| matches!(one, Contradiction::Open { .. });
    assert!(elements.contradictions.iter().any(is_open), "{elements:?}");
}

#[test]
fn types_follow_the_limits_of_the_outer_diameter() {
    for (outer_m, expected, contradicts) in [
        (12.0, Kind::Mini, true),
        (13.0, Kind::Mini, false),
        (22.0, Kind::Mini, false),
        (23.0, Kind::Mini, true),
        (25.0, Kind::Small, true),
        (26.0, Kind::Small, false),
        (60.0, Kind::Small, false),
    ] {
        let found = roundabouts(&circle_and_arm(outer_m / 2.0 - 2.0));
        let mut elements = Elements::of(&found[0]);
        // Rounding is not what is asked about.
        elements.outer_diameter_m = (elements.outer_diameter_m * 100.0).round() / 100.0;
        assert_eq!(elements.kind, expected, "{outer_m}");
        assert_eq!(
            !elements.contradictions.is_empty(),
            contradicts,
            "{outer_m}: {elements:?}"
        );
    }
}

#[test]
fn two_rings_are_two_lanes_and_with_a_line_between_them_large() {
    let declared = |circles: [(f64, f64, LaneKind); 3]| DeclaredRoundabout {
        id: 1,
        name: "Two".to_owned(),
        centre_m: [5.0, 5.0],
        is_clockwise: None,
        circles: (1u32..)
            .zip(circles)
            .map(|(id, (inner_m, outer_m, kind))| DeclaredCircle {
                id,
                kind,
                inner_m,
                outer_m,
                is_marked: false,
            })
            .collect(),
        junctions: vec![],
    };
    let map = Roadmap {
        declared: vec![declared([
            (18.0, 22.0, LaneKind::Road),
            (14.0, 18.0, LaneKind::Road),
            (24.0, 26.0, LaneKind::Bikeway),
        ])],
        ..Roadmap::default()
    };
    let found = roundabouts(&map);
    let elements = Elements::of(&found[0]);
    assert_eq!((elements.kind, elements.lanes), (Kind::TwoLane, 2));
    assert_eq!(
        (elements.outer_diameter_m, elements.path_width_m),
        (44.0, 8.0)
    );
    let mut marked = map;
    for circle in &mut marked.declared[0].circles {
        circle.is_marked = true;
    }
    // Read again, it is the same one.
    for map in [scn::read(&scn::write(&marked)).unwrap(), marked] {
        assert_eq!(Elements::of(&roundabouts(&map)[0]).kind, Kind::Large);
    }
}

#[test]
fn arms_keep_exit_and_entry_together() {
    let mut map = circle_and_arm(13.0);
    for (number, turn_rad) in [(3, TAU / 4.0), (4, TAU / 2.0), (5, 3.0 * TAU / 4.0)] {
        for index in [2, 3] {
            let turned = map.lanes[index].curve.polyline();
            let turned = turned.points_m().iter().map(|&[x, y]| {
                let (sine, cosine) = f64::sin_cos(turn_rad);
                [x * cosine - y * sine, x * sine + y * cosine]
            });
            let own = lane(id(number, index as u32 - 1), turned.collect::<Vec<_>>());
            map.lanes.push(own);
        }
    }
    let found = roundabouts(&map);
    let [south, east, north, west] = &found[0].arms[..] else {
        panic!("{} arms", found[0].arms.len());
    };
    for (arm, bearing_rad) in [
        (south, -FRAC_PI_2),
        (east, 0.0),
        (north, FRAC_PI_2),
        (west, PI),
    ] {
        assert_eq!((arm.entries.len(), arm.exits.len()), (1, 1));
        let off_rad = crate::ego::wrapped_rad(arm.bearing_rad - bearing_rad);
        assert!(off_rad.abs() < 0.1, "{}", arm.bearing_rad);
    }
}

#[test]
fn a_corner_has_the_radius_of_its_edge() {
    let mut map = circle_and_arm(13.0);
    // To the east of the middle, turning right into the circle with 12 m at its edge.
    let bend = (0..=20).map(|step| {
        let angle_rad = PI - 1.0 * f64::from(step) / 20.0;
        [
            18.0 + 14.0 * angle_rad.cos(),
            -26.0 + 14.0 * angle_rad.sin(),
        ]
    });
    map.lanes[2] = lane(id(2, 1), [[4.0, -80.0]].into_iter().chain(bend));
    let elements = Elements::of(&roundabouts(&map)[0]);
    let radius_m = elements.arms[0].entry_radius_m.unwrap();
    assert!((radius_m - 12.0).abs() < 0.3, "{radius_m}");
    assert_eq!(elements.arms[0].exit_radius_m, None);
}

#[test]
fn simplification_keeps_its_bound() {
    let mut map = circle_and_arm(13.0);
    let wobbly = (0..=130).map(|step| {
        let y = -80.0 + f64::from(step) * 0.48;
        [4.0 + 1.5 * (y / 9.0).sin(), y]
    });
    map.lanes[2] = lane(id(2, 1), wobbly);
    let reduced = simplified(&roundabouts(&map)[0]);
    assert!(reduced.off_m <= SIMPLIFIED_WITHIN_M && reduced.off_m > 0.0);
    assert!(reduced.dropped > reduced.points / 2, "{reduced:?}");
}

#[test]
fn a_found_roundabout_is_the_same_when_it_is_declared() {
    let mut map = circle_and_arm(13.0);
    let found = roundabouts(&map);
    map.declared.extend(found[0].declaration(1, &map));
    let again = roundabouts(&scn::read(&scn::write(&map)).unwrap());
    assert_eq!(again[0].source, Source::Declared);
    let [first, second] = [&found[0], &again[0]].map(Elements::of);
    assert!((first.outer_diameter_m - second.outer_diameter_m).abs() < 0.01);
    assert_eq!(first.arms, second.arms);
    assert_eq!(again[0].declaration(2, &map), None);
}

/// As where traffic drives on the left.
#[test]
fn a_mirrored_map_is_driven_clockwise() {
    let mut map = circle_and_arm(13.0);
    for lane in &mut map.lanes {
        if let Curve::Points(vertices) = &mut lane.curve {
            vertices
                .iter_mut()
                .for_each(|vertex| vertex.place_m[0] *= -1.0);
        }
    }
    let found = roundabouts(&map);
    assert!(found[0].is_clockwise);
    assert_eq!(Elements::of(&found[0]).arms.len(), 1);
    map.declared.extend(found[0].declaration(1, &map));
    // By its lanes, where the map does not say.
    map.declared[0].is_clockwise = None;
    let declared = roundabouts(&map);
    assert_eq!(
        (declared[0].source, declared[0].is_clockwise),
        (Source::Declared, true)
    );
    assert_eq!(declared[0].arms.len(), 1);
}

#[test]
fn entries_that_follow_each_other_are_arms_of_their_own() {
    let mut map = circle_and_arm(13.0);
    for (number, angle_deg) in [(3, -30.0f64), (4, 30.0), (5, 90.0)] {
        let (sine, cosine) = angle_deg.to_radians().sin_cos();
        let way = [[80.0 * cosine, 80.0 * sine], [17.0 * cosine, 17.0 * sine]];
        map.lanes.push(lane(id(number, 1), way));
        map.connectors.push(leads(id(number, 1), id(1, 1)));
    }
    assert_eq!(roundabouts(&map)[0].arms.len(), 4);
}

#[test]
fn a_lane_that_is_named_often_is_one_way_in() {
    let mut map = circle_and_arm(13.0);
    let mut declared = roundabouts(&map)[0].declaration(1, &map).unwrap();
    declared.junctions = vec![declared.junctions[0]; 1000];
    map.declared.push(declared);
    assert_eq!(roundabouts(&map)[0].arms[0].entries.len(), 1);
}
