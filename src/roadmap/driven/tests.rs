use super::*;

/// Along a circle around the origin, a metre from place to place.
fn round(kind: LaneKind, radius_m: f64, from_rad: f64, sweep_rad: f64) -> DrivenWay {
    let steps = (radius_m * sweep_rad) as usize;
    let points_m: Vec<[f64; 2]> = (0..=steps)
        .map(|step| {
            let angle_rad = from_rad + sweep_rad * step as f64 / steps as f64;
            let (sine, cosine) = libm::sincos(angle_rad);
            // As places that are measured scatter.
            let off_m = 0.2 * libm::sin(7.0 * step as f64);
            [(radius_m + off_m) * cosine, (radius_m + off_m) * sine]
        })
        .collect();
    DrivenWay::new(kind, &points_m).unwrap()
}

#[test]
fn lanes_side_by_side_meet_half_way() {
    let ways = [
        round(LaneKind::Road, 15.0, 0.0, 4.0),
        round(LaneKind::Road, 19.0, 2.0, 3.5),
        round(LaneKind::Bikeway, 22.6, 1.0, 2.0),
    ];
    let found = driven_roundabouts(&ways, |_| Edges::default());
    assert_eq!(found.len(), 1);
    let rings = &found[0].roundabout.rings;
    for (ring, (kind, inner_m, outer_m)) in rings.iter().zip([
        (LaneKind::Road, 13.0, 17.0),
        (LaneKind::Road, 17.0, 21.0),
        (LaneKind::Bikeway, 21.6, 23.6),
    ]) {
        assert_eq!(ring.kind, kind);
        let off_m = [ring.inner_m() - inner_m, ring.outer_m() - outer_m];
        assert!(off_m.iter().all(|off_m| off_m.abs() < 0.2), "{rings:?}");
    }
    assert_eq!(rings.len(), 3);
    assert!(!found[0].roundabout.is_clockwise);
}

/// Up a straight to the east of a circle, so far round it to the left, and straight away.
fn ramp(radius_m: f64, sweep_rad: f64) -> DrivenWay {
    let straight = (0..30).map(|step| [radius_m, f64::from(step) - 30.0]);
    let steps = (radius_m * sweep_rad) as u32;
    let bent = (0..=steps).map(|step| {
        let (sine, cosine) = libm::sincos(f64::from(step) / radius_m);
        [radius_m * cosine, radius_m * sine]
    });
    let (sine, cosine) = libm::sincos(sweep_rad);
    let away = (1..40).map(|step| {
        let gone_m = f64::from(step);
        [
            radius_m * cosine - gone_m * sine,
            radius_m * sine + gone_m * cosine,
        ]
    });
    let points_m: Vec<[f64; 2]> = straight.chain(bent).chain(away).collect();
    DrivenWay::new(LaneKind::Road, &points_m).unwrap()
}

#[test]
fn a_loop_ramp_is_none() {
    let ways = [40.0, 40.3, 39.8].map(|radius_m| ramp(radius_m, 1.5 * PI));
    assert!(driven_roundabouts(&ways, |_| Edges::default()).is_empty());
    // Somebody who leaves elsewhere.
    let round = [ways.as_slice(), &[ramp(40.0, PI)]].concat();
    assert_eq!(driven_roundabouts(&round, |_| Edges::default()).len(), 1);
}

#[test]
fn one_who_turns_round_in_the_road_circles_nothing() {
    let ways = [round(LaneKind::Road, 6.0, 0.0, PI)];
    assert!(driven_roundabouts(&ways, |_| Edges::default()).is_empty());
}
