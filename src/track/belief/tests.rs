use super::*;

const CAR: Qualities = Qualities {
    long_m: 4.2,
    short_m: 1.6,
    whole_m: None,
    wide_m: None,
    across_m: None,
    upper_m: Some(1.4),
    person_log: None,
    top_m: 1.4,
    top_below_m: 1.7,
    goes_on: 0.0,
    roughness_m: 0.02,
    speed_mps: 0.0,
    moved: false,
    surely_moves: false,
    has_come: false,
    range_m: 15.0,
    points: 60,
    is_suspect: false,
};

#[test]
fn what_surely_moves_is_a_road_user_of_no_class_if_it_looks_like_none() {
    let with_a_load = Qualities {
        long_m: 1.1,
        short_m: 0.8,
        upper_m: Some(1.1),
        top_m: 2.4,
        top_below_m: 2.5,
        speed_mps: 1.3,
        ..CAR
    };
    let moving = Qualities {
        moved: true,
        surely_moves: true,
        ..with_a_load
    };
    let [stands, moves] = [with_a_load, moving].map(|qualities| Belief::of(&qualities));
    assert!(stands.road_user() < 0.1, "{stands:?}");
    assert!(moves.road_user() > 0.7, "{moves:?}");
    assert!(
        !matches!(moves.class().0, Class::Car | Class::Cyclist),
        "{moves:?}"
    );
}

#[test]
fn what_came_to_where_nothing_was_is_rather_a_road_user_than_what_looks_the_same_and_stands() {
    // A few returns of somebody before a wall, and cut off it.
    let stands = Qualities {
        long_m: 0.5,
        short_m: 0.2,
        upper_m: Some(0.5),
        top_m: 1.3,
        top_below_m: 1.9,
        points: 8,
        is_suspect: true,
        ..CAR
    };
    let came = Qualities {
        has_come: true,
        ..stands
    };
    let [stands, came] = [stands, came].map(|qualities| Belief::of(&qualities));
    let odds = |belief: &Belief| belief.road_user() / belief.structure;
    assert!(odds(&came) > 5.0 * odds(&stands), "{stands:?} {came:?}");
    assert_eq!(came.class().0, Class::Pedestrian);
}

#[test]
fn who_stands_so_near_that_no_ray_passes_over_him_is_a_person_and_behind_something_nobody_knows() {
    let near = Qualities {
        long_m: 0.55,
        short_m: 0.35,
        upper_m: Some(0.5),
        top_m: 1.4,
        top_below_m: OUT_OF_VIEW_M,
        range_m: 2.0,
        points: 700,
        person_log: Some(1.8),
        ..CAR
    };
    let behind = Qualities {
        top_below_m: COVERED_M,
        ..near
    };
    let [near, behind] = [near, behind].map(|qualities| Belief::of(&qualities));
    assert_eq!(near.class().0, Class::Pedestrian);
    assert!(near.road_user() > 0.6, "{near:?}");
    assert!(behind.road_user() < 0.3, "{behind:?}");
}

#[test]
fn everyday_road_users_are_told_apart() {
    let walker = Qualities {
        long_m: 0.6,
        short_m: 0.4,
        upper_m: Some(0.5),
        top_m: 1.6,
        top_below_m: 1.9,
        speed_mps: 1.4,
        moved: true,
        ..CAR
    };
    let rider = Qualities {
        long_m: 1.7,
        speed_mps: 4.2,
        ..walker
    };
    let from_behind = Qualities {
        speed_mps: 4.2,
        ..walker
    };
    let bus = Qualities {
        long_m: 9.0,
        top_m: 2.6,
        top_below_m: 3.2,
        ..CAR
    };
    for (qualities, class) in [
        (CAR, Class::Car),
        (walker, Class::Pedestrian),
        (rider, Class::Cyclist),
        (from_behind, Class::Cyclist),
        (bus, Class::LargeVehicle),
    ] {
        let belief = Belief::of(&qualities);
        assert_eq!(belief.class().0, class, "{belief:?}");
        assert!(belief.road_user() > 0.4, "{belief:?}");
    }
}

#[test]
fn a_guard_rail_along_which_one_drives_is_no_car() {
    // The piece of it that is lit drives along, too.
    let car = Qualities {
        short_m: 0.4,
        upper_m: None,
        top_m: 0.75,
        top_below_m: 1.5,
        wide_m: Some(1.7),
        across_m: Some(1.7),
        speed_mps: 14.0,
        moved: true,
        points: 8,
        ..CAR
    };
    let rail = Qualities {
        wide_m: Some(0.4),
        across_m: Some(0.4),
        ..car
    };
    let [car, rail] = [car, rail].map(|qualities| Belief::of(&qualities).road_user());
    assert!(car > 0.9 && rail < 0.2, "{car} {rail}");
}

