//! The static array of points that every later step reads.

use super::airborne::Airborne;
use super::passes::{self, Coordinates};
use super::sensor::{self, Sensor};
use super::{CloudParameters, OwnVehicle, Revolution, Source, Turn};
use crate::ego::wrapped_rad;
use crate::float::LANES;
use crate::time::Time;
use std::f64::consts::TAU;
use std::ops::Range;

/// Columns that the array holds (thesis section 4.1.2: `Points[2000][16]`), enough for a
/// sensor that turns at 9.05 Hz or faster.
pub const MAX_COLUMNS: usize = 2000;
/// Layers of a column.
pub const MAX_LAYERS: usize = 16;
/// Where a column is computed in halves, each is as much as a register holds.
const _: () = assert!(MAX_LAYERS == 2 * LANES);
/// Points that the array holds.
pub const CAPACITY: usize = MAX_COLUMNS * MAX_LAYERS;

/// The range of points in layers that the sensor does not have, and in columns of which nothing was heard: masked, and
/// far from everything.
pub(super) const UNSEEN: f32 = f32::MIN;

/// Tangent and cosine of the elevation of layers that a sensor does not have: they meet nothing.
const UPRIGHT: (f64, f64) = (1e6, 1e-6);

/// One revolution in the sensor frame: x right, y forward, z up. A structure of arrays,
/// indexed by [`Scan::index`]; made once, filled again for every revolution.
#[derive(Debug, Clone)]
pub struct Scan {
    columns: usize,
    sensor: &'static Sensor,
    time: Time,
    start_rad: f64,
    step_rad: f64,
    column_period_s: f64,
    /// Tangent and cosine of every layer's elevation.
    slopes: [(f64, f64); MAX_LAYERS],
    /// Every column's azimuth, and its sine and cosine.
    azimuths_rad: Box<[f64]>,
    directions: Box<[[f32; 2]]>,
    range_m: Box<[f32]>,
    /// Ranges of the farthest returns, where pulses have two.
    farthest_m: Vec<f32>,
    /// Where the source says it.
    reflectivity: Vec<u8>,
    airborne: Airborne,
    /// Returns that were left out because they hang in the air.
    airborne_returns: usize,
    x_m: Box<[f32]>,
    y_m: Box<[f32]>,
    z_m: Box<[f32]>,
}

/// Where the columns of a scan look.
#[derive(Debug, Clone, Copy, Default)]
pub struct Azimuths {
    columns: usize,
    start_rad: f64,
    step_rad: f64,
    sees_all_round: bool,
}

impl Azimuths {
    /// How many there are.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Between two columns, in radians clockwise.
    pub fn step_rad(&self) -> f64 {
        self.step_rad
    }

    /// The column so many after another one, where there is one.
    pub fn column_beside(&self, column: usize, after: isize) -> Option<usize> {
        let columns = self.columns as isize;
        let beside = column as isize + after;
        if self.sees_all_round {
            Some(beside.rem_euclid(columns.max(1)) as usize)
        } else {
            (0..columns).contains(&beside).then_some(beside as usize)
        }
    }

    /// The column nearest to an azimuth, in radians clockwise from y.
    pub fn column_at(&self, azimuth_rad: f64) -> usize {
        let turn_rad = azimuth_rad - self.start_rad;
        let turn_rad = turn_rad - TAU * libm::floor(turn_rad / TAU);
        let beyond_rad = turn_rad - self.columns as f64 * libm::fabs(self.step_rad);
        if !self.sees_all_round && beyond_rad > 0.5 * (TAU - turn_rad + beyond_rad) {
            return 0;
        }
        let column = libm::round(turn_rad / libm::fabs(self.step_rad).max(1e-9)) as usize;
        let column = column.min(self.columns.saturating_sub(1));
        if self.step_rad < 0.0 {
            (self.columns - column) % self.columns.max(1)
        } else {
            column
        }
    }
}

impl Default for Scan {
    fn default() -> Self {
        let zeros = || vec![0.0; CAPACITY].into_boxed_slice();
        Self {
            columns: 0,
            sensor: &sensor::VLP16,
            time: Time::ZERO,
            start_rad: 0.0,
            step_rad: 0.0,
            column_period_s: sensor::VLP16.column_period_s,
            slopes: [(0.0, 1.0); MAX_LAYERS],
            azimuths_rad: vec![0.0; MAX_COLUMNS].into_boxed_slice(),
            directions: vec![[0.0, 1.0]; MAX_COLUMNS].into_boxed_slice(),
            range_m: zeros(),
            farthest_m: vec![],
            reflectivity: vec![],
            airborne: Airborne::default(),
            airborne_returns: 0,
            x_m: zeros(),
            y_m: zeros(),
            z_m: zeros(),
        }
    }
}

