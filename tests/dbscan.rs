//! The windowed DBSCAN against the definition (Ester et al. 1996), by brute force: on random
//! clouds, on a real revolution, and over the azimuth seam.
#![cfg(feature = "shell")]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use kreisel::cloud::{Intake, OwnVehicle, Scan};
use kreisel::cluster::{ClusterParameters, Clusters, Dbscan, WindowSetting};
use kreisel::config::Configuration;
use kreisel::parameter::Profile;
use kreisel::random::Random;
use kreisel::wire::Envelope;
use kreisel::wire::point_cloud::CompactPointCloud;
use proptest::prelude::*;

/// The default profile's, and clustered so high that all layers have a part in it.
fn parameters() -> ClusterParameters {
    ClusterParameters {
        highest_m: 4.5,
        ..ClusterParameters::profile(Profile::Default)
    }
}

/// A scan of distances in centimetres, in array order.
fn scan_of(distances_cm: &[u16], start_deg: f32, end_deg: f32) -> Scan {
    let distances: Vec<u8> = distances_cm
        .iter()
        .flat_map(|cm| cm.to_be_bytes())
        .collect();
    let cloud = CompactPointCloud {
        start_azimuth_deg: start_deg,
        end_azimuth_deg: end_deg,
        layers: 16,
        distances: &distances,
        ..CompactPointCloud::default()
    };
    let mut configuration = Configuration::default();
    configuration.cloud.byte_order = kreisel::cloud::ByteOrderSetting::Big;
    let mut intake = Intake::default();
    let revolution = intake
        .accept(&Envelope::default(), cloud, &configuration.cloud)
        .unwrap();
    let mut scan = Scan::default();
    scan.fill(&revolution, &OwnVehicle::default(), &configuration.cloud);
    scan
}

/// The definition: who is within eps of whom, counted and connected without any short cut.
struct BruteForce {
    points: Vec<usize>,
    core: Vec<bool>,
    component: Vec<usize>,
}

impl BruteForce {
    fn new(scan: &Scan, ground: &[bool], parameters: &ClusterParameters) -> Self {
        let used = |point: &usize| scan.has_return(*point) && !ground[*point];
        let points: Vec<usize> = (0..scan.len()).filter(used).collect();
        let neighbours = |a: usize| {
            let near = move |b: &usize| are_neighbours(scan, parameters, a, *b);
            points.iter().copied().filter(near).collect::<Vec<_>>()
        };
        let mut core = vec![false; scan.len()];
        for point in &points {
            core[*point] = neighbours(*point).len() >= needed(scan, parameters, *point);
        }
        let mut component = vec![usize::MAX; scan.len()];
        for seed in points.iter().copied().filter(|point| core[*point]) {
            if component[seed] != usize::MAX {
                continue;
            }
            component[seed] = seed;
            let mut open = vec![seed];
            while let Some(point) = open.pop() {
                for other in neighbours(point) {
                    if core[other] && component[other] == usize::MAX {
                        component[other] = seed;
                        open.push(other);
                    }
                }
            }
        }
        Self {
            points,
            core,
            component,
        }
    }
}

fn eps_m(scan: &Scan, parameters: &ClusterParameters, point: usize) -> f32 {
    parameters.eps_m as f32 + parameters.eps_per_m as f32 * scan.range_m()[point]
}

fn needed(scan: &Scan, parameters: &ClusterParameters, point: usize) -> usize {
    let scale = parameters.min_points_range_m as f32 / scan.range_m()[point];
    let wanted = (parameters.min_points as f32 * scale).min(parameters.min_points as f32);
    (wanted.max(parameters.min_points_far as f32) + 0.5) as usize
}

fn squared_distance(scan: &Scan, a: usize, b: usize) -> f32 {
    let ([ax, ay, az], [bx, by, bz]) = (scan.point_m(a), scan.point_m(b));
    let (dx, dy, dz) = (ax - bx, ay - by, az - bz);
    dx * dx + dy * dy + dz * dz
}

fn are_neighbours(scan: &Scan, parameters: &ClusterParameters, a: usize, b: usize) -> bool {
    let apart = scan.column(a).abs_diff(scan.column(b));
    let apart = apart.min(scan.columns() - apart);
    if parameters.window == WindowSetting::Columns && apart > parameters.window_columns {
        return false;
    }
    let eps = eps_m(scan, parameters, a).min(eps_m(scan, parameters, b));
    squared_distance(scan, a, b) <= eps * eps
}

