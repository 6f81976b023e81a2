//! The occupancy grid over made-up worlds of boxes on flat ground, and what a subscriber that
//! loses datagrams has of it.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::BTreeMap;

use kreisel::config::Configuration;
use kreisel::grid::{TILE_CELLS, model};
use kreisel::pipeline::{Outcome, Pipeline};
use kreisel::random::Random;
use kreisel::time::{Span, Time};
use kreisel::wire::envelope::Postmark;
use kreisel::wire::grid_tile::GridTile;
use kreisel::wire::point_cloud::CompactPointCloud;
use kreisel::wire::pose::SimulationFrame;
use kreisel::wire::{Envelope, Message};

/// A sensor and how it stands.
struct Mounted {
    height_m: f64,
    columns: usize,
    azimuths_deg: [f64; 2],
    elevations_deg: &'static [f64],
}

const VLP16: Mounted = Mounted {
    height_m: 2.0,
    columns: 1800,
    azimuths_deg: [0.1, 359.9],
    elevations_deg: &[
        -15.0, -13.0, -11.0, -9.0, -7.0, -5.0, -3.0, -1.0, 1.0, 3.0, 5.0, 7.0, 9.0, 11.0, 13.0,
        15.0,
    ],
};

/// Above the bumper of a car.
const IBEO_LUX_8L: Mounted = Mounted {
    height_m: 0.6,
    columns: 441,
    azimuths_deg: [-50.0, 60.0],
    elevations_deg: &[-2.8, -2.0, -1.2, -0.4, 0.4, 1.2, 2.0, 2.8],
};

/// A box: low and high corner.
type Box3 = [[f64; 3]; 2];

// Faces stand in the middle of cells, so that rounding does not matter.
const WALL: Box3 = [[-6.05, 8.05, 0.0], [6.05, 8.45, 2.5]];
const CAR: Box3 = [[4.05, 2.05, 0.2], [5.85, 6.45, 1.5]];

struct Drive {
    pipeline: Pipeline,
    now: Time,
    /// Place of the sensor; it looks north.
    sensor_m: [f64; 2],
    has_poses: bool,
    /// How far the poses are off.
    pose_off_m: [f64; 2],
    sensor: Mounted,
}

impl Drive {
    fn with(edit: impl Fn(&mut Configuration)) -> Self {
        let mut configuration = Configuration::default();
        edit(&mut configuration);
        Self {
            pipeline: Pipeline::new(&configuration, 0),
            now: Time::from_micros(1_700_000_000_000_000),
            sensor_m: [0.0; 2],
            has_poses: false,
            pose_off_m: [0.0; 2],
            sensor: VLP16,
        }
    }

    fn standing() -> Self {
        Self::with(|_| {})
    }

    fn send(&mut self, frame: &[u8]) {
        let (envelope, _) = Envelope::from_datagram(frame).unwrap();
        let outcome = self.pipeline.handle(&envelope).unwrap();
        assert!(matches!(outcome, Outcome::Revolution(_) | Outcome::Pose));
    }

    /// Turns the sensor once in a world, and gives the tiles that are sent.
    fn revolve(&mut self, world: &[Box3]) -> Vec<GridTile> {
        let distances = ranges(&self.sensor, self.sensor_m, world);
        let cloud = CompactPointCloud {
            start_azimuth_deg: self.sensor.azimuths_deg[0] as f32,
            end_azimuth_deg: self.sensor.azimuths_deg[1] as f32,
            layers: self.sensor.elevations_deg.len() as u8,
            distances: &distances,
            ..CompactPointCloud::default()
        };
        for step in 1..=10 {
            let sampled = self.now + Span::from_seconds(0.01 * f64::from(step));
            let pose = SimulationFrame {
                x: (self.sensor_m[0] + self.pose_off_m[0]) as f32,
                y: (self.sensor_m[1] + self.pose_off_m[1]) as f32,
                yaw: std::f32::consts::FRAC_PI_2,
                ..SimulationFrame::default()
            };
            let mut frame = vec![];
            postmark(sampled).put(&mut frame, &pose);
            if self.has_poses {
                self.send(&frame);
            }
        }
        self.now = self.now + Span::from_seconds(0.1);
        let mut frame = vec![];
        postmark(self.now).put_payload(&mut frame, 49, |out| cloud.encode(out));
        self.send(&frame);
        self.pipeline.update_map();
        let frames = self.pipeline.publish_map(self.now);
        let envelopes = frames.map(|frame| Envelope::from_datagram(frame).unwrap().0);
        envelopes
            .filter(|envelope| envelope.data_type == GridTile::ID)
            .map(|envelope| GridTile::decode(envelope.payload, 0).unwrap())
            .collect()
    }