impl Scan {
    /// Takes a revolution in. [`super::Intake`] has seen to it that it fits.
    pub fn fill(
        &mut self,
        revolution: &Revolution<'_>,
        own: &OwnVehicle,
        parameters: &CloudParameters,
    ) {
        self.columns = revolution.columns;
        self.sensor = revolution.sensor;
        self.time = revolution.time;
        self.start_rad = revolution.start_deg.to_radians();
        self.step_rad = revolution.step_deg.to_radians();
        self.column_period_s = revolution.column_period_s;
        self.farthest_m.clear();
        self.reflectivity.clear();
        let kept_m = [parameters.minimum_range_m, parameters.maximum_range_m];
        let kept_m = kept_m.map(|metres| metres as f32);
        let laser_turns_deg = match revolution.source {
            Source::Cloud(cloud) => {
                passes::read_ranges(
                    cloud.distances,
                    usize::from(cloud.layers),
                    revolution.dialect,
                    kept_m,
                    self.range_m.as_chunks_mut().0,
                );
                self.look_evenly();
                None
            }
            Source::Turn(turn) => {
                self.read_turn(turn, revolution.dialect.unit_m, kept_m);
                Some(turn.laser_turns_deg())
            }
        };
        let ranges_m = &mut self.range_m.as_chunks_mut().0[..self.columns];
        self.airborne_returns = if parameters.airborne {
            self.airborne.mask(ranges_m)
        } else {
            0
        };
        self.place_points(laser_turns_deg);
        self.mask_vehicle(own, parameters);
    }

    /// Firings to metres; what is out of range is masked, and so is what was not seen.
    fn read_turn(&mut self, turn: &Turn, unit_m: f32, [low_m, high_m]: [f32; 2]) {
        let range_m = |units: u16| {
            let range_m = f32::from(units) * unit_m;
            let is_kept = (low_m..=high_m).contains(&range_m);
            if is_kept || units == 0 {
                range_m
            } else {
                -range_m
            }
        };
        let ranges_m = self.range_m.as_chunks_mut::<MAX_LAYERS>().0;
        for (column, (azimuth_deg, firing)) in turn.columns().enumerate() {
            let azimuth_rad = azimuth_deg.to_radians();
            let (sine, cosine) = libm::sincos(azimuth_rad);
            self.azimuths_rad[column] = azimuth_rad;
            self.directions[column] = [sine as f32, cosine as f32];
            let of = |distances: [u16; MAX_LAYERS]| match firing.is_seen {
                true => distances.map(range_m),
                false => [UNSEEN; MAX_LAYERS],
            };
            ranges_m[column] = of(firing.nearest);
            self.reflectivity.extend_from_slice(&firing.reflectivity);
            if turn.is_dual() {
                self.farthest_m.extend_from_slice(&of(firing.farthest));
            }
        }
    }

    /// Azimuths at equal steps. Sine and cosine advance by rotation, in double precision: after 2,000 steps they are
    /// right to 1e-12.
    fn look_evenly(&mut self) {
        let (mut sine, mut cosine) = libm::sincos(self.start_rad);
        let (step_sine, step_cosine) = libm::sincos(self.step_rad);
        for column in 0..self.columns {
            self.azimuths_rad[column] = self.start_rad + column as f64 * self.step_rad;
            self.directions[column] = [sine as f32, cosine as f32];
            (sine, cosine) = (
                sine * step_cosine + cosine * step_sine,
                cosine * step_cosine - sine * step_sine,
            );
        }
    }

    /// Polar to Cartesian; the lasers of a column look so much farther than the first one, if that is known.
    fn place_points(&mut self, laser_turns_deg: Option<[f64; MAX_LAYERS]>) {
        let mut elevations = [[0.0f32; MAX_LAYERS]; 2];
        self.slopes = [UPRIGHT; MAX_LAYERS];
        for (layer, degrees) in self.sensor.elevation_deg.iter().enumerate() {
            let (sine, cosine) = libm::sincos(degrees.to_radians());
            (elevations[0][layer], elevations[1][layer]) = (sine as f32, cosine as f32);
            self.slopes[layer] = (sine / cosine, cosine);
        }
        let coordinates = Coordinates {
            x_m: self.x_m.as_chunks_mut().0,
            y_m: self.y_m.as_chunks_mut().0,
            z_m: self.z_m.as_chunks_mut().0,
        };
        let ranges_m = &self.range_m.as_chunks().0[..self.columns];
        passes::place(ranges_m, &elevations, &self.directions, coordinates);
        if let Some(laser_turns_deg) = laser_turns_deg {
            let turns = laser_turns_deg.map(|degrees| {
                let (sine, cosine) = libm::sincos(degrees.to_radians());
                [sine as f32, cosine as f32]
            });
            let points = 0..self.len();
            let (x_m, y_m) = (&mut self.x_m[points.clone()], &mut self.y_m[points]);
            passes::turn(&turns, x_m.as_chunks_mut().0, y_m.as_chunks_mut().0);
        }
    }

