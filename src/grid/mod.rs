//! The occupancy grid: what of the world is static, and what of it is free.
//!
//! `evidence` says what the rays of a column mean on the ground, `window` collects it for the
//! cells around the sensor so that each counts once, `model` turns it into log-odds, `map` keeps
//! them in tiles, `updates` chooses the tiles to send. Moving road users are left to the
//! objects: together the two are the hybrid model that Chen 2021 names in section 2.1.4.

mod evidence;

mod intervals;

mod map;

pub mod model;

mod updates;

mod window;

pub use map::{Map, TILE_CELLS, Tile};

use crate::cloud::{CAPACITY, MAX_LAYERS, Scan};
use crate::ego::{Placement, Sweep};
use crate::ground::Plane;
use crate::parameter::{choices, parameters};
use crate::time::Time;
use crate::track::Object;
use crate::wire::grid_tile::GridTile;
use evidence::Evidence;
use map::HEIGHT_UNIT_M;
use model::{InverseSensorModel, in_units, log_odds};
use updates::Updates;
use window::{Cell, Window};

choices! {
    /// What a ray says that nothing came back from.
    pub enum NoReturn {
        /// That all is free along it.
        Clear = "clear",
        /// That all is free along it up to a limit.
        Limit = "limit",
        /// Nothing: the surface may be black, wet or a mirror.
        Ignore = "ignore",
    }
}

parameters! {
    /// The occupancy grid of the static world.
    pub struct GridParameters "grid" {
        /// Whether a map is kept.
        enabled: bool = true, "";
        /// Side of a cell.
        cell_m: f64 = 0.1, in 0.05..=1.0, "m";
        /// Horizontal distance from the sensor up to which cells are updated. Cost grows with
        /// its square.
        reach_m: f64 = 50.0, thesis 10.0, in 1.0..=120.0, "m";
        /// Distance from the sensor beyond which the map is forgotten. A cell takes three bytes.
        keep_m: f64 = 200.0, in 5.0..=1000.0, "m";
        /// Smallest horizontal distance that the sensor can measure. Cells nearer than this
        /// have a constant low probability.
        nearest_m: f64 = 1.0, in 0.0..=10.0, "m";
        /// Probability that a cell is occupied which a ray passed right before the sensor.
        free_probability: f64 = 0.3, thesis 0.2, in 0.01..=0.49, "";
        /// How much that probability rises with each metre; it ends at one half.
        free_slope_per_m: f64 = 0.002, thesis 0.02, in 0.0..=0.5, "1/m";
        /// Probability that a cell is occupied in which a ray ended.
        hit_probability: f64 = 0.85, thesis 0.9, in 0.51..=0.99, "";
        /// Probability below which no cell falls, so that what comes to stand there appears
        /// soon.
        lowest_probability: f64 = 0.1, in 0.001..=0.49, "";
        /// Probability above which no cell rises, so that what leaves disappears soon.
        highest_probability: f64 = 0.96, in 0.51..=0.999, "";
        /// Height above the ground from which on a return is an obstacle. 0.08 shows kerbs.
        obstacle_low_m: f64 = 0.25, in 0.02..=2.0, "m";
        /// Height above the ground up to which a return is an obstacle. What is higher hangs
        /// over the road, and rays that pass higher free nothing.
        obstacle_high_m: f64 = 2.0, in 0.3..=10.0, "m";
        /// Height above the ground below which a ray behind an obstacle frees cells again: it
        /// went over it and comes down.
        low_pass_m: f64 = 0.6, in 0.05..=5.0, "m";
        /// What a ray says that nothing came back from.
        no_return: NoReturn = NoReturn::Limit, thesis NoReturn::Clear, "";
        /// Distance up to which such a ray frees cells where no_return is limit.
        no_return_limit_m: f64 = 50.0, in 0.0..=120.0, "m";
        /// Speed from which on a road user moves: its returns do not mark the map.
        moving_mps: f64 = 0.5, in 0.0..=10.0, "m/s";
        /// How far around its box returns are taken for its own.
        moving_margin_m: f64 = 0.4, in 0.0..=5.0, "m";
        /// kreisel.GridTile 2022: changed tiles after every revolution, and all tiles in turn.
        publish: bool = true, "";
        /// Most bytes of tiles that are sent, in thousands.
        budget_kb_per_s: f64 = 100.0, in 1.0..=100000.0, "kB/s";
        /// Time after which a subscriber that joins late, or loses a third of all datagrams,
        /// has the whole map within the grid's reach.
        refresh_s: f64 = 5.0, in 0.2..=600.0, "s";
        /// How often each tile is sent in that time, changed or not.
        refresh_rounds: usize = 8, in 1..=100, "";
        /// A tile whose datagram would be longer is sent with three levels of occupancy
        /// instead of fifteen.
        tile_bytes: usize = 1400, in 200..=65000, "bytes";
    }
}

