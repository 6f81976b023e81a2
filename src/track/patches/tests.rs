use super::*;
use crate::cloud::Scan;
use crate::cloud::tests::scan_of;
use crate::cluster::{ClusterParameters, Dbscan};
use crate::parameter::Profile;
use crate::track::tests::with_scene;

/// The patches of what is seen from 1.9 m above the ground.
fn patches(distance_cm: impl Fn(usize, usize) -> u16) -> (Placer, Scan) {
    let scan = scan_of(1800, distance_cm);
    let mut placer = Placer::default();
    with_scene(&scan, |scene| {
        let mut dbscan = Dbscan::new(&ClusterParameters::profile(Profile::Default));
        let clusters = dbscan.process(&scan, &vec![false; scan.len()], scene.heights_m);
        let mut climber = Climber::default();
        climber.begin(scene, clusters.members());
        placer.place(
            clusters,
            &mut climber,
            &mut Forecasts::default(),
            scene,
            &TrackParameters::profile(Profile::Default),
        );
    });
    (placer, scan)
}

#[test]
fn what_does_not_touch_from_above_is_parted_though_it_is_one_cluster() {
    // 10 m away, of which eps is 0.72 m: posts 0.35 m wide and 0.65 m apart.
    let (placer, scan) = patches(|column, layer| match column {
        100..110 | 128..138 if (4..10).contains(&layer) => 1000,
        _ => 0,
    });
    let [left, right] = placer.patches() else {
        panic!("{:?}", placer.patches());
    };
    for (patch, columns) in [(left, 100..110), (right, 128..138)] {
        let own = placer.placed(patch);
        assert_eq!(own.len(), 60);
        assert!(own.is_sorted_by_key(|placed| placed.point));
        let mut of_own = own.iter().map(|placed| scan.column(placed.point as usize));
        assert!(of_own.all(|column| columns.contains(&column)));
        assert!(!patch.is_suspect);
    }
}

/// Columns of a person who stands 8 m away, 0.45 m wide.
const PERSON: std::ops::Range<usize> = 100..116;

/// What is met of people in these columns, 8 m away and up to 1.7 m above the ground.
fn people(columns: &[std::ops::Range<usize>], column: usize, layer: usize) -> u16 {
    let is_met = columns.iter().any(|own| own.contains(&column));
    if is_met && (3..8).contains(&layer) {
        800
    } else {
        0
    }
}

#[test]
fn people_side_by_side_are_parted_and_each_stands_apart() {
    // 0.3 m from each other, as far as the cells that hold a car together are wide.
    let (placer, scan) = patches(|column, layer| people(&[PERSON, 127..143], column, layer));
    let [left, right] = placer.patches() else {
        panic!("{:?}", placer.patches());
    };
    for (patch, columns) in [(left, PERSON), (right, 127..143)] {
        let mut own = placer.placed(patch).iter();
        assert!(own.all(|placed| columns.contains(&scan.column(placed.point as usize))));
        assert!(patch.flanks.stand_apart);
    }
    assert!(left.flanks.are_parted_from(&right.flanks, &scan));
    assert!(right.flanks.are_parted_from(&left.flanks, &scan));
}

#[test]
fn two_pieces_of_a_side_with_such_a_gap_are_no_crowd() {
    // 2.5 m each.
    let (placer, _) = patches(|column, layer| match column {
        100..190 | 201..291 if (3..8).contains(&layer) => 800,
        _ => 0,
    });
    assert_eq!(placer.patches().len(), 1);
}

#[test]
fn a_post_that_hides_what_may_be_between_two_things_parts_them_not() {
    let both = [PERSON, 130..146];
    let with_post = |column: usize, layer: usize| match column {
        117..129 => 400,
        _ => people(&both, column, layer),
    };
    let (placer, scan) = patches(with_post);
    let far: Vec<_> = placer
        .patches()
        .iter()
        .filter(|patch| patch.bounds.high_m[1] > 6.0)
        .collect();
    let [left, right] = far[..] else {
        panic!("{:?}", placer.patches());
    };
    assert!(!left.flanks.are_parted_from(&right.flanks, &scan));
}

#[test]
fn who_touches_a_wall_does_not_stand_apart() {
    let (placer, _) = patches(|column, layer| people(&[PERSON], column, layer));
    let placed = placer.placed(&placer.patches()[0]);
    let beside = |range_cm: u16| {
        let scan = scan_of(1800, |column, layer| match column {
            116.. => range_cm,
            _ => people(&[PERSON], column, layer),
        });
        Flanks::of(placed, &scan).stand_apart
    };
    // At the wall, before it, and half hidden by it.
    assert_eq!([820, 900, 700].map(beside), [false, true, true]);
}

#[test]
fn the_roof_of_a_van_belongs_to_it_and_the_crown_above_a_car_does_not() {
    // 10 m away layers 8 to 10 pass 2.1, 2.4 and 2.8 m above the ground; what is met there lies
    // behind the foot of the screen, or a metre behind and above a gap.
    let top_m = |roof_cm: u16, gap: Option<usize>| {
        let (placer, _) = patches(|column, layer| match (column, layer) {
            (_, layer) if Some(layer) == gap => 0,
            (100..150, 3..7) => 1000,
            (100..150, 7..9) => 1030,
            (100..150, 9) => roof_cm,
            (100..150, 10) => roof_cm + 30,
            _ => 0,
        });
        let patches = placer.patches().iter();
        patches.map(|patch| patch.bounds.top_m).fold(0.0, f32::max)
    };
    assert!(top_m(1060, None) > 2.7);
    assert!(top_m(1060, Some(8)) < CUT_M);
}