/// The ground, which lies 2 m below the sensor, and what is too high above it are left out.
/// Clusters are the components of core points; a border point belongs to that of its nearest
/// core neighbour; everything else is noise.
fn assert_is_dbscan(scan: &Scan, ground: &[bool], parameters: &ClusterParameters) -> usize {
    let heights_m: Vec<f32> = scan.z_m().iter().map(|z| z + 2.0).collect();
    let mut dbscan = Dbscan::new(parameters);
    // Nothing must be left of the revolution before, which had more columns.
    let before = scan_of(&random_distances(1, 500, 0.1), 0.01, 359.0);
    dbscan.process(
        &before,
        &vec![false; before.len()],
        &vec![0.0; before.len()],
    );
    let clusters = dbscan.process(scan, ground, &heights_m).clone();
    let labels = clusters.labels();
    let is_too_high = |height_m: &f32| f64::from(*height_m) > parameters.highest_m;
    let heights = heights_m.iter().map(is_too_high);
    let left_out: Vec<bool> = ground.iter().zip(heights).map(|(a, b)| *a || b).collect();
    for (point, _) in left_out.iter().enumerate().filter(|(_, is_out)| **is_out) {
        assert_eq!(labels[point], Clusters::NONE);
    }
    let truth = BruteForce::new(scan, &left_out, parameters);
    let mut component_of_cluster = vec![usize::MAX; clusters.len()];
    for point in truth.points.iter().copied() {
        let label = labels[point];
        if truth.core[point] {
            assert_ne!(label, Clusters::NONE, "core point {point} is noise");
            let component = &mut component_of_cluster[usize::from(label)];
            if *component == usize::MAX {
                *component = truth.component[point];
            }
            assert_eq!(*component, truth.component[point], "point {point}");
            continue;
        }
        let cores = truth.points.iter().copied();
        let near = cores.filter(|b| truth.core[*b] && are_neighbours(scan, parameters, point, *b));
        let nearest = near.min_by(|a, b| {
            let distance = |other| squared_distance(scan, point, other);
            distance(*a).total_cmp(&distance(*b)).then(a.cmp(b))
        });
        let expected = nearest.map_or(Clusters::NONE, |core| labels[core]);
        assert_eq!(label, expected, "border point {point}");
    }
    // A component is named after its first core point.
    assert!(
        component_of_cluster.is_sorted_by(|a, b| a < b),
        "a component in two clusters, or not in order: {component_of_cluster:?}"
    );
    truth.points.len()
}

/// Surfaces, posts and stray returns, seeded.
fn random_distances(seed: u64, columns: usize, stray: f64) -> Vec<u16> {
    let mut random = Random::new(seed);
    let mut distances = vec![0; columns * 16];
    for _ in 0..12 {
        let (from, wide) = (random.below(columns), 1 + random.below(columns.div_ceil(6)));
        let (low, high) = (random.below(16), 1 + random.below(6));
        let near_cm = 120 + random.below(3000);
        for column in (from..from + wide).map(|column| column % columns) {
            for layer in low..(low + high).min(16) {
                distances[column * 16 + layer] = (near_cm + random.below(40)) as u16;
            }
        }
    }
    for distance in &mut distances {
        if random.uniform() < stray {
            *distance = (100 + random.below(6000)) as u16;
        }
    }
    distances
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_clouds_are_clustered_as_defined(
        seed in any::<u64>(),
        columns in 2usize..400,
        stray in 0.0f64..0.1,
        eps_m in 0.2f64..1.5,
        eps_per_m in 0.0f64..0.05,
        min_points in 1usize..12,
        gap_deg in 0.5f32..9.0,
        falls in any::<bool>(),
        window_columns in prop::option::of(1usize..8),
    ) {
        let distances = random_distances(seed, columns, stray);
        let (start_deg, end_deg) = if falls { (215.0, gap_deg - 145.0) } else { (0.01, 360.0 - gap_deg) };
        let scan = scan_of(&distances, start_deg, end_deg);
        let mut parameters = parameters();
        (parameters.eps_m, parameters.eps_per_m) = (eps_m, eps_per_m);
        parameters.min_points = min_points;
        if let Some(columns) = window_columns {
            (parameters.window, parameters.window_columns) = (WindowSetting::Columns, columns);
        }
        let mut random = Random::new(seed ^ 1);
        let ground: Vec<bool> = (0..scan.len()).map(|_| random.uniform() < 0.2).collect();
        assert_is_dbscan(&scan, &ground, &parameters);
    }
}

