use super::*;
use crate::parameter::Profile;

fn sources(fixed_reference: bool) -> Sources {
    Sources::new(&EgoParameters {
        fixed_reference,
        reference_latitude_deg: 57.7,
        reference_longitude_deg: 11.9,
        ..EgoParameters::profile(Profile::Default)
    })
}

/// Drives east along a parallel, and gives when it is at a longitude.
fn drive(sources: &mut Sources, longitudes_deg: [f64; 2]) -> Time {
    let mut time = Time::from_micros(1_000_000);
    for (step, longitude_deg) in longitudes_deg.into_iter().enumerate() {
        time = Time::from_micros(1_000_000 + 10_000 * step as i64);
        let place = Geodetic {
            latitude_deg: 57.7,
            longitude_deg,
            altitude_m: 50.0,
        };
        let heading = Direction::Degrees(90.0);
        sources.take(time, Reading::Fix(Source::Applanix, place, heading));
    }
    time
}

#[test]
fn the_local_frame_follows_who_goes_far_and_everything_stays_where_it_is() {
    let mut sources = sources(false);
    let time = drive(&mut sources, [11.9, 13.5]);
    let before = sources.pose_from(Source::Applanix, time).unwrap();
    // East at the far place is not east in the frame around the near one.
    assert!(
        (before.yaw_rad.to_degrees() - 1.35).abs() < 0.01,
        "{before:?}"
    );
    let place = sources.local.unwrap().geodetic(before.position_m);
    let anew = sources.recentre(time).expect("another frame");
    let after = sources.pose_from(Source::Applanix, time).unwrap();
    assert!(after.yaw_rad.abs() < 1e-9, "{after:?}");
    let again = sources.local.unwrap().local_m(place);
    for found in [after, anew(&before)] {
        let both = found.position_m.into_iter().zip(again);
        assert!(
            both.into_iter()
                .all(|(found, again)| (found - again).abs() < 1e-3)
        );
    }
    assert!(sources.recentre(time).is_none());
    let reference = sources.reference().unwrap();
    assert!((reference.longitude_deg - 13.5).abs() < 1e-6);
}

#[test]
fn a_configured_reference_stays() {
    let mut sources = sources(true);
    let time = drive(&mut sources, [13.49, 13.5]);
    assert!(sources.recentre(time).is_none());
}