    fn revolve_for(&mut self, revolutions: usize, world: &[Box3]) {
        for _ in 0..revolutions {
            self.revolve(world);
        }
    }

    /// Probability that the cell at a place is occupied.
    fn probability(&self, at_m: [f64; 2]) -> f64 {
        let side = TILE_CELLS as i32;
        let cell = at_m.map(|metres| (metres / self.pipeline.grid().cell_m()).floor() as i32);
        let Some(tile) = self
            .pipeline
            .grid()
            .map()
            .tile(cell.map(|at| at.div_euclid(side)))
        else {
            return 0.5;
        };
        let [x, y] = cell.map(|at| at.rem_euclid(side) as usize);
        let log_odds = tile.log_odds()[y * TILE_CELLS + x];
        model::probability(f64::from(log_odds) / model::UNITS)
    }

    /// Cells along a way that are occupied.
    fn occupied(&self, from_m: [f64; 2], to_m: [f64; 2]) -> usize {
        let steps = 200;
        let mut cells = std::collections::BTreeSet::new();
        for step in 0..=steps {
            let share = f64::from(step) / f64::from(steps);
            let at_m = [0, 1].map(|axis| from_m[axis] + share * (to_m[axis] - from_m[axis]));
            if self.probability(at_m) > 0.5 {
                cells.insert(at_m.map(|metres| (10.0 * metres).floor() as i32));
            }
        }
        cells.len()
    }
}

fn postmark(sampled: Time) -> Postmark {
    Postmark {
        sent: sampled,
        sampled,
        sender_stamp: 0,
    }
}

/// Distances of a revolution in centimetres: boxes on flat ground.
fn ranges(sensor: &Mounted, sensor_m: [f64; 2], world: &[Box3]) -> Vec<u8> {
    let origin = [sensor_m[0], sensor_m[1], sensor.height_m];
    let [first_deg, last_deg] = sensor.azimuths_deg;
    let mut out = vec![];
    for column in 0..sensor.columns {
        let share = column as f64 / (sensor.columns - 1) as f64;
        let azimuth_rad = (first_deg + share * (last_deg - first_deg)).to_radians();
        for elevation_deg in sensor.elevations_deg {
            let elevation_rad = elevation_deg.to_radians();
            let direction = [
                azimuth_rad.sin() * elevation_rad.cos(),
                azimuth_rad.cos() * elevation_rad.cos(),
                elevation_rad.sin(),
            ];
            let ground_m = -sensor.height_m / direction[2];
            let ground_m = if ground_m > 0.0 { ground_m } else { f64::MAX };
            let boxes = world
                .iter()
                .filter_map(|solid| entry_m(solid, origin, direction));
            let range_m = boxes.fold(ground_m, f64::min);
            let units = if range_m < 100.0 {
                (100.0 * range_m) as u16
            } else {
                0
            };
            out.extend_from_slice(&units.to_be_bytes());
        }
    }
    out
}

