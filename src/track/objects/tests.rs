use super::*;
use crate::cloud::Scan;
use crate::cloud::tests::{later, scan_of};
use crate::cluster::{ClusterParameters, Dbscan};
use crate::parameter::Profile;
use crate::time::Span;
use crate::track::look::Look;
use crate::track::spots::Spot;
use crate::track::tests::{spots_of, with_scene};

#[test]
fn what_goes_on_above_in_most_of_its_columns_begins_no_track() {
    // A body 3.5 m away, from 1.0 to 2.0 m above the ground. Layer 9 passes it there in 2.08 m,
    // too low to be taken for a part of it.
    let tracks = |going_on: usize| {
        let mut tracker = ObjectTracker::default();
        let scan = scan_of(1800, |column, layer| match (column, layer) {
            (100..130, ..9) => 350,
            (100.., 9) if column < 100 + going_on => 350,
            _ => 0,
        });
        see(&mut tracker, &scan);
        tracker.tracks.len()
    };
    assert_eq!((tracks(15), tracks(24)), (1, 0));
}

#[test]
fn what_is_known_begins_no_other_track_and_what_rays_pass_through_is_dropped() {
    let mut tracker = ObjectTracker::default();
    (0..4).for_each(|_| see(&mut tracker, &body(1000, 0)));
    assert_eq!((tracker.tracks.len(), tracker.next_id), (1, 1));
    (0..6).for_each(|_| see(&mut tracker, &body(0, 0)));
    assert_eq!((tracker.tracks.len(), tracker.next_id), (0, 1));
}

#[test]
fn what_is_not_seen_any_more_where_the_own_vehicle_is_was_a_piece_of_it() {
    let scan = body(1000, 0);
    let spots = spots_of(&scan);
    let sensor = Pose::SENSOR;
    let left = |far_m: f32, since_s: f64| {
        let mut tracker = ObjectTracker {
            tracks: vec![track_of(1, &spots, &scan)],
            ..ObjectTracker::default()
        };
        let [x, y] = tracker.tracks[0]
            .position_m()
            .map(|metres| metres as f32)
            .into();
        let own_vehicle = Extent {
            low_m: [x - far_m, y - far_m, -1.0],
            high_m: [x + far_m, y + far_m, 0.0],
        };
        let since = scan.time() + Span::from_seconds(since_s);
        tracker.forget_pieces(&own_vehicle, &sensor, since);
        tracker.tracks.len()
    };
    assert_eq!(
        [left(0.5, -0.3), left(0.5, 0.3), left(-0.5, 0.3)],
        [1, 0, 1]
    );
}

#[test]
fn what_rests_keeps_what_lies_in_its_place_unseen() {
    let (post, nothing) = (body(1000, 10), body(0, 0));
    let mut tracker = ObjectTracker::default();
    let mut looks = 0;
    for revolution in 0..30 {
        let scan = later(&post, 0.1 * f64::from(revolution));
        see(&mut tracker, &scan);
        let [track] = &tracker.tracks[..] else {
            panic!("{}", tracker.tracks.len());
        };
        looks += u32::from(
            revolution >= 18 && scan.time() - track.last_measured < Span::from_seconds(0.1),
        );
    }
    assert_eq!((looks, tracker.next_id), (4, 1));
    for revolution in 30..36 {
        see(&mut tracker, &later(&nothing, 0.1 * f64::from(revolution)));
    }
    assert_eq!(tracker.tracks.len(), 0);
}

