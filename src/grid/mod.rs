//! The occupancy grid: what of the world is static, and what of it is free.
//!
//! Of a revolution a part of the circle is taken in: `evidence` says what the rays of its columns mean
//! on the ground, and on which `stretches` they passed, `casting` draws them into the `window` of cells around the sensor, where each counts once,
//! `model` and `filter` turn that into log-odds, `map` keeps them in tiles, `updates` chooses the tiles to send. Road users that
//! move (`moving`) are left to the objects: together the two are the hybrid model that Chen 2021
//! names in section 2.1.4.

mod casting;

mod evidence;

mod filter;

mod map;

pub mod model;

mod moving;

mod stretches;

mod updates;

mod window;

pub use map::{Map, TILE_CELLS, Tile};

use std::ops::Range;

use crate::cloud::{CAPACITY, Scan};
use crate::ego::{Anchor, Placement, Sweep};
use crate::ground::Plane;
use crate::parameter::{choices, parameters};
use crate::time::Time;
use crate::track::Object;
use crate::wire::grid_tile::GridTile;
use casting::Casting;
use evidence::Evidence;
use filter::{Filter, View};
use map::HEIGHT_UNIT_M;
use stretches::Stretch;
use updates::{SHEET_CELLS, Updates};
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
        /// Distance from the sensor beyond which the map is forgotten. A cell takes three bytes: within 200 m cells of 0.1 m
        /// take up to 48 MB; more than 2 GB are refused.
        keep_m: f64 = 200.0, in 5.0..=1000.0, "m";
        /// In how many revolutions all around the sensor is taken in, a part of the circle in each:
        /// what stands need not be looked at every time. A map that has just begun takes all in.
        turns: usize = 2, thesis 1, in 1..=10, "revolutions";
        /// Smallest horizontal distance that the sensor can measure. Cells nearer than this
        /// have a constant low probability.
        nearest_m: f64 = 1.0, in 0.0..=10.0, "m";
        /// Probability that a cell is occupied which a ray passed right before the sensor.
        free_probability: f64 = 0.16, thesis 0.2, in 0.01..=0.49, "";
        /// How much that probability rises with each metre; it ends at one half.
        free_slope_per_m: f64 = 0.003, thesis 0.02, in 0.0..=0.5, "1/m";
        /// Probability that a cell is occupied in which a ray ended.
        hit_probability: f64 = 0.85, thesis 0.9, in 0.51..=0.99, "";
        /// Probability below which no cell falls, so that what comes to stand there appears
        /// soon.
        lowest_probability: f64 = 0.1, in 0.001..=0.4, "";
        /// Probability above which no cell rises, so that what leaves disappears soon.
        highest_probability: f64 = 0.96, in 0.6..=0.999, "";
        /// Height above the ground from which on a return is an obstacle. 0.08 shows kerbs where ground.mark_distance_m
        /// is 0.06; else they are ground.
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
        budget_kb_per_s: f64 = 150.0, in 1.0..=100000.0, "kB/s";
        /// Time after which a subscriber that joins late, or loses a third of all datagrams,
        /// has the whole map within the grid's reach, as far as the budget suffices.
        refresh_s: f64 = 5.0, in 0.2..=600.0, "s";
        /// How often each tile is sent in that time, changed or not.
        refresh_rounds: usize = 7, in 1..=100, "";
        /// A tile whose datagram would be longer is sent with three levels of occupancy
        /// instead of fifteen, and in any case whole.
        tile_bytes: usize = 1400, in 200..=65000, "bytes";
    }
}

impl GridParameters {
    /// What a map takes at most, in megabytes.
    pub fn most_mb(&self) -> f64 {
        const CELL_BYTES: f64 = 3.0;
        let side = 2.0 * self.keep_m / self.cell_m;
        1e-6 * CELL_BYTES * side * side
    }
}