/// Where a ray enters a box.
fn entry_m([low, high]: &Box3, origin: [f64; 3], direction: [f64; 3]) -> Option<f64> {
    let (mut enter, mut leave) = (0.0f64, f64::MAX);
    for axis in 0..3 {
        let a = (low[axis] - origin[axis]) / direction[axis];
        let b = (high[axis] - origin[axis]) / direction[axis];
        (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
    }
    (enter < leave && enter > 0.0).then_some(enter)
}

#[test]
fn a_wall_is_occupied_the_way_to_it_free_and_what_is_behind_unknown() {
    let mut drive = Drive::standing();
    drive.revolve_for(5, &[WALL]);
    assert!(drive.probability([0.0, 8.05]) > 0.9);
    for y in [0.3, 2.0, 5.0, 7.0, 7.8] {
        assert!(drive.probability([0.0, y]) < 0.3, "{y}");
    }
    for y in [8.3, 9.0, 12.0] {
        assert_eq!(drive.probability([0.0, y]), 0.5, "{y}");
    }
    assert!(drive.occupied([-5.9, 8.05], [5.9, 8.05]) >= 115);
}

#[test]
fn a_sensor_of_eight_layers_and_a_part_of_the_circle_maps_what_it_sees() {
    let mut drive = Drive::standing();
    drive.sensor = IBEO_LUX_8L;
    let far = [[-8.05, 30.05, 0.0], [8.05, 30.45, 2.5]];
    let aside = [[20.05, -6.0, 0.0], [20.45, 6.0, 2.5]];
    drive.revolve_for(10, &[far, aside]);
    // Returns are 13 cm apart there.
    assert!(drive.occupied([-7.9, 30.05], [7.9, 30.05]) >= 110);
    for y in [0.5, 3.0, 12.0, 25.0, 29.5] {
        assert!(drive.probability([0.0, y]) < 0.5, "{y}");
    }
    // Behind the wall, beside the field of view, behind the sensor.
    for at_m in [[0.0, 32.0], [20.05, 0.0], [10.0, 0.0], [0.0, -10.0]] {
        assert_eq!(drive.probability(at_m), 0.5, "{at_m:?}");
    }
}

#[test]
fn a_low_obstacle_does_not_hide_the_wall_behind_it_and_a_bridge_is_no_obstacle() {
    let low = [[-2.05, 5.05, 0.0], [2.05, 5.35, 0.9]];
    let bridge = [[-20.0, -9.0, 3.0], [20.0, -6.0, 3.5]];
    let mut drive = Drive::standing();
    drive.revolve_for(5, &[low, WALL, bridge]);
    assert!(drive.probability([0.0, 5.05]) > 0.9);
    assert!(drive.probability([0.0, 8.05]) > 0.9);
    assert_eq!(drive.occupied([0.0, -30.0], [0.0, -1.0]), 0);
    assert!(drive.probability([0.0, -7.0]) < 0.3);
}

#[test]
fn kerbs_are_a_matter_of_configuration() {
    let kerb = [[-6.05, 9.65, 0.0], [6.05, 10.05, 0.2]];
    let occupied = |obstacle_low_m: f64| {
        let mut drive = Drive::with(|configuration| {
            configuration.grid.obstacle_low_m = obstacle_low_m;
            configuration.ground.model = kreisel::ground::Model::Plane;
            configuration.ground.mark_distance_m = 0.05;
        });
        drive.revolve_for(5, &[kerb]);
        drive.occupied([-1.5, 9.65], [1.5, 9.65])
    };
    assert_eq!(occupied(0.25), 0);
    assert!(occupied(0.08) > 20);
}

#[test]
fn what_leaves_disappears_within_a_second_and_what_parks_appears() {
    let mut drive = Drive::standing();
    let side = ([4.05, 2.1], [4.05, 6.3]);
    drive.revolve_for(30, &[CAR, WALL]);
    assert!(drive.occupied(side.0, side.1) >= 35);
    drive.revolve_for(10, &[WALL]);
    assert_eq!(drive.occupied(side.0, side.1), 0);
    drive.revolve_for(30, &[WALL]);
    drive.revolve_for(5, &[CAR, WALL]);
    assert!(drive.occupied(side.0, side.1) >= 35);
}

#[test]
fn a_map_that_began_takes_a_half_of_the_circle_in_at_a_time() {
    let boxes = [-6.0, 6.0].map(|x| [[x - 0.45, -1.0, 0.0], [x + 0.45, 1.0, 1.5]]);
    let near_m = boxes.map(|[low, high]| if high[0] < 0.0 { high[0] } else { low[0] });
    let seen = |drive: &Drive| near_m.map(|x| drive.probability([x, 0.0]) > 0.5);
    let mut drive = Drive::standing();
    drive.revolve(&boxes);
    assert_eq!(seen(&drive), [true; 2]);
    drive.revolve_for(20, &[]);
    assert_eq!(seen(&drive), [false; 2]);
    let before = near_m.map(|x| drive.probability([x, 0.0]));
    let mut changes = vec![];
    for _ in 0..4 {
        drive.revolve(&boxes);
        let after = near_m.map(|x| drive.probability([x, 0.0]));
        changes.push([0, 1].map(|side| after[side] > before[side]));
    }
    assert_ne!(changes[0][0], changes[0][1]);
    assert_eq!(changes[1], [true; 2]);
    assert_eq!(seen(&drive), [true; 2]);
}

#[test]
fn what_moves_leaves_no_trail() {
    let mut drive = Drive::standing();
    let car = |step: usize| {
        let y = -25.0 + 0.7 * step as f64;
        [[4.05, y, 0.2], [5.85, y + 4.4, 1.5]]
    };
    let lines = [4.05, 4.45, 4.95, 5.45, 5.85];
    for step in 0..60 {
        drive.revolve(&[car(step), WALL]);
        let behind_m = -25.0 + 0.7 * (step.max(10) - 10) as f64;
        let left = lines.map(|x| drive.occupied([x, -26.0], [x, behind_m]));
        let left: usize = left.iter().sum();
        // It was a while until it was known to move, and farther than rays pass low.
        assert!(left <= 9, "{step} {left}");
    }
    let cells = lines.len() * 350;
    let left = lines.map(|x| drive.occupied([x, -26.0], [x, 9.0]));
    assert!(50 * left.iter().sum::<usize>() <= cells, "{left:?}");
}

#[test]
fn a_map_holds_over_a_drive_and_a_jump_of_the_poses() {
    let mut drive = Drive::standing();
    drive.has_poses = true;
    drive.revolve(&[WALL, CAR]);
    let first = drive.pipeline.grid().map_id();
    for step in 0..40 {
        drive.sensor_m = [0.05 * f64::from(step), 0.1 * f64::from(step)];
        drive.revolve(&[WALL, CAR]);
    }
    assert_eq!(drive.pipeline.grid().map_id(), first);
    assert!(drive.occupied([-5.9, 8.05], [5.9, 8.05]) >= 115);
    // No double image.
    for y in [7.65, 7.75, 8.45, 8.55] {
        assert_eq!(drive.occupied([-5.9, y], [5.9, y]), 0, "{y}");
    }
    // The source jumps, the sensor does not: the map stays, and the tiles say where it lies now.
    drive.pose_off_m = [5.0, 0.0];
    let tiles: Vec<_> = (0..20).flat_map(|_| drive.revolve(&[WALL, CAR])).collect();
    assert_eq!(drive.pipeline.grid().map_id(), first);
    assert!(drive.occupied([-5.9, 8.05], [5.9, 8.05]) >= 115);
    let [first_m, last_m] = [tiles.first(), tiles.last()].map(|tile| tile.unwrap().anchor_x);
    assert!(
        first_m.abs() < 0.1 && (last_m - 5.0).abs() < 0.1,
        "{first_m} {last_m}"
    );
}

#[test]
fn a_map_ends_where_the_sensor_is_set_down_elsewhere() {
    const HOUSE: Box3 = [[-4.05, -9.05, 0.0], [7.05, -5.05, 4.0]];
    let mut drive = Drive::standing();
    drive.revolve_for(5, &[WALL, CAR]);
    let first = drive.pipeline.grid().map_id();
    drive.sensor_m = [50.0, 0.0];
    let elsewhere = HOUSE.map(|[x, y, z]| [x + 50.0, y, z]);
    drive.revolve_for(15, &[elsewhere]);
    assert_ne!(drive.pipeline.grid().map_id(), first);
}

#[test]
fn far_behind_the_map_is_forgotten() {
    let mut drive = Drive::with(|configuration| {
        (configuration.grid.keep_m, configuration.grid.reach_m) = (15.0, 10.0);
    });
    drive.has_poses = true;
    for step in 0..80 {
        drive.sensor_m = [0.0, -f64::from(step)];
        drive.revolve(&[WALL]);
        assert!(drive.pipeline.grid().map().tiles().count() < 60, "{step}");
    }
    assert_eq!(drive.probability([0.0, 8.05]), 0.5);
}

#[test]
fn without_a_return_a_ray_clears_what_one_wants() {
    // Over flat ground the flattest rays come back from nothing: the ground is too far.
    let free = |choice: kreisel::grid::NoReturn| {
        let mut drive = Drive::with(|configuration| {
            configuration.grid.no_return = choice;
            configuration.grid.no_return_limit_m = 43.0;
        });
        drive.revolve_for(5, &[]);
        [40.0, 46.0].map(|y| drive.probability([0.0, y]) < 0.5)
    };
    assert_eq!(free(kreisel::grid::NoReturn::Clear), [true, true]);
    assert_eq!(free(kreisel::grid::NoReturn::Limit), [true, false]);
    assert_eq!(free(kreisel::grid::NoReturn::Ignore), [false, false]);
}

#[test]
fn a_subscriber_that_loses_a_third_of_all_datagrams_has_the_map_after_the_refresh_time() {
    let mut drive = Drive::standing();
    let world = [WALL, CAR];
    drive.revolve_for(50, &world);
    for seed in 0..5 {
        let mut random = Random::new(seed);
        let (mut heard, mut bytes) = (BTreeMap::new(), 0);
        let refresh_s = Configuration::default().grid.refresh_s;
        for _ in 0..(10.0 * refresh_s) as usize {
            for tile in drive.revolve(&world) {
                bytes += tile.cells.0.len() + 80;
                if random.uniform() > 1.0 / 3.0 {
                    let levels = tile.levels(drive.pipeline.grid().map_id()).unwrap();
                    let side = tile.cells_per_side as usize;
                    for (cell, level) in levels.into_iter().enumerate() {
                        let corner = [tile.tile_x, tile.tile_y].map(|at| at * side as i32);
                        let at = [cell % side, cell / side].map(|at| at as i32);
                        heard.insert([corner[0] + at[0], corner[1] + at[1]], level);
                    }
                }
            }
        }
        let mut cells_off = 0;
        for tile in drive.pipeline.grid().map().tiles() {
            let [x, y] = tile.place().map(|at| (f64::from(at) + 0.5) * 6.4);
            if x.hypot(y) < 50.0 {
                let corner = tile.place().map(|at| at * TILE_CELLS as i32);
                let of = |cell: usize| {
                    let at = [cell % TILE_CELLS, cell / TILE_CELLS].map(|at| at as i32);
                    heard[&[corner[0] + at[0], corner[1] + at[1]]]
                };
                let kinds = tile.levels().enumerate();
                cells_off += kinds
                    .filter(|(cell, own)| own.signum() != of(*cell).signum())
                    .count();
            }
        }
        assert!(cells_off < 20, "{cells_off}");
        assert!((bytes as f64) < 60_000.0 * refresh_s, "{bytes}");
    }
}

#[test]
fn in_a_drive_all_tiles_come_round_as_often() {
    let mut drive = Drive::standing();
    drive.has_poses = true;
    let mut random = Random::new(2);
    let world: Vec<Box3> = (0..60)
        .map(|_| {
            let side = if random.uniform() < 0.5 { -1.0 } else { 1.0 };
            let (x, y) = (
                side * (4.0 + 30.0 * random.uniform()),
                120.0 * random.uniform(),
            );
            let size = 0.3 + 3.0 * random.uniform();
            [
                [x, y, 0.0],
                [x + size, y + size, 0.5 + 2.0 * random.uniform()],
            ]
        })
        .collect();
    let mut sent = BTreeMap::new();
    for step in 0..80 {
        drive.sensor_m = [0.0, 0.8 * f64::from(step)];
        for tile in drive.revolve(&world) {
            if step >= 30 {
                // Several along a side are sent at once.
                let side = tile.cells_per_side as i32 / TILE_CELLS as i32;
                for east in 0..side {
                    for north in 0..side {
                        let place = [tile.tile_x * side + east, tile.tile_y * side + north];
                        *sent.entry(place).or_insert(0) += 1;
                    }
                }
            }
        }
    }
    // Five seconds, in which these were within reach all the time.
    let all = drive.pipeline.grid().map().tiles().map(|tile| tile.place());
    let near = all.filter(|[x, y]| {
        let [x, y] = [*x, *y].map(|at| (f64::from(at) + 0.5) * 6.4);
        [24.0, 64.0].iter().all(|from| x.hypot(y - from) < 45.0)
    });
    let counts: Vec<i32> = near
        .map(|place| sent.get(&place).copied().unwrap_or(0))
        .collect();
    assert!(counts.len() > 30, "{}", counts.len());
    assert!(counts.iter().all(|count| *count >= 6), "{counts:?}");
}
