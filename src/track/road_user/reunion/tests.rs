use super::*;
use crate::cloud::tests::scan_of;
use crate::time::Span;
use crate::track::belief::Belief;
use crate::track::look::Look;
use crate::track::spots::Spot;
use crate::track::tests::spots_of;

const CYCLIST_M: f64 = 1.7;

/// Seen at an angle of a circle of 16 m on which it drives at 4 m/s.
fn at(angle_rad: f64) -> Parting {
    on_circle(16.0, 4.0, angle_rad)
}

/// Seen at an angle of a circle on which it drives.
fn on_circle(radius_m: f64, speed_mps: f64, angle_rad: f64) -> Parting {
    let (sine, cosine) = angle_rad.sin_cos();
    Parting {
        position_m: Vector2::new(cosine, sine) * radius_m,
        velocity_mps: Vector2::new(-sine, cosine) * speed_mps,
        yaw_rate_radps: speed_mps / radius_m,
        deviation_mps: 0.3,
        standing: 0.0,
        points: 9.0,
        at: Time::ZERO + Span::from_seconds(angle_rad * radius_m / speed_mps),
    }
}

fn later(parting: Parting, seconds: f64) -> Parting {
    Parting {
        at: parting.at + Span::from_seconds(seconds),
        ..parting
    }
}

#[test]
fn a_cyclist_who_turned_unseen_is_the_same() {
    let off_m = at(0.6).off_from_m(&at(0.0), CYCLIST_M);
    assert!(off_m.is_some_and(|off_m| off_m < 0.5), "{off_m:?}");
}

#[test]
fn a_car_that_drove_most_of_half_a_circle_unseen_is_the_same() {
    let car = |angle_rad| on_circle(9.0, 8.0, angle_rad);
    let off_m = car(2.2).off_from_m(&car(0.0), 4.3);
    assert!(off_m.is_some_and(|off_m| off_m < 0.1), "{off_m:?}");
}

#[test]
fn who_is_too_new_to_have_a_velocity_is_looked_for_straight_on_and_on_the_arc() {
    let car = |angle_rad| on_circle(11.0, 8.0, angle_rad);
    let parted = car(0.0);
    let on_arc = Parting {
        velocity_mps: Vector2::zeros(),
        standing: 0.6,
        ..car(1.0).of_unknown_velocity()
    };
    let gap_s = (on_arc.at - parted.at).seconds();
    let ahead = Parting {
        position_m: parted.position_m + parted.velocity_mps * gap_s,
        ..on_arc
    };
    let aside = Parting {
        position_m: 2.0 * ahead.position_m - on_arc.position_m,
        ..on_arc
    };
    let off_m = |seen: &Parting| seen.off_from_m(&parted, 1.0);
    assert!(off_m(&on_arc).is_some_and(|off_m| off_m < 0.1));
    assert!(off_m(&ahead).is_some_and(|off_m| off_m < 0.1));
    assert_eq!(off_m(&aside), None);
}

#[test]
fn a_glimpse_is_no_parting_unless_it_is_all_there_is() {
    let parting = at(0.0);
    let soon = parting.at + Span::from_seconds(0.1);
    let late = parting.at + Span::from_seconds(1.5);
    assert!(parting.is_renewed_by(5, soon));
    assert!(!parting.is_renewed_by(4, soon));
    assert!(parting.is_renewed_by(1, late));
}

#[test]
fn of_what_shows_a_few_returns_instead_of_many_hardly_anything_is_seen() {
    let scan = scan_of(1800, |column, layer| match column {
        0..40 if (5..8).contains(&layer) => 1500,
        _ => 0,
    });
    let spots = spots_of(&scan);
    let look = |spots: &[Spot]| Look::at(spots, &scan, Vector2::zeros());
    let (mut outline, begin) = (vec![], scan.time());
    let mut track = Track::new(1, false, &spots, &look(&spots), begin, 0.0, &mut outline);
    track.was_likely = true;
    let mut is_missed_after = |count: usize, revolution: u32| {
        let end = begin + Span::from_seconds(0.1 * f64::from(revolution));
        let seen = &spots[..count];
        track.measure(seen, &look(seen), end, 0.0, &mut outline);
        track.is_missed()
    };
    assert!(!is_missed_after(spots.len(), 1));
    assert!(is_missed_after(3, 2));
    assert!(!is_missed_after(spots.len(), 3));
}