/// The grid step: owns the map.
#[derive(Debug, Clone)]
pub struct Grid {
    parameters: GridParameters,
    /// Log-odds of a passed cell by its distance from the sensor in cells.
    passed: Vec<i16>,
    hit: i16,
    lowest: i16,
    highest: i16,
    map: Map,
    map_id: u32,
    epoch: Option<u32>,
    revolution: u32,
    window: Window,
    evidence: Evidence,
    /// Returns on road users that move.
    is_moving: Vec<bool>,
    hits: Vec<(Cell, u8)>,
    placements: Vec<Placement>,
    updates: Updates,
}

/// How far below the top of what was seen in a cell a ray must pass to say that it is gone, and
/// below which share of its height: windows let rays through, doors do not.
const BELOW_TOP_M: f32 = 0.15;
const BELOW_SHARE: f32 = 0.6;
/// Time from its first sight within which a road user that moves may have marked the map before
/// it was known to move.
const UNKNOWN_S: f64 = 1.5;

impl Grid {
    /// A grid that has seen nothing.
    pub fn new(parameters: &GridParameters) -> Self {
        let model = InverseSensorModel::new(parameters);
        let cell_m = parameters.cell_m;
        let reach_cells = (parameters.reach_m / cell_m) as usize + 2 * TILE_CELLS;
        let units = |probability: f64| in_units(log_odds(probability));
        let tile_m = cell_m * TILE_CELLS as f64;
        let tiles_within = |metres: f64| (2.0 * metres / tile_m) as usize;
        // The sensor moves during a sweep, and stands anywhere in its tile.
        let window_side = tiles_within(parameters.reach_m) + 4;
        let map_side = tiles_within(parameters.keep_m).max(window_side) + 2;
        Self {
            passed: (0..2 * reach_cells)
                .map(|cells| units(model.passed((cells as f64 + 0.5) * cell_m)))
                .collect(),
            hit: units(model.hit()),
            lowest: units(parameters.lowest_probability),
            highest: units(parameters.highest_probability),
            map: Map::new(map_side),
            map_id: 0,
            epoch: None,
            revolution: 0,
            window: Window::new(window_side),
            evidence: Evidence::default(),
            is_moving: Vec::with_capacity(CAPACITY),
            hits: Vec::with_capacity(CAPACITY),
            placements: vec![],
            updates: Updates::new(parameters),
            parameters: parameters.clone(),
        }
    }

    /// Forgets the map, for a session that begins anew.
    pub fn reset(&mut self) {
        self.epoch = None;
    }

    /// The map as it is.
    pub fn map(&self) -> &Map {
        &self.map
    }

    /// Tells maps apart: another one begins with the session, with a jump of the poses and of
    /// time.
    pub fn map_id(&self) -> u32 {
        self.map_id
    }

    /// Side of a cell.
    pub fn cell_m(&self) -> f64 {
        self.parameters.cell_m
    }