    /// Masks what lies in the box around the own vehicle, or where it was learned to be if no box is given.
    fn mask_vehicle(&mut self, own: &OwnVehicle, parameters: &CloudParameters) {
        let x = parameters.vehicle_x_low_m as f32..parameters.vehicle_x_high_m as f32;
        let y = parameters.vehicle_y_low_m as f32..parameters.vehicle_y_high_m as f32;
        let z = parameters.vehicle_z_low_m as f32..parameters.vehicle_z_high_m as f32;
        if x.is_empty() || y.is_empty() || z.is_empty() {
            self.mask_own(own);
            return;
        }
        for point in 0..self.len() {
            let inside = x.contains(&self.x_m[point])
                && y.contains(&self.y_m[point])
                && z.contains(&self.z_m[point]);
            if inside && self.range_m[point] > 0.0 {
                self.mask(point);
            }
        }
    }

    /// Uses a return no more.
    pub(super) fn mask(&mut self, point: usize) {
        self.range_m[point] = -self.range_m[point].abs();
    }

    /// Columns of this revolution.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// The sensor that made it.
    pub fn sensor(&self) -> &'static Sensor {
        self.sensor
    }

    /// End of the sweep.
    pub fn time(&self) -> Time {
        self.time
    }

    /// Azimuth of a column in radians, clockwise from y.
    pub fn azimuth_rad(&self, column: usize) -> f64 {
        self.azimuths_rad[column]
    }

    /// Sine and cosine of a column's azimuth: its direction to the right and forward.
    pub fn direction(&self, column: usize) -> [f32; 2] {
        self.directions[column]
    }

    /// From one column to the next in radians on average; negative when azimuths fall.
    pub fn step_rad(&self) -> f64 {
        self.step_rad
    }

    /// First column and number of columns in which corners in the sensor frame lie; `None`
    /// where they lie around the sensor itself, or where it does not look.
    pub fn columns_across(&self, corners_m: &[[f64; 2]; 4]) -> Option<(usize, usize)> {
        let [x, y] = [0, 1].map(|axis| corners_m.iter().map(|corner| corner[axis]).sum::<f64>());
        let middle_rad = libm::atan2(x, y);
        let (mut low, mut high) = (f64::MAX, f64::MIN);
        for [x, y] in corners_m {
            let off = wrapped_rad(libm::atan2(*x, *y) - middle_rad);
            (low, high) = (low.min(off), high.max(off));
        }
        if high - low > std::f64::consts::PI || self.step_rad <= 0.0 {
            return None;
        }
        if !self.sensor.sees_all_round() {
            let field_rad = self.columns as f64 * self.step_rad;
            let begin_rad = wrapped_rad(middle_rad - self.start_rad - 0.5 * field_rad);
            let begin_rad = begin_rad + 0.5 * field_rad;
            (low, high) = (low.max(-begin_rad), high.min(field_rad - begin_rad));
            if low >= high {
                return None;
            }
        }
        let count = ((high - low) / self.step_rad) as usize + 1;
        Some((self.column_at(middle_rad + low), count.min(self.columns)))
    }

    /// The same columns up to the seam and beyond it; none where there are none to tell.
    pub fn stretches_across(&self, corners_m: &[[f64; 2]; 4]) -> [Range<usize>; 2] {
        let (first, count) = self.columns_across(corners_m).unwrap_or_default();
        let over = (first + count).saturating_sub(self.columns);
        [first..first + count - over, 0..over]
    }

    /// The column nearest to an azimuth.
    pub fn column_at(&self, azimuth_rad: f64) -> usize {
        self.azimuths().column_at(azimuth_rad)
    }

    /// Where its columns look.
    pub fn azimuths(&self) -> Azimuths {
        Azimuths {
            columns: self.columns,
            start_rad: self.start_rad,
            step_rad: self.step_rad,
            sees_all_round: self.sensor.sees_all_round(),
        }
    }

    /// Horizontal distance of a point from the sensor; 0 or less where nothing came back.
    pub fn distance_m(&self, point: usize) -> f32 {
        self.range_m[point] * self.slopes[self.layer(point)].1 as f32
    }

    /// Tangent and cosine of a layer's elevation.
    pub fn slope(&self, layer: usize) -> (f64, f64) {
        self.slopes[layer]
    }

    /// Revolutions a second, from the step between columns.
    pub fn rotation_hz(&self) -> f64 {
        libm::fabs(self.step_rad) / (TAU * self.column_period_s)
    }

    /// Seconds from the first column to the end of the sweep.
    pub fn duration_s(&self) -> f64 {
        self.columns as f64 * self.column_period_s
    }

    /// How long before the end of the sweep a column was measured, in seconds.
    pub fn age_s(&self, column: usize) -> f64 {
        (self.columns - 1 - column) as f64 * self.column_period_s
    }

    /// Points of this revolution, with and without a return.
    pub fn len(&self) -> usize {
        self.columns * MAX_LAYERS
    }

    /// Whether no revolution was taken in yet.
    pub fn is_empty(&self) -> bool {
        self.columns == 0
    }

    /// Where a point stands in the arrays.
    pub const fn index(&self, column: usize, layer: usize) -> usize {
        column * MAX_LAYERS + layer
    }

    /// Where the points of columns that follow each other stand in the arrays.
    pub const fn points_of(&self, columns: &Range<usize>) -> Range<usize> {
        self.index(columns.start, 0)..self.index(columns.end, 0)
    }

    /// The column that is counted beyond the last one, but not twice around: a division would take
    /// longer than what is looked up there.
    pub const fn over_seam(&self, column: usize) -> usize {
        if column < self.columns {
            column
        } else {
            column - self.columns
        }
    }

    /// The column of a point.
    pub const fn column(&self, point: usize) -> usize {
        point / MAX_LAYERS
    }

    /// The layer of a point.
    pub const fn layer(&self, point: usize) -> usize {
        point % MAX_LAYERS
    }

    /// Ranges in metres: 0 without a return, and negative where the return is not used: too near, too far, or on the own
    /// vehicle.
    pub fn range_m(&self) -> &[f32] {
        &self.range_m[..self.len()]
    }

    /// Whether pulses can have two returns.
    pub fn has_two_returns(&self) -> bool {
        !self.farthest_m.is_empty()
    }

    /// Where a pulse can have two returns, the ranges of the farther one, and else the same as [`Self::range_m`]: so far a ray
    /// is known to have gone.
    pub fn reached_m(&self) -> &[f32] {
        if self.farthest_m.is_empty() {
            self.range_m()
        } else {
            &self.farthest_m
        }
    }

    /// Returns that are not used because they hang in the air: snow, rain, spray, dust.
    pub fn airborne_returns(&self) -> usize {
        self.airborne_returns
    }

    /// Reflectivity of every return, up to 100 of diffuse surfaces and above of retroreflectors; empty where the
    /// source does not say it.
    pub fn reflectivity(&self) -> &[u8] {
        &self.reflectivity
    }

    /// To the right, metres.
    pub fn x_m(&self) -> &[f32] {
        &self.x_m[..self.len()]
    }

    /// Forward, metres.
    pub fn y_m(&self) -> &[f32] {
        &self.y_m[..self.len()]
    }

    /// Up, metres.
    pub fn z_m(&self) -> &[f32] {
        &self.z_m[..self.len()]
    }

    /// Whether a point has a return that is used.
    pub fn has_return(&self, point: usize) -> bool {
        self.range_m[point] > 0.0
    }

    /// A point as x, y, z in metres.
    pub fn point_m(&self, point: usize) -> [f32; 3] {
        [self.x_m[point], self.y_m[point], self.z_m[point]]
    }

    /// How many points have a return that is used.
    pub fn returns(&self) -> usize {
        // Counted in 32 bits: a register holds twice as many as of usize.
        let is_used = |range_m: &f32| u32::from(*range_m > 0.0);
        self.range_m().iter().map(is_used).sum::<u32>() as usize
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::cloud::{ByteOrderSource, Dialect};
    use crate::parameter::Profile;
    use crate::time::Span;
    use crate::wire::point_cloud::{ByteOrder, CompactPointCloud};

    /// A scan of centimetres, `columns` around the circle.
    pub(crate) fn scan_of(columns: usize, distance_cm: impl Fn(usize, usize) -> u16) -> Scan {
        scan_from(0.0, 360.0 / columns as f64, columns, distance_cm)
    }

    /// The same from an azimuth on, in degrees, and so many from column to column.
    pub(crate) fn scan_from(
        start_deg: f64,
        step_deg: f64,
        columns: usize,
        distance_cm: impl Fn(usize, usize) -> u16,
    ) -> Scan {
        let distances: Vec<u8> = (0..columns * MAX_LAYERS)
            .flat_map(|point| distance_cm(point / MAX_LAYERS, point % MAX_LAYERS).to_be_bytes())
            .collect();
        let mut scan = Scan::default();
        scan.fill(
            &Revolution {
                start_deg,
                step_deg,
                ..revolution(&distances)
            },
            &OwnVehicle::default(),
            &CloudParameters::profile(Profile::Default),
        );
        scan
    }

    /// The same scan at a later time.
    pub(crate) fn later(scan: &Scan, seconds: f64) -> Scan {
        Scan {
            time: scan.time + Span::from_seconds(seconds),
            ..scan.clone()
        }
    }

    fn revolution(distances: &[u8]) -> Revolution<'_> {
        let columns = distances.len() / 32;
        Revolution {
            source: Source::Cloud(CompactPointCloud {
                layers: 16,
                distances,
                ..CompactPointCloud::default()
            }),
            columns,
            column_period_s: sensor::VLP16.column_period_s,
            sensor: &sensor::VLP16,
            dialect: Dialect {
                byte_order: ByteOrder::Big,
                byte_order_source: ByteOrderSource::Assumed,
                distance_mask: 0xffff,
                unit_m: 0.01,
                intensity_bits: 0,
            },
            start_deg: 0.0,
            step_deg: 360.0 / columns as f64,
            time: Time::ZERO,
            time_jumped: false,
        }
    }

    #[test]
    fn forward_is_y_right_is_x_and_up_is_z() {
        let scan = scan_of(4, |_, _| 1000);
        let close = |point: usize, expected: [f64; 3]| {
            let found = scan.point_m(point);
            for (found, expected) in found.iter().zip(expected) {
                assert!(
                    (f64::from(*found) - expected).abs() < 1e-4,
                    "{found} {expected}"
                );
            }
        };
        let (sine, cosine) = libm::sincos(15f64.to_radians());
        close(scan.index(0, 15), [0.0, 10.0 * cosine, 10.0 * sine]);
        close(scan.index(1, 0), [10.0 * cosine, 0.0, -10.0 * sine]);
        close(scan.index(3, 0), [-10.0 * cosine, 0.0, -10.0 * sine]);
    }

    #[test]
    fn rotation_keeps_the_azimuth_of_the_last_column() {
        let scan = scan_of(2000, |_, _| 5000);
        let last = scan.index(1999, 8);
        let azimuth = f64::from(scan.x_m[last]).atan2(f64::from(scan.y_m[last]));
        assert!((azimuth + 0.18f64.to_radians()).abs() < 1e-6);
    }

    #[test]
    fn no_return_near_returns_and_the_own_vehicle_are_told_apart() {
        let distances: Vec<u8> = [0u16, 99, 100, 300]
            .iter()
            .flat_map(|cm| std::iter::repeat_n(cm.to_be_bytes(), 16))
            .flatten()
            .collect();
        let mut parameters = CloudParameters::profile(Profile::Default);
        (parameters.vehicle_x_low_m, parameters.vehicle_x_high_m) = (-4.0, -2.0);
        (parameters.vehicle_y_low_m, parameters.vehicle_y_high_m) = (-1.0, 1.0);
        let mut scan = Scan::default();
        scan.fill(&revolution(&distances), &OwnVehicle::default(), &parameters);
        let ranges: Vec<f32> = (0..4)
            .map(|column| scan.range_m()[scan.index(column, 8)])
            .collect();
        let centimetres: Vec<i32> = ranges.iter().map(|m| (100.0 * m).round() as i32).collect();
        assert_eq!(centimetres, [0, -99, 100, -300]);
        assert_eq!(scan.returns(), 16);
    }

    #[test]
    fn a_smaller_revolution_leaves_nothing_of_a_larger_one() {
        let mut scan = scan_of(2000, |_, _| 5000);
        let distances = vec![0; 10 * 32];
        scan.fill(
            &revolution(&distances),
            &OwnVehicle::default(),
            &CloudParameters::profile(Profile::Default),
        );
        assert_eq!((scan.len(), scan.returns()), (160, 0));
    }
}