#[test]
fn what_is_new_and_seems_to_stand_may_be_who_was_lost_as_long_as_it_is_new() {
    let scan = scan_of(1800, |column, layer| match column {
        0..40 if (5..8).contains(&layer) => 1500,
        _ => 0,
    });
    let (spots, begin) = (spots_of(&scan), scan.time());
    let look = Look::at(&spots, &scan, Vector2::zeros());
    let track = |id| Track::new(id, false, &spots, &look, begin, 0.0, &mut vec![]);
    let mut lost = track(1);
    lost.moves = true;
    lost.parted = Parting {
        at: begin,
        ..at(0.0)
    };
    let is_found_after = |age_s: f64| {
        let mut seen = track(2);
        seen.time = begin + Span::from_seconds(1.5 + age_s);
        seen.first_seen = begin + Span::from_seconds(1.5);
        seen.parted = Parting {
            position_m: lost.parted.position_m + lost.parted.velocity_mps * (1.5 + age_s),
            velocity_mps: Vector2::zeros(),
            standing: 0.9,
            at: seen.time,
            ..lost.parted
        };
        seen.off_from_m(&lost).is_some()
    };
    assert!(is_found_after(0.4) && !is_found_after(1.2));
}

/// A track of what is 15 m away and so many columns wide.
fn track_of(columns: usize, id: u32, end: Time) -> Track {
    let scan = scan_of(1800, |column, layer| {
        u16::from(column < columns && (5..9).contains(&layer)) * 1500
    });
    let spots = spots_of(&scan);
    let look = Look::at(&spots, &scan, Vector2::zeros());
    Track::new(id, false, &spots, &look, end, 0.0, &mut vec![])
}

/// What is thought of something narrow, which is no vehicle.
fn no_vehicle() -> Belief {
    track_of(10, 0, Time::ZERO).belief
}

/// A track that was seen at a parting, since some seconds before.
fn track_at(id: u32, parted: Parting, age_s: f64) -> Track {
    let mut track = track_of(40, id, parted.at);
    (track.time, track.last_measured) = (parted.at, parted.at);
    track.first_seen = parted.at + Span::from_seconds(-age_s);
    track.parted = parted;
    track
}

#[test]
fn who_was_lost_so_soon_that_it_only_seemed_to_stand_may_have_driven_on() {
    let standing = Parting {
        velocity_mps: Vector2::zeros(),
        deviation_mps: 0.8,
        standing: 0.9,
        ..at(0.0)
    };
    let is_found_at_m = |age_s: f64, metres: f64| {
        let lost = track_at(1, standing, age_s);
        let mut seen = later(standing, 0.3);
        seen.position_m.x += metres;
        track_at(2, seen, 0.2).off_from_m(&lost).is_some()
    };
    assert!(is_found_at_m(0.4, 3.5) && !is_found_at_m(0.4, 6.5));
    assert!(is_found_at_m(1.5, 1.0) && !is_found_at_m(1.5, 3.5));
    let mut late = later(standing, 2.0);
    late.position_m.x += 3.5;
    let lost = track_at(1, standing, 0.4);
    assert_eq!(track_at(2, late, 0.2).off_from_m(&lost), None);
    // Nor does its velocity tell anything of whom is known to drive now.
    let driving = Parting {
        at: later(standing, 0.3).at,
        ..at(0.0)
    };
    assert_eq!(driving.off_from_m(&standing, 1.0), None);
    let unknown = standing.of_unknown_velocity();
    assert!(driving.off_from_m(&unknown, 1.0).is_some());
}