#[test]
fn an_articulated_lorry_is_as_long_above_as_below() {
    let lorry = Qualities {
        long_m: 16.4,
        short_m: 2.4,
        wide_m: Some(2.4),
        upper_m: Some(16.5),
        top_m: 4.0,
        top_below_m: 4.1,
        speed_mps: 22.0,
        moved: true,
        points: 9000,
        ..CAR
    };
    let house = Qualities {
        long_m: 25.0,
        upper_m: Some(25.0),
        ..lorry
    };
    let [lorry, house] = [lorry, house].map(|qualities| Belief::of(&qualities).road_user());
    assert!(lorry > 0.9 && house < 0.2, "{lorry} {house}");
}

#[test]
fn what_drives_may_be_flat_and_shows_only_its_rear() {
    let van = Qualities {
        long_m: 2.0,
        short_m: 0.12,
        upper_m: Some(1.9),
        top_m: 2.35,
        top_below_m: 2.5,
        wide_m: Some(2.0),
        speed_mps: 4.0,
        moved: true,
        points: 740,
        ..CAR
    };
    let wall = Qualities {
        speed_mps: 0.0,
        moved: false,
        ..van
    };
    let [van, wall] = [van, wall].map(|qualities| Belief::of(&qualities));
    assert!(van.road_user() > 0.9 && van.vehicle() > 0.9, "{van:?}");
    assert!(wall.road_user() < 0.2, "{wall:?}");
}

#[test]
fn a_motorcyclist_is_as_fast_as_a_car() {
    let motorcyclist = Qualities {
        long_m: 1.1,
        short_m: 0.5,
        upper_m: Some(0.6),
        top_m: 1.5,
        top_below_m: 2.1,
        speed_mps: 14.0,
        moved: true,
        points: 15,
        ..CAR
    };
    let belief = Belief::of(&motorcyclist);
    assert_eq!(belief.class().0, Class::Cyclist, "{belief:?}");
    assert!(belief.road_user() > 0.5, "{belief:?}");
}

#[test]
fn three_people_side_by_side_are_no_wall() {
    let three = Qualities {
        long_m: 1.8,
        short_m: 0.46,
        whole_m: Some(0.46),
        wide_m: Some(1.8),
        across_m: Some(1.8),
        upper_m: Some(1.6),
        top_m: 1.55,
        top_below_m: 2.0,
        speed_mps: 1.4,
        moved: true,
        points: 50,
        ..CAR
    };
    let belief = Belief::of(&three);
    assert_eq!(belief.class().0, Class::Pedestrian, "{belief:?}");
    assert!(belief.road_user() > 0.5, "{belief:?}");
}

#[test]
fn who_stands_is_told_from_a_post_or_a_sign_by_the_looks() {
    let looks = |person_log| Qualities {
        long_m: 0.49,
        short_m: 0.18,
        whole_m: Some(0.49),
        upper_m: Some(0.55),
        person_log,
        top_m: 1.71,
        top_below_m: 2.22,
        points: 24,
        ..CAR
    };
    let belief = |person_log| Belief::of(&looks(person_log));
    let (person, sign) = (belief(Some(2.5)), belief(Some(-2.5)));
    assert_eq!(person.class().0, Class::Pedestrian, "{person:?}");
    assert!(person.road_user() > 0.6, "{person:?}");
    assert!(sign.road_user() < 0.2, "{sign:?}");
    let unknown = belief(None).road_user();
    assert!((0.2..0.6).contains(&unknown), "{unknown}");
}

#[test]
fn hedges_walls_and_poles_are_no_road_users() {
    let hedge = Qualities {
        roughness_m: 0.2,
        short_m: 0.8,
        ..CAR
    };
    let wall = Qualities {
        long_m: 9.0,
        top_m: 1.2,
        top_below_m: 1.4,
        ..CAR
    };
    let pole = Qualities {
        long_m: 0.2,
        short_m: 0.1,
        upper_m: Some(0.2),
        top_m: 3.0,
        top_below_m: 3.2,
        ..CAR
    };
    for qualities in [hedge, wall, pole] {
        let belief = Belief::of(&qualities);
        assert!(belief.road_user() < 0.2, "{qualities:?} {belief:?}");
    }
}
