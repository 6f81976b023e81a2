//! A revolution into the array: ranges, directions, points, and what is masked.

use super::{MAX_LAYERS, Scan, UNSEEN};
use crate::cloud::passes::{self, Coordinates};
use crate::cloud::{CloudParameters, OwnVehicle, Revolution, Source, Turn};

/// Tangent and cosine of the elevation of layers that a sensor does not have: they meet nothing.
const UPRIGHT: (f64, f64) = (1e6, 1e-6);

impl Scan {
    /// Takes a revolution in. [`crate::cloud::Intake`] has seen to it that it fits.
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
    pub(in crate::cloud) fn mask(&mut self, point: usize) {
        self.range_m[point] = -self.range_m[point].abs();
    }
}