/// The grid step: owns the map.
#[derive(Debug, Clone)]
pub struct Grid {
    parameters: GridParameters,
    filter: Filter,
    map: Map,
    map_id: u32,
    anchor: Anchor,
    epoch: Option<u32>,
    /// Counts the revolutions of the map.
    revolution: u32,
    updates: Updates,
    window: Window,
    evidence: Evidence,
    casting: Casting,
    passed: Vec<Stretch>,
    /// Cells in which rays ended, and how high.
    hits: Vec<(Cell, u8)>,
    /// Obstacles that are returns on road users that move.
    is_moving: Vec<bool>,
}

/// A revolution as the steps before left it.
#[derive(Debug, Clone, Copy)]
pub struct Perceived<'a> {
    /// Its points.
    pub scan: &'a Scan,
    /// Which of them are ground.
    pub ground: &'a [bool],
    /// Their heights above it.
    pub heights_m: &'a [f32],
    /// The ground around the sensor.
    pub plane: &'a Plane,
    /// Road users, where they are at the end of the sweep.
    pub objects: &'a [Object],
    /// Where the sensor was.
    pub sweep: &'a Sweep,
    /// How the points of each column are placed.
    pub placements: &'a [Placement],
}

/// Revolutions of a map that begins, each of which is taken in whole.
const WHOLE: u32 = 10;