    /// Whether a map is kept.
    pub fn is_enabled(&self) -> bool {
        self.parameters.enabled
    }

    /// Hands the tiles that are to be sent at a time to `send`, the most urgent first.
    pub fn publish(&mut self, now: Time, sweep: &Sweep, mut send: impl FnMut(&GridTile)) {
        if !self.parameters.enabled || !self.parameters.publish {
            return;
        }
        let tile_m = self.parameters.cell_m * TILE_CELLS as f64;
        let [x, y, _] = sweep.sensor.position_m;
        let chosen = self
            .updates
            .choose(&mut self.map, now, [x / tile_m, y / tile_m]);
        for place in chosen {
            let tile = self.map.tile_mut(*place);
            let message = GridTile {
                map_id: self.map_id,
                revision: tile.revision,
                frame: sweep.frame.number(),
                tile_x: place[0],
                tile_y: place[1],
                cells_per_side: TILE_CELLS as u32,
                cell_size: self.parameters.cell_m,
                ..GridTile::default()
            };
            let message = message.with_cells(std::mem::take(&mut tile.encoded));
            send(&message);
            tile.encoded = message.cells.0;
        }
    }

    /// Takes a revolution in: its points, which of them are `ground`, their heights above it,
    /// and the road users, whose places are valid at the end of the sweep.
    pub fn process(
        &mut self,
        scan: &Scan,
        ground: &[bool],
        heights_m: &[f32],
        plane: &Plane,
        objects: &[Object],
        sweep: &Sweep,
    ) {
        if !self.parameters.enabled {
            return;
        }
        self.begin_map(sweep, scan.time());
        self.revolution += 1;
        let sensor = sweep.sensor.placement().origin_m();
        let tile_m = self.parameters.cell_m * TILE_CELLS as f64;
        let tile_of = |at_m: [f64; 2]| at_m.map(|metres| libm::floor(metres / tile_m) as i32);
        let home = tile_of(sensor);
        self.map.keep_around(home);
        let half = (self.window.side() / 2) as i32;
        self.window.begin(home.map(|tile| tile - half));
        self.evidence
            .begin(scan, plane, ground, heights_m, &self.parameters);
        self.is_moving.clear();
        self.is_moving.resize(scan.len(), false);
        for object in objects {
            self.note_moving(scan, object, sweep);
        }
        sweep.placements(scan.columns(), &mut self.placements);
        self.collect(scan, heights_m);
        self.free_cells(scan, sweep);
        self.occupy_cells();
        for object in objects {
            self.clear_way(object, scan.time());
        }
    }

    /// A new map where positions before and after cannot be compared.
    fn begin_map(&mut self, sweep: &Sweep, time: Time) {
        if self.epoch == Some(sweep.epoch) {
            return;
        }
        self.epoch = Some(sweep.epoch);
        self.map.clear();
        self.revolution = 0;
        // Other runs of the service began at other times.
        let from_time = (time.micros() / 10_000) as u32;
        self.map_id = if from_time == self.map_id {
            from_time.wrapping_add(1)
        } else {
            from_time
        };
    }

    /// Whether a road user is seen to move, without a doubt.
    fn moves(&self, object: &Object) -> bool {
        let least_mps = self.parameters.moving_mps + object.speed_deviation_mps;
        object.measured && libm::fabs(object.speed_mps) > least_mps
    }