#[test]
fn who_comes_at_120_km_h_is_one_and_known_before_it_is_near() {
    let mut tracker = ObjectTracker::default();
    for revolution in 0..12 {
        let range_m = 55.0 - 3.3 * f64::from(revolution);
        // 1.8 m wide, from 0.3 to 1.5 m above the ground.
        let half = libm::round(0.9 / range_m / (2.0_f64.to_radians() / 10.0)) as usize;
        let scan = scan_of(1800, |column, layer| {
            let elevation_rad = (2.0 * layer as f64 - 15.0).to_radians();
            let height_m = 1.9 + range_m * libm::sin(elevation_rad);
            let is_met = column.abs_diff(500) <= half && (0.3..1.5).contains(&height_m);
            u16::from(is_met) * (100.0 * range_m) as u16
        });
        see(&mut tracker, &later(&scan, 0.1 * f64::from(revolution)));
        if revolution >= 3 {
            let [car] = tracker.objects() else {
                panic!("{:?}", tracker.objects());
            };
            assert!(car.id == 0 && (car.speed_mps - 33.0).abs() < 2.0, "{car:?}");
        }
    }
}

#[test]
fn of_two_tracks_in_one_place_the_later_goes_on_under_the_id_of_the_first() {
    let scan = body(1000, 0);
    let spots = spots_of(&scan);
    let track = |id: u32, spots: &[Spot]| track_of(id, spots, &scan);
    let mut first = track(7, &spots[..spots.len() / 3]);
    first.was_likely = true;
    let mut tracker = ObjectTracker {
        tracks: vec![first, track(8, &spots)],
        ..ObjectTracker::default()
    };
    assert_eq!(tracker.reunite(1), 0);
    assert_eq!((tracker.tracks.len(), tracker.tracks[0].id), (1, 7));
}

#[test]
fn who_was_hidden_for_a_moment_is_known_by_a_single_ray_though_it_slowed_down() {
    let mut tracker = ObjectTracker::default();
    // A rider 35 m away, two columns wide, from 0.7 m up, at 4 m/s, which is 3.3 columns in
    // each revolution.
    let column = |revolution: usize| 300 + 10 * revolution / 3;
    for revolution in 0..15 {
        let first = column(revolution);
        let scan = scan_of(1800, |column, layer| {
            let is_met = (first..first + 2).contains(&column) && (6..9).contains(&layer);
            u16::from(is_met) * 3500
        });
        see(&mut tracker, &later(&scan, 0.1 * revolution as f64));
    }
    tracker.tracks[0].was_likely = true;
    let measured = |tracker: &ObjectTracker| {
        let [track] = &tracker.tracks[..] else {
            panic!("{}", tracker.tracks.len());
        };
        track.last_measured
    };
    let parted = measured(&tracker);
    for revolution in 15..20 {
        see(
            &mut tracker,
            &later(&body(0, 0), 0.1 * f64::from(revolution)),
        );
    }
    // 0.37 m behind where it would be: it brakes by 2 m/s^2.
    let behind = column(20) - 3;
    let scan = scan_of(1800, |column, layer| {
        u16::from(column == behind && layer == 7) * 3500
    });
    see(&mut tracker, &later(&scan, 2.0));
    assert!(measured(&tracker) > parted);
}

#[test]
fn who_moves_has_all_of_what_only_partly_lies_where_he_was_expected() {
    let mut tracker = ObjectTracker::default();
    // A rider 20 m away, from 0.1 m up, at 5 m/s, which is 7 columns in each revolution.
    let rider = |columns: std::ops::Range<usize>| {
        scan_of(1800, |column, layer| {
            let is_met = columns.contains(&column) && (5..9).contains(&layer);
            u16::from(is_met) * 2000
        })
    };
    for revolution in 0..15 {
        let first = 300 + 7 * revolution;
        let scan = rider(first..first + 4);
        see(&mut tracker, &later(&scan, 0.1 * revolution as f64));
    }
    // He hastens, and more of him is seen, most of it ahead of where he would be.
    see(&mut tracker, &later(&rider(413..421), 1.5));
    assert_eq!((tracker.tracks.len(), tracker.next_id), (1, 1));
}

