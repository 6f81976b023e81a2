use super::*;
use crate::wire::Recording;

fn revolutions(name: &str, seed: u64, count: usize) -> (Vec<u8>, Vec<Truth>) {
    let mut simulation = Simulation::new(scenario::find(name).unwrap(), seed);
    let mut out = vec![];
    let truth = (0..count).map(|_| simulation.revolve(&mut out)).collect();
    (out, truth)
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_gives_others() {
    assert_eq!(revolutions("hill", 3, 2), revolutions("hill", 3, 2));
    assert_ne!(revolutions("hill", 3, 2).0, revolutions("hill", 4, 2).0);
}

#[test]
fn a_revolution_has_the_columns_of_ten_hertz_and_ends_a_tenth_later() {
    let (out, truth) = revolutions("standing", 1, 3);
    let entry = Recording::new(&out).next().unwrap().unwrap();
    let cloud = CompactPointCloud::decode(entry.envelope.payload, 0).unwrap();
    assert!(
        (1808..=1809).contains(&cloud.columns()),
        "{}",
        cloud.columns()
    );
    assert!(cloud.end_azimuth_deg > 359.7);
    let between_s = (truth[2].time - truth[1].time).seconds();
    assert!((between_s - 0.1).abs() < 1e-4);
}

#[test]
fn poses_come_a_hundred_times_a_second_and_before_their_revolution() {
    let (out, _) = revolutions("roundabout", 1, 3);
    let entries = Recording::new(&out).map(|entry| entry.unwrap().envelope);
    let ids: Vec<i32> = entries.map(|envelope| envelope.data_type).collect();
    let first = ids.iter().position(|id| *id == POINT_CLOUD_ID).unwrap();
    assert!((10..=12).contains(&first), "{first}");
    assert_eq!(ids.iter().filter(|id| **id == 533).count(), ids.len() - 3);
    assert_eq!(ids.last(), Some(&POINT_CLOUD_ID));
}

#[test]
fn the_ground_is_where_the_sensor_is_not() {
    let mut simulation = Simulation::new(scenario::find("occlusion").unwrap(), 1);
    let truth = simulation.revolve(&mut vec![]);
    let labels = simulation.labels();
    let share = |label: i32| {
        let count = labels.iter().filter(|found| **found == label).count();
        count as f64 / labels.len() as f64
    };
    assert!((0.2..0.6).contains(&share(label::GROUND)));
    assert!(share(label::SCENERY) > 0.02);
    let lorry = label::FIRST_ROAD_USER;
    let on_lorry = labels.iter().filter(|found| **found == lorry).count();
    assert_eq!(on_lorry, truth.objects[0].points);
    assert!(on_lorry > 500);
}