#[test]
fn who_drove_fast_may_be_taken_for_something_else_when_it_is_seen_anew() {
    let mut lost = track_at(1, on_circle(11.0, 8.0, 0.0), 2.0);
    (lost.moves, lost.belief) = (true, no_vehicle());
    let seen = track_at(2, on_circle(11.0, 8.0, 0.3), 0.2);
    assert_ne!(seen.is_vehicle(), lost.is_vehicle());
    assert!(seen.off_from_m(&lost).is_some());
    // Who walks is no car.
    let mut lost = track_at(1, on_circle(11.0, 1.5, 0.0), 2.0);
    (lost.moves, lost.belief) = (true, no_vehicle());
    assert_eq!(
        track_at(2, on_circle(11.0, 1.5, 0.1), 0.2).off_from_m(&lost),
        None
    );
}

#[test]
fn who_is_too_new_goes_on_as_fast_as_the_one_who_was_lost() {
    let mut lost = track_at(1, on_circle(11.0, 8.0, 0.0), 2.0);
    lost.moves = true;
    let on_arc = on_circle(11.0, 8.0, 0.8);
    let gap_s = (on_arc.at - lost.parted.at).seconds();
    let ahead = Parting {
        position_m: lost.parted.position_m + lost.parted.velocity_mps * gap_s,
        ..on_arc
    };
    let after = |lost: &Track, seen: Parting| {
        let mut seen = track_at(2, seen, 0.2);
        seen.take_over(lost);
        (seen.id, seen.velocity_mps())
    };
    let is_near = |(id, velocity_mps): (u32, Vector2<f64>), other_mps: Vector2<f64>| {
        id == 1 && (velocity_mps - other_mps).norm() < 0.4
    };
    assert!(is_near(after(&lost, on_arc), on_arc.velocity_mps));
    assert!(is_near(after(&lost, ahead), lost.parted.velocity_mps));
    // Who walks may as well have stopped, and what is something else may stand.
    let mut walking = lost.clone();
    walking.parted.velocity_mps *= 0.2;
    assert_eq!(after(&walking, on_arc), (1, Vector2::zeros()));
    lost.belief = no_vehicle();
    assert_eq!(after(&lost, on_arc), (1, Vector2::zeros()));
}

#[test]
fn two_in_one_place_are_one_and_the_one_of_which_more_is_seen_is_right() {
    let mut known = track_at(1, at(0.0), 2.0);
    let seen = track_at(2, at(0.0), 0.3);
    known.points = 9;
    assert!(!seen.replaces(&known), "nobody knows it");
    known.was_likely = true;
    assert!(seen.replaces(&known));
    known.points = seen.points;
    assert!(!seen.replaces(&known));
    known.points = 9;
    let mut elsewhere = known.clone();
    elsewhere.motion.shift(Vector2::new(6.0, 0.0));
    assert!(!seen.replaces(&elsewhere));
    let mut oncoming = known.clone();
    oncoming.parted.velocity_mps *= -1.0;
    let mut driving = seen.clone();
    driving.moves = true;
    assert!(driving.replaces(&known) && !driving.replaces(&oncoming));
    known.belief = no_vehicle();
    assert!(!seen.replaces(&known), "a car and who stands beside it");
}

#[test]
fn who_comes_back_elsewhere_or_otherwise_is_someone_else() {
    let parted = at(0.0);
    let mut elsewhere = at(0.6);
    elsewhere.position_m.x += 4.0;
    let mut back = at(0.6);
    back.velocity_mps = -back.velocity_mps;
    let mut faster = at(0.6);
    faster.velocity_mps *= 2.5;
    let mut waiting = at(0.0);
    (waiting.velocity_mps, waiting.standing) = (Vector2::zeros(), 1.0);
    for other in [elsewhere, back, faster, waiting] {
        let other = Parting {
            at: at(0.6).at,
            ..other
        };
        assert_eq!(other.off_from_m(&parted, CYCLIST_M), None, "{other:?}");
    }
}

#[test]
fn who_stood_is_found_where_it_stood() {
    let mut stood = at(0.0);
    (stood.velocity_mps, stood.standing) = (Vector2::zeros(), 1.0);
    let mut seen = later(stood, 3.0);
    seen.position_m.x += 0.4;
    assert!(seen.off_from_m(&stood, 0.5).is_some());
    seen.position_m.x += 1.5;
    assert_eq!(seen.off_from_m(&stood, 0.5), None);
}