impl Grid {
    /// A grid that has seen nothing.
    pub fn new(parameters: &GridParameters) -> Self {
        let tile_m = parameters.cell_m * TILE_CELLS as f64;
        let tiles_within = |metres: f64| (2.0 * metres / tile_m) as usize;
        // The sensor moves during a sweep, and stands anywhere in its tile.
        let window_side = tiles_within(parameters.reach_m) + 4;
        let map_side = tiles_within(parameters.keep_m).max(window_side) + 2;
        Self {
            filter: Filter::new(parameters),
            map: Map::new(map_side),
            map_id: 0,
            anchor: Anchor::IDENTITY,
            epoch: None,
            revolution: 0,
            updates: Updates::new(parameters),
            window: Window::new(window_side),
            evidence: Evidence::default(),
            casting: Casting::default(),
            passed: vec![],
            hits: Vec::with_capacity(CAPACITY),
            is_moving: Vec::with_capacity(CAPACITY),
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

    /// Where the odometry frame, in which the map is, lies in the local frame.
    pub fn anchor(&self) -> Anchor {
        self.anchor
    }

    /// Tells maps apart: another one begins with the session, and with a jump of the poses or of
    /// time.
    pub fn map_id(&self) -> u32 {
        self.map_id
    }

    /// Side of a cell.
    pub fn cell_m(&self) -> f64 {
        self.parameters.cell_m
    }

    /// Takes a revolution in.
    pub fn process(&mut self, perceived: &Perceived<'_>) {
        if !self.parameters.enabled {
            return;
        }
        let Perceived {
            scan,
            ground,
            heights_m,
            plane,
            sweep,
            placements,
            ..
        } = *perceived;
        self.begin_map(sweep, scan.time());
        self.revolution += 1;
        let sensor = sweep.sensor.placement();
        let tile_m = self.parameters.cell_m * TILE_CELLS as f64;
        let home = sensor
            .origin_m()
            .map(|metres| libm::floor(metres / tile_m) as i32);
        self.map.keep_around(home);
        let half = (self.window.side() / 2) as i32;
        self.window.begin(home.map(|tile| tile - half));
        let columns = self.columns(scan.columns());
        evidence::gather(
            &mut self.evidence,
            columns,
            scan,
            plane,
            ground,
            heights_m,
            &self.parameters,
        );
        self.mark_returns(perceived);
        self.mark_passed(scan, placements);
        let view = View {
            scan,
            ground,
            evidence: &self.evidence,
            placements,
            sensor,
            revolution: self.revolution,
        };
        filter::free(&self.filter, &self.window, &view, &mut self.map);
        self.filter
            .occupy(&self.hits, &mut self.window, self.revolution, &mut self.map);
        self.anchor = sweep.anchor;
        let cell_m = self.parameters.cell_m;
        for object in perceived.objects {
            if moving::moves(object, &self.parameters) {
                moving::clear_way(object, scan.time(), &mut self.map, cell_m, self.revolution);
            }
        }
    }

    /// The columns, of so many, that this revolution takes in.
    fn columns(&self, columns: usize) -> Range<usize> {
        if self.revolution <= WHOLE {
            return 0..columns;
        }
        let turns = self.parameters.turns;
        let turn = self.revolution as usize % turns;
        turn * columns / turns..(turn + 1) * columns / turns
    }

    /// A new map where positions before and after cannot be compared.
    fn begin_map(&mut self, sweep: &Sweep, time: Time) {
        if self.epoch == Some(sweep.epoch) {
            return;
        }
        self.epoch = Some(sweep.epoch);
        self.map.clear();
        self.revolution = 0;
        // Other runs of the service began at other times. A later map has a greater id, even
        // where time was set back.
        let from_time = (time.micros() / 10_000) as u32;
        let is_later = from_time.wrapping_sub(self.map_id) as i32 > 0;
        self.map_id = if self.map_id == 0 || is_later {
            from_time
        } else {
            self.map_id.wrapping_add(1)
        };
    }

    /// Marks the cells in which rays ended on obstacles that do not move.
    fn mark_returns(&mut self, perceived: &Perceived<'_>) {
        let Perceived {
            scan,
            objects,
            sweep,
            placements,
            ..
        } = *perceived;
        self.is_moving.clear();
        self.is_moving.resize(scan.len(), false);
        let moving = objects
            .iter()
            .filter(|object| moving::moves(object, &self.parameters));
        for object in moving {
            let margin_m = self.parameters.moving_margin_m;
            moving::mark_returns(
                object,
                scan,
                sweep,
                placements,
                margin_m,
                &self.evidence,
                &mut self.is_moving,
            );
        }
        self.hits.clear();
        let (per_cell, corner) = (1.0 / self.parameters.cell_m, self.window.corner());
        for point in self.evidence.obstacles() {
            if self.is_moving[point] {
                continue;
            }
            let [x, y, _] = scan.point_m(point).map(f64::from);
            let at_m = placements[scan.column(point)].local_m([x, y]);
            let cells = [0, 1].map(|axis| at_m[axis] * per_cell - corner[axis]);
            if let Some(cell) = self.window.hit(cells) {
                let top = (perceived.heights_m[point] / HEIGHT_UNIT_M) as u8;
                self.hits.push((cell, top));
            }
        }
    }

    /// Marks the cells that rays passed.
    fn mark_passed(&mut self, scan: &Scan, placements: &[Placement]) {
        evidence::stretches(&mut self.evidence, &self.parameters, &mut self.passed);
        self.casting.cast(
            &self.passed,
            scan,
            placements,
            self.parameters.cell_m,
            &mut self.window,
        );
    }

    /// Hands the tiles that are to be sent at a time to `send`, the most urgent first.
    pub fn publish(&mut self, now: Time, sweep: &Sweep, mut send: impl FnMut(&GridTile)) {
        if !self.parameters.enabled || !self.parameters.publish {
            return;
        }
        let tile_m = self.parameters.cell_m * TILE_CELLS as f64;
        let [x, y, _] = sweep.sensor.position_m;
        let (map_id, cell_m) = (self.map_id, self.parameters.cell_m);
        let sensor = [x / tile_m, y / tile_m];
        self.updates.choose(&mut self.map, now, sensor, |sheet| {
            let message = GridTile {
                map_id,
                revision: sheet.revision,
                frame: sweep.frame.number(),
                tile_x: sheet.place[0],
                tile_y: sheet.place[1],
                cells_per_side: SHEET_CELLS as u32,
                cell_size: cell_m,
                anchor_x: sweep.anchor.origin_m[0],
                anchor_y: sweep.anchor.origin_m[1],
                anchor_yaw: sweep.anchor.yaw_rad,
                ..GridTile::default()
            };
            let message = message.with_cells(std::mem::take(&mut sheet.cells));
            send(&message);
            sheet.cells = message.cells.0;
        });
    }
}