#[test]
fn what_goes_on_above_all_that_is_clustered_is_no_road_user() {
    let parameters = TrackParameters::profile(Profile::Default);
    // 17 m away layers 12 and 13 pass 4.0 and 4.6 m above the ground.
    let highest = |layers: usize| {
        let (placer, _) = patches(|column, layer| match column {
            100..105 if layer < layers => 1700,
            _ => 0,
        });
        placer.patches()[0]
    };
    assert!(highest(12).can_be_road_user(&parameters));
    assert!(!highest(13).can_be_road_user(&parameters));
}

#[test]
fn what_is_low_of_a_wall_is_no_road_user_though_all_above_it_is_higher_than_clusters() {
    let parameters = TrackParameters::profile(Profile::Default);
    // 35 m away layers 6 and 7 pass 0.1 and 1.3 m above the ground, the others 1.2 m apart.
    let can_be = |layers: usize| {
        let (placer, _) = patches(|column, layer| match column {
            100..125 if (6..layers).contains(&layer) => 3500,
            _ => 0,
        });
        let mut patches = placer.patches().iter();
        patches.any(|patch| patch.can_be_road_user(&parameters))
    };
    assert_eq!([8, 9, 12].map(can_be), [true, true, false]);
}

#[test]
fn a_house_is_structure_and_what_stands_apart_before_it_is_suspect() {
    let parameters = TrackParameters::profile(Profile::Default);
    // 15 m away a wall higher than a truck; a person stands 0.78 m before it.
    let (placer, _) = patches(|column, layer| match column {
        40..44 if layer < 8 => 1422,
        10..80 => 1500,
        _ => 0,
    });
    let (people, walls): (Vec<&Patch>, Vec<&Patch>) = placer
        .patches()
        .iter()
        .partition(|patch| patch.can_be_road_user(&parameters));
    assert_eq!((people.len(), walls.len()), (1, 1), "{people:?} {walls:?}");
    assert!(people[0].is_suspect && people[0].diagonal_m() < 1.0);
}

#[test]
fn what_is_above_a_part_belongs_to_it_if_it_is_close_above_most_of_it() {
    // 10 m away, with a gap below layers 9 and 10, which pass 2.4 and 2.8 m above the ground;
    // layer 11 passes 3.1 m above it, too high to say anything of what is below.
    let top_m = |over: usize, layers: usize| {
        let (placer, _) = patches(|column, layer| match (column, layer) {
            (100..150, 3..=7) => 1000,
            (100..150, 9..11) if column < 100 + over => 1000,
            (100..150, 11) if layer < layers => 1000,
            _ => 0,
        });
        let patches = placer.patches().iter();
        patches.map(|patch| patch.bounds.top_m).fold(0.0, f32::max)
    };
    assert!(top_m(50, 0) > 2.7);
    assert!(top_m(10, 0) < CUT_M);
    assert!(top_m(50, 12) > 3.0);
    assert!(top_m(10, 12) < CUT_M);
}

#[test]
fn what_is_thinned_stands_for_all_of_its_returns() {
    // 10 m away, of which every second column is kept, and the last one, with two ends each.
    for columns in [10, 100] {
        let (placer, _) = patches(|column, layer| {
            u16::from((100..100 + columns).contains(&column) && (4..8).contains(&layer)) * 1000
        });
        let [patch] = placer.patches() else {
            panic!("{:?}", placer.patches());
        };
        let kept = placer.placed(patch).len();
        assert_eq!(kept, if columns == 10 { 40 } else { 2 * 51 });
        assert!((kept as f32 * patch.returns_each - 4.0 * columns as f32).abs() < 0.01);
    }
}

#[test]
fn a_wall_that_is_passed_closely_stays_one_part() {
    for beside_cm in [80.0, 100.0, 120.0] {
        let (placer, _) = patches(|column, layer| {
            let range_cm = beside_cm / libm::sin((column as f64 * 0.2).to_radians());
            let is_met = (1..450).contains(&column) && range_cm < 850.0;
            u16::from(is_met && (5..8).contains(&layer)) * range_cm as u16
        });
        assert_eq!(placer.patches().len(), 1, "{beside_cm} cm");
    }
}

#[test]
fn what_lies_far_behind_the_top_of_a_van_is_no_roof() {
    // 18 m away layer 9 passes 2.8 m above the ground; from column to column it recedes, from
    // 0.25 m to 1.45 m behind what is below.
    let (placer, _) = patches(|column, layer| match (column, layer) {
        (100..150, 5..9) => 1800,
        (100..150, 9) => 1825 + (column as u16 - 100) / 10 * 30,
        _ => 0,
    });
    let above = |patch: &Patch| {
        let own = placer.placed(patch).iter();
        own.filter(|placed| placed.above_m > 2.3).count()
    };
    assert_eq!(placer.patches().iter().map(above).sum::<usize>(), 20);
}

#[test]
fn parts_that_take_turns_are_each_in_the_order_of_the_scan() {
    // 15 m away a wall; a person stands 0.78 m before it.
    let (placer, _) = patches(|column, layer| match column {
        40..44 if layer < 8 => 1422,
        10..80 => 1500,
        _ => 0,
    });
    assert_eq!(placer.patches().len(), 2);
    for patch in placer.patches() {
        let own = placer.placed(patch);
        assert!(own.is_sorted_by(|a, b| a.point < b.point));
    }
}
