use super::*;
use crate::cloud::tests::scan_of;
use crate::ego::wrapped_rad;
use crate::time::Span;
use crate::track::tests::{followed, spots_of};

/// What is 4.2 m long, 1.4 m deep and 20 m away, goes on above in a share of its columns, was
/// thought to move, and was then seen for a second.
fn seen(goes_on: f64) -> Track {
    let scan = scan_of(1800, |column, layer| match column {
        0..60 if (5..8).contains(&layer) => 2000 + 70 * (layer as u16 - 5),
        _ => 0,
    });
    let spots = spots_of(&scan);
    let look = Look {
        goes_on,
        ..Look::at(&spots, &scan, Vector2::zeros())
    };
    let (mut outline, mut end) = (vec![], scan.time());
    let mut track = Track::new(0, false, &spots, &look, end, 0.0, &mut outline);
    (track.moves, track.travelled_m) = (true, 20.0);
    for _ in 0..10 {
        end = end + Span::from_seconds(0.1);
        track.measure(&spots, &look, end, 0.0, &mut outline);
    }
    track
}

impl Track {
    /// Has it moved, whatever was seen of it.
    pub(in crate::track) fn moves_for_tests(&mut self) {
        self.moves = true;
    }
}

#[test]
fn a_wall_does_not_move_whatever_the_piece_of_it_that_is_seen_does() {
    assert!(seen(0.0).moves);
    let wall = seen(1.0);
    assert!(wall.belief.road_user() < SURELY_NONE);
    assert!(!wall.moves && wall.travelled_m == 0.0);
}

/// Somebody half a metre wide, 10 m away, who walks across the line of sight at 1.2 m/s, so many revolutions to the
/// left and so many back.
fn walker(ahead: usize, back: usize) -> Track {
    let met = |step: usize| {
        let columns = 300 + 7 * step / 2..316 + 7 * step / 2;
        scan_of(1800, |column, layer| match layer {
            5..13 if columns.contains(&column) => 1000,
            _ => 0,
        })
    };
    let steps = (0..=ahead).chain((ahead - back..ahead).rev());
    followed(&steps.map(met).collect::<Vec<_>>()).0
}

#[test]
fn who_walks_looks_where_he_goes_and_so_does_who_turns_round() {
    let off_rad = |track: &Track| {
        let [x, y]: [f64; 2] = track.motion.estimate().velocity_mps.into();
        assert!((libm::hypot(x, y) - 1.2).abs() < 0.3, "{x} {y}");
        wrapped_rad(track.shape.yaw_rad - libm::atan2(y, x)).abs()
    };
    let (ahead, turned) = (walker(20, 0), walker(20, 20));
    let apart = ahead
        .motion
        .velocity_mps()
        .dot(&turned.motion.velocity_mps());
    assert!(apart < 0.0);
    for track in [ahead, turned] {
        assert!(track.shape.front_known && off_rad(&track) < 0.3);
    }
}

#[test]
fn what_shows_its_length_and_hardly_any_width_is_thin_within_a_second() {
    // A rail 4 m to the side that leads away, of which 6 m are met.
    let scan = scan_of(1800, |column, layer| match column {
        70..110 if layer == 6 => (400.0 / (0.2 * column as f64).to_radians().sin()) as u16,
        _ => 0,
    });
    let spots = spots_of(&scan);
    let look = Look::at(&spots, &scan, Vector2::zeros());
    let (mut outline, mut end) = (vec![], scan.time());
    let mut track = Track::new(0, false, &spots, &look, end, 0.0, &mut outline);
    let mut seen_for_a_second = |track: &mut Track| {
        for _ in 0..10 {
            end = end + Span::from_seconds(0.1);
            track.measure(&spots, &look, end, 0.0, &mut outline);
        }
    };
    seen_for_a_second(&mut track);
    // As if it had been seen askew.
    (track.shape.seen_m[1], track.shape.whole[1]) = (0.7, 0.0);
    seen_for_a_second(&mut track);
    let wide_m = track.qualities().wide_m;
    assert!(wide_m.is_some_and(|wide_m| wide_m < 0.25), "{wide_m:?}");
}