#[test]
fn a_lorry_that_comes_out_from_behind_a_house_begins_no_track_for_each_piece() {
    let mut tracker = ObjectTracker::default();
    for revolution in 0..8 {
        // 8 m long and 15 m away; it advances by 44 columns, which are 2.3 m.
        let front: usize = 400 + 44 * revolution;
        let rear = front.saturating_sub(153).max(375);
        let scan = scan_of(1800, |column, layer| {
            let is_met = (rear..front).contains(&column) && (3..9).contains(&layer);
            u16::from(is_met) * 1500
        });
        see(&mut tracker, &later(&scan, 0.1 * revolution as f64));
    }
    assert!(tracker.next_id <= 2, "{}", tracker.next_id);
}

#[test]
fn what_is_large_is_no_piece_of_the_small_things_before_it() {
    let mut tracker = ObjectTracker::default();
    let scan = |is_met: fn(usize) -> bool| {
        scan_of(1800, |column, layer| {
            u16::from(is_met(column) && (3..9).contains(&layer)) * 1500
        })
    };
    // Two posts 15 m away, and then the side of a lorry of 8 m.
    let posts = scan(|column| matches!(column, 100..104 | 130..134));
    let side = scan(|column| (100..253).contains(&column));
    for revolution in 0..6 {
        let seen = if revolution < 3 { &posts } else { &side };
        see(&mut tracker, &later(seen, 0.1 * f64::from(revolution)));
    }
    let longest_m = |longest_m: f64, track: &Track| longest_m.max(track.rectangle().length_m);
    let longest_m = tracker.tracks.iter().fold(0.0, longest_m);
    assert!(longest_m > 7.0, "{longest_m}");
}

#[test]
fn what_lies_in_the_place_of_a_known_vehicle_is_no_other_vehicle() {
    // 4.5 m long, 10 m away.
    let scan = scan_of(1800, |column, layer| match column {
        100..230 if (3..8).contains(&layer) => 1000,
        _ => 0,
    });
    let spots = spots_of(&scan);
    let track = |id: u32, spots: &[Spot]| track_of(id, spots, &scan);
    let claimed = |is_known: bool, piece: &[Spot]| {
        let mut whole = track(7, &spots);
        whole.was_likely = is_known;
        let piece = track(8, piece);
        let is_vehicle = piece.is_vehicle();
        let mut tracker = ObjectTracker {
            tracks: vec![piece, whole],
            ..ObjectTracker::default()
        };
        see(&mut tracker, &later(&scan, 0.1));
        let groups = tracker.grouping.groups().iter();
        let claimed = groups.map(|group| group.claimed_by);
        (is_vehicle, claimed.collect::<Vec<_>>())
    };
    let (half, end) = (&spots[..spots.len() / 2], &spots[..40]);
    assert_eq!(claimed(true, half), (true, vec![Some(1)]));
    assert_eq!(claimed(false, half), (true, vec![Some(0)]));
    // Who stands before it keeps what is theirs.
    assert_eq!(claimed(true, end), (false, vec![Some(0), Some(1)]));
}

/// A track that was seen once.
fn track_of(id: u32, spots: &[Spot], scan: &Scan) -> Track {
    let look = Look::at(spots, scan, Vector2::zeros());
    Track::new(id, false, spots, &look, scan.time(), 0.0, &mut vec![])
}

/// Four layers and ten columns at a range; in some columns it goes on in the layer above.
fn body(range_cm: u16, going_on: usize) -> Scan {
    scan_of(1800, |column, layer| match column {
        100..110 if (5..9).contains(&layer) => range_cm,
        100.. if column < 100 + going_on && layer == 9 => range_cm,
        _ => 0,
    })
}

/// A revolution that is clustered up to the eighth layer.
fn see(tracker: &mut ObjectTracker, scan: &Scan) {
    let left_out: Vec<bool> = (0..scan.len()).map(|point| scan.layer(point) > 8).collect();
    with_scene(scan, |scene| {
        let mut dbscan = Dbscan::new(&ClusterParameters::profile(Profile::Default));
        let clusters = dbscan.process(scan, &left_out, scene.heights_m);
        tracker.process(clusters, scene, &TrackParameters::profile(Profile::Default));
    });
}
