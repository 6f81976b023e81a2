//! The static array of points that every later step reads. `filling` takes a revolution in, `azimuths` says where its
//! columns look.

mod azimuths;

mod filling;

pub use azimuths::Azimuths;

use std::f64::consts::TAU;
use std::ops::Range;

use super::airborne::Airborne;
use super::sensor::{self, Sensor};
use crate::ego::wrapped_rad;
use crate::float::LANES;
use crate::time::Time;

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
pub(in crate::cloud) const UNSEEN: f32 = f32::MIN;

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
    use crate::cloud::{ByteOrderSource, CloudParameters, Dialect, OwnVehicle, Revolution, Source};
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