    /// Marks the returns on a road user that moves. Each was where it was when it was seen.
    fn note_moving(&mut self, scan: &Scan, object: &Object, sweep: &Sweep) {
        if !self.moves(object) {
            return;
        }
        let placement = sweep.sensor.placement();
        let mut rectangle = object.rectangle();
        let (sine, cosine) = libm::sincos(object.yaw_rad);
        let velocity_mps = [object.speed_mps * cosine, object.speed_mps * sine];
        rectangle.length_m += object.speed_mps.abs() * scan.duration_s();
        let corners = rectangle.corners().map(|corner| placement.sensor_m(corner));
        let Some((first, count)) = scan.columns_across(&corners) else {
            return;
        };
        let outline = object.rectangle().outline();
        let margin_m = self.parameters.moving_margin_m;
        // The margin is wider than a few columns only near the sensor.
        let distance_m = libm::hypot(corners[0][0], corners[0][1]).max(1.0);
        let aside = (margin_m / (distance_m * libm::fabs(scan.step_rad()))) as usize + 1;
        let columns = scan.columns();
        let first = (first + columns - aside.min(columns)) % columns;
        for column in (first..first + (count + 2 * aside).min(columns)).map(|n| n % columns) {
            let age_s = scan.age_s(column);
            for layer in 0..MAX_LAYERS {
                let point = scan.index(column, layer);
                if !scan.has_return(point) {
                    continue;
                }
                let [x, y, _] = scan.point_m(point).map(f64::from);
                let [x, y] = sweep
                    .pose(column as f64 / columns as f64)
                    .placement()
                    .local_m([x, y]);
                let then = [x + age_s * velocity_mps[0], y + age_s * velocity_mps[1]];
                self.is_moving[point] |= outline.distance_m(then) <= margin_m;
            }
        }
    }

    /// Where something moves nothing stands: takes back what was seen in its box, and, as long
    /// as it is new, in those before.
    fn clear_way(&mut self, object: &Object, now: Time) {
        if !self.moves(object) {
            return;
        }
        let age_s = (now - object.first_seen).seconds();
        let back_m = if age_s < UNKNOWN_S {
            object.speed_mps * age_s
        } else {
            0.0
        };
        let mut way = object.rectangle();
        let (sine, cosine) = libm::sincos(object.yaw_rad);
        way.centre_m[0] -= 0.5 * back_m * cosine;
        way.centre_m[1] -= 0.5 * back_m * sine;
        way.length_m += libm::fabs(back_m);
        let outline = way.outline();
        let cell_m = self.parameters.cell_m;
        let corners = way.corners();
        let bound = |axis: usize, pick: fn(f64, f64) -> f64| {
            let of_axis = corners.iter().map(|corner| corner[axis] / cell_m);
            libm::floor(of_axis.reduce(pick).unwrap_or(0.0)) as i32
        };
        for y in bound(1, f64::min)..=bound(1, f64::max) {
            for x in bound(0, f64::min)..=bound(0, f64::max) {
                let middle_m = [x, y].map(|at| (f64::from(at) + 0.5) * cell_m);
                if outline.distance_m(middle_m) > 0.0 {
                    continue;
                }
                if let Some((tile, place)) = self.map.cell_mut([x, y])
                    && tile.log_odds[place] > 0
                {
                    tile.set(place, 0, self.revolution);
                }
            }
        }
    }