#[test]
fn a_lorry_is_known_to_move_before_it_went_its_length_and_a_wall_is_not() {
    let mut lorry = seen(0.0);
    (lorry.shape.seen_m, lorry.shape.top_m) = ([12.0, 2.5], 3.5);
    lorry.travelled_m = 8.0;
    let wall = |shape: fn(&mut Track)| {
        let mut wall = lorry.clone();
        shape(&mut wall);
        wall
    };
    assert!(lorry.qualities().moved);
    assert!(!wall(|wall| wall.shape.seen_m[1] = 0.5).qualities().moved);
    assert!(!wall(|wall| wall.shape.top_m = 1.5).qualities().moved);
}

#[test]
fn what_a_ray_passed_over_when_it_was_near_is_no_higher_far_away_by_as_much_as_the_ground_may_be_off()
 {
    let scan = scan_of(1800, |column, layer| match column {
        0..60 if (5..8).contains(&layer) => 2000,
        _ => 0,
    });
    let spots = spots_of(&scan);
    let of = |range_m: f64, top_m: f64, top_below_m: f64| Look {
        range_m,
        top_m,
        top_below_m,
        ..Look::at(&spots, &scan, Vector2::zeros())
    };
    let (mut outline, mut end) = (vec![], scan.time());
    let track = Track::new(
        0,
        false,
        &spots,
        &of(15.0, 1.5, 1.9),
        end,
        0.0,
        &mut outline,
    );
    let mut top_m = |front_known: bool, seen_m: f64| {
        let mut track = track.clone();
        track.shape.front_known = front_known;
        for _ in 0..10 {
            end = end + Span::from_seconds(0.1);
            track.measure(&spots, &of(35.0, seen_m, 4.5), end, 0.0, &mut outline);
        }
        track.shape.top_m
    };
    assert!(top_m(true, 2.3) < 1.95);
    // A lorry, and what was never seen to drive.
    assert!(top_m(true, 3.6) > 3.4);
    assert!(top_m(false, 2.3) > 2.2);
}

#[test]
fn who_stands_apart_is_as_wide_as_seen_within_a_second_and_a_car_stays_as_it_was() {
    // What is met between some columns 10 m away, known as half as wide again or as a little wider.
    let wide_m = |columns: usize, factor: f64, is_apart: bool| {
        let scan = scan_of(1800, |column, layer| match column {
            column if column < columns && (4..8).contains(&layer) => 1000,
            _ => 0,
        });
        let spots = spots_of(&scan);
        let look = Look {
            is_apart,
            ..Look::at(&spots, &scan, Vector2::zeros())
        };
        let (mut outline, mut end) = (vec![], scan.time());
        let mut track = Track::new(0, false, &spots, &look, end, 0.0, &mut outline);
        let seen_m = track.shape.seen_m[0].max(track.shape.seen_m[1]);
        track.shape.seen_m = track.shape.seen_m.map(|side_m| factor * side_m);
        for _ in 0..10 {
            end = end + Span::from_seconds(0.1);
            track.measure(&spots, &look, end, 0.0, &mut outline);
        }
        track.shape.seen_m[0].max(track.shape.seen_m[1]) / seen_m
    };
    let (person, car) = (14, 120);
    assert!(wide_m(person, 1.5, true) < 1.1);
    assert!(wide_m(person, 1.5, false) > 1.2);
    assert!(wide_m(car, 1.5, true) < 1.2);
    assert!(wide_m(car, 1.07, true) > 1.03);
}

#[test]
fn what_drives_ahead_and_is_as_high_as_a_lorry_is_as_long_as_one() {
    // The rear of something so wide that drives off at 8 m/s, from 34 m away on.
    let length_m = |width_m: f64, layers: std::ops::Range<usize>| {
        let met = |revolution: u16| {
            let range_cm = 3400 + 80 * revolution;
            let half = 0.5 * width_m / (0.01 * f64::from(range_cm));
            let half = (half.to_degrees() / 0.2).round() as usize;
            scan_of(1800, |column, layer| {
                let is_met = (900 - half..900 + half).contains(&column);
                if is_met && layers.contains(&layer) {
                    range_cm
                } else {
                    0
                }
            })
        };
        let (track, _) = followed(&(0..20).map(met).collect::<Vec<_>>());
        track.rectangle().length_m
    };
    let (lorry_m, car_m) = (length_m(2.5, 6..9), length_m(1.8, 6..8));
    assert!(lorry_m > 7.7, "{lorry_m}");
    assert!(car_m < 5.0, "{car_m}");
}