#[test]
fn a_sweep_that_overlaps_itself_at_the_seam_is_clustered_as_defined() {
    let parameters = parameters();
    // The last columns and the fifth to seventh lie at the same azimuths.
    let mut twice = vec![0; 360 * 16];
    for column in (4..7).chain(357..360) {
        twice[column * 16 + 7] = 3000;
    }
    let random = (0..10).map(|seed| random_distances(seed, 360, 0.02));
    for distances in random.chain([twice]) {
        let scan = scan_of(&distances, 0.01, 364.0);
        assert_is_dbscan(&scan, &vec![false; scan.len()], &parameters);
    }
}

#[test]
fn what_is_exactly_as_far_as_neighbours_can_be_is_one() {
    let mut parameters = parameters();
    (parameters.min_points, parameters.min_points_far) = (1, 1);
    parameters.eps_per_m = 0.0;
    for near_cm in 120..500 {
        // Two returns to the left and to the right of where azimuths are 180 degrees, and others far
        // behind, but for straight behind: along x none is between the two.
        let mut distances = vec![0; 360 * 16];
        for column in (176..180).chain(181..185) {
            let is_end = column == 176 || column == 184;
            let far_cm = 5000 + 700 * (column as u16 % 8);
            distances[column * 16 + 7] = if is_end { near_cm } else { far_cm };
        }
        let scan = scan_of(&distances, 0.0001, 359.0001);
        let [left_m, right_m] = [176, 184].map(|column| scan.x_m()[scan.index(column, 7)]);
        parameters.eps_m = f64::from((left_m - right_m).abs());
        assert_is_dbscan(&scan, &vec![false; scan.len()], &parameters);
    }
}

#[test]
fn of_equally_near_core_points_a_border_point_goes_to_the_first() {
    let mut parameters = parameters();
    parameters.eps_per_m = 0.0;
    parameters.min_points_range_m = 100.0;
    for seed in 0..300 {
        // All at one range, so that many distances are alike.
        let mut random = Random::new(seed);
        let range_cm = 200 + random.below(3000);
        let is_there = |point: usize| !(40 * 16..140 * 16).contains(&point);
        let mut distance = |point| match is_there(point) && random.uniform() < 0.35 {
            true => range_cm as u16,
            false => 0,
        };
        let distances: Vec<u16> = (0..180 * 16).map(&mut distance).collect();
        parameters.eps_m = 0.00035 * range_cm as f64 * (1.0 + 1.3 * random.uniform());
        parameters.min_points = 3 + random.below(4);
        parameters.min_points_far = parameters.min_points;
        let scan = scan_of(&distances, 0.0001, 358.0001);
        assert_is_dbscan(&scan, &vec![false; scan.len()], &parameters);
    }
}

#[test]
fn runs_that_lead_away_from_the_sensor_are_joined_as_defined() {
    let mut parameters = parameters();
    (parameters.min_points, parameters.min_points_far) = (1, 1);
    parameters.eps_per_m = 0.0;
    for seed in 0..500 {
        let mut random = Random::new(seed);
        parameters.eps_m = 0.3 + 4.0 * random.uniform();
        let mut distances = vec![0; 360 * 16];
        for _ in 0..4 + random.below(12) {
            let (layer, first) = (random.below(16), random.below(360));
            let mut range_m = 1.0 + 6.0 * random.uniform();
            for column in first..first + 1 + random.below(30) {
                distances[column % 360 * 16 + layer] = (100.0 * range_m) as u16;
                range_m += parameters.eps_m * (0.6 + 0.35 * random.uniform());
            }
        }
        let scan = scan_of(&distances, 0.0001, 359.0001);
        assert_is_dbscan(&scan, &vec![false; scan.len()], &parameters);
    }
}

#[test]
#[cfg_attr(not(shared_data), ignore = "needs ../shared/data")]
fn a_real_revolution_is_clustered_as_defined() {
    let Some(path) = common::data("vlp16-sampleShort.rec") else {
        return;
    };
    let bytes = std::fs::read(path).unwrap();
    let entry = kreisel::wire::Recording::new(&bytes)
        .nth(2)
        .unwrap()
        .unwrap();
    let cloud = CompactPointCloud::decode(entry.envelope.payload, 0).unwrap();
    // Every fourth column: the definition takes quadratic time.
    let distances: Vec<u16> = cloud
        .distances
        .chunks_exact(32)
        .step_by(4)
        .flat_map(|column| column.chunks_exact(2))
        .map(|two| u16::from_be_bytes([two[0], two[1]]))
        .collect();
    let scan = scan_of(&distances, cloud.start_azimuth_deg, cloud.end_azimuth_deg);
    let above_road: Vec<bool> = scan.z_m().iter().map(|z| *z < -1.4).collect();
    let parameters = parameters();
    let compared = assert_is_dbscan(&scan, &above_road, &parameters);
    assert!(compared > 2000, "{compared} points are no test");
}