    /// Marks cells that rays passed, and those in which rays ended.
    fn collect(&mut self, scan: &Scan, heights_m: &[f32]) {
        self.hits.clear();
        let per_cell = 1.0 / self.parameters.cell_m;
        let corner = self.window.corner();
        let reach_m = self.parameters.reach_m as f32;
        // A beam is nearly as wide as the step from column to column (VLP-16 user manual: 3
        // mrad). Where that is more than a cell, it is cast as several rays beside each other.
        let step_rad = libm::fabs(scan.step_rad());
        let dense_m = self.parameters.cell_m / step_rad;
        let beams = libm::ceil(self.parameters.reach_m / dense_m) as usize;
        for column in 0..scan.columns() {
            let placement = self.placements[column];
            let cells = |at_m: [f64; 2]| [0, 1].map(|axis| at_m[axis] * per_cell - corner[axis]);
            for layer in 0..MAX_LAYERS {
                let point = scan.index(column, layer);
                let near = |distance_m: &f32| *distance_m <= reach_m && !self.is_moving[point];
                if self.evidence.obstacle_m(point).filter(near).is_none() {
                    continue;
                }
                let [x, y, _] = scan.point_m(point).map(f64::from);
                if let Some(cell) = self.window.hit(cells(placement.local_m([x, y]))) {
                    let top = (heights_m[point] / HEIGHT_UNIT_M) as u8;
                    self.hits.push((cell, top));
                }
            }
            let [sine, cosine] = scan.direction(column).map(f64::from);
            let passed = self.evidence.passed(column, scan, &self.parameters);
            let at = |metres: f64, aside: f64| {
                let (right, ahead) = (sine + aside * cosine, cosine - aside * sine);
                cells(placement.local_m([metres * right, metres * ahead]))
            };
            for (from_m, to_m) in passed.iter() {
                let (from_m, to_m) = (f64::from(from_m), f64::from(to_m));
                if from_m < dense_m {
                    self.window
                        .pass(at(from_m, 0.0), at(to_m.min(dense_m), 0.0));
                }
                if to_m > dense_m {
                    for n in 0..beams {
                        let aside = scan.step_rad() * ((n as f64 + 0.5) / beams as f64 - 0.5);
                        self.window
                            .pass(at(from_m.max(dense_m), aside), at(to_m, aside));
                    }
                }
            }
        }
    }

    /// Takes the evidence of free space in.
    fn free_cells(&mut self, scan: &Scan, sweep: &Sweep) {
        let placement = sweep.sensor.placement();
        let cell_m = self.parameters.cell_m;
        let sensor = placement.origin_m().map(|metres| metres / cell_m);
        for y in 0..self.window.side() {
            for x in 0..self.window.side() {
                let is_seen = |row: usize| self.window.free(x, y, row) != 0;
                if !(0..TILE_CELLS).any(is_seen) {
                    continue;
                }
                let place = self.window.tile(x, y);
                let tile = self.map.tile_mut(place);
                for row in 0..TILE_CELLS {
                    let mut cells = self.window.free(x, y, row) & !tile.surely_free[row];
                    let north = f64::from(place[1]) * TILE_CELLS as f64 + row as f64 + 0.5;
                    let up = north - sensor[1];
                    while cells != 0 {
                        let column = cells.trailing_zeros() as usize;
                        cells &= cells - 1;
                        let east = f64::from(place[0]) * TILE_CELLS as f64 + column as f64 + 0.5;
                        let right = east - sensor[0];
                        let distance = libm::sqrt(right * right + up * up);
                        let cell = row * TILE_CELLS + column;
                        let before = tile.log_odds[cell];
                        if before > 0 {
                            let at = placement.sensor_m([east * cell_m, north * cell_m]);
                            let azimuth = scan.column_at(libm::atan2(at[0], at[1]));
                            let top_m = f32::from(tile.top[cell]) * HEIGHT_UNIT_M;
                            let distance_m = (distance * cell_m) as f32;
                            let pass_m = self.evidence.lowest_pass_m(azimuth, distance_m);
                            if pass_m > (BELOW_SHARE * top_m).min(top_m - BELOW_TOP_M) {
                                continue;
                            }
                        }
                        let step = self.passed[(distance as usize).min(self.passed.len() - 1)];
                        let after = (before + step).max(self.lowest);
                        tile.set(cell, after, self.revolution);
                        if after == self.lowest {
                            tile.surely_free[row] |= 1 << column;
                        }
                    }
                }
            }
        }
    }

    /// Takes the returns in.
    fn occupy_cells(&mut self) {
        for (cell, top) in &self.hits {
            let ([x, y], place) = cell.in_tile();
            let tile = self.map.tile_mut(self.window.tile(x, y));
            if self.window.take_hit(*cell) {
                let before = tile.log_odds[place];
                let after = (before + self.hit).min(self.highest);
                tile.set(place, after, self.revolution);
                tile.surely_free[place / TILE_CELLS] &= !(1 << (place % TILE_CELLS));
            }
            tile.top[place] = tile.top[place].max(*top);
        }
    }
}
