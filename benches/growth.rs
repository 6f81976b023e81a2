//! How the cost of a revolution grows with its columns, with the road users around, and with the
//! reach of the grid. Microseconds of CPU time, medians, and the whole in passes as in
//! `revolution.rs`.
//!
//! `cargo bench --bench growth` prints the tables; `-- --rounds 200` sets how many revolutions
//! are timed.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use common::{NAMES, WARM, drive, frame_of, plain_pass, quantiles, simulated, time_of};
use kreisel::config::Configuration;
use kreisel::pipeline::Pipeline;
use kreisel::wire::Envelope;
use kreisel::wire::point_cloud::{CompactPointCloud, POINT_CLOUD_ID};

/// Times of the steps, the whole, and the whole in passes.
fn row(frames: &[Vec<u8>], configuration: &Configuration) -> String {
    // The machine is not as fast all the time.
    let before_us = plain_pass();
    let times_us = drive(frames, &mut Pipeline::new(configuration, 0));
    let unit_us = 0.5 * (before_us + plain_pass());
    let medians_us = times_us.map(|mut times_us| quantiles(&mut times_us).0);
    let cells: String = medians_us
        .iter()
        .map(|median_us| format!(" {median_us:.0} |"))
        .collect();
    format!("{cells} {:.1} |", medians_us[NAMES.len() - 1] / unit_us)
}

fn table(what: &str, rows: impl IntoIterator<Item = (String, String)>) {
    println!("| {what} | {} | passes |", NAMES.join(" | "));
    println!("|-:|{}-:|", "-:|".repeat(NAMES.len()));
    for (value, row) in rows {
        println!("| {value} |{row}");
    }
    println!();
}

/// The revolutions with as many columns as said, each the one of the same azimuth or next to it.
fn with_columns(frames: &[Vec<u8>], columns: usize) -> Vec<Vec<u8>> {
    let resampled = |frame: &Vec<u8>| {
        let (envelope, _) = Envelope::from_datagram(frame).unwrap();
        if envelope.data_type != POINT_CLOUD_ID {
            return frame.clone();
        }
        let cloud = CompactPointCloud::decode(envelope.payload, 0).unwrap();
        let column_bytes = 2 * usize::from(cloud.layers);
        let distances: Vec<u8> = (0..columns)
            .flat_map(|column| {
                let from = column_bytes * (column * cloud.columns() / columns);
                cloud.distances[from..from + column_bytes].iter().copied()
            })
            .collect();
        let step_deg = 360.0 / columns as f32;
        let cloud = CompactPointCloud {
            start_azimuth_deg: step_deg,
            end_azimuth_deg: 360.0,
            distances: &distances,
            ..cloud
        };
        frame_of(&cloud, envelope.sample_time_stamp.time())
    };
    frames.iter().map(resampled).collect()
}

/// Level ground and so many people on it, who walk around the sensor in circles.
fn people(count: usize, revolution: usize) -> Vec<u8> {
    const COLUMNS: usize = 1800;
    const SENSOR_M: f64 = 1.8;
    const HEIGHT_M: f64 = 1.75;
    const HALF_WIDTH_M: f64 = 0.25;
    const SPEED_M_S: f64 = 1.3;
    let person = |number: usize| {
        // Neighbours walk on circles of their own, of which the nearer hide little.
        let range_m = 16.0 + 3.0 * (number % 7) as f64;
        let walked_m = SPEED_M_S * 0.1 * revolution as f64;
        let azimuth_deg = 360.0 * number as f64 / count as f64 + (walked_m / range_m).to_degrees();
        (azimuth_deg.rem_euclid(360.0), range_m)
    };
    let people: Vec<(f64, f64)> = (0..count).map(person).collect();
    let distance_m = |column: usize, layer: usize| {
        let azimuth_deg = 360.0 * column as f64 / COLUMNS as f64;
        let slope = (2.0 * layer as f64 - 15.0).to_radians().tan();
        let ground_m = if slope < 0.0 {
            -SENSOR_M / slope
        } else {
            200.0
        };
        let met_m = people.iter().filter_map(|(of_deg, range_m)| {
            let beside_deg = (azimuth_deg - of_deg + 180.0).rem_euclid(360.0) - 180.0;
            let height_m = SENSOR_M + range_m * slope;
            let is_met = (beside_deg.to_radians() * range_m).abs() < HALF_WIDTH_M
                && (0.0..HEIGHT_M).contains(&height_m);
            is_met.then_some(*range_m)
        });
        let range_m = met_m.fold(ground_m, f64::min);
        let distance_m = range_m * slope.hypot(1.0);
        if distance_m > 100.0 { 0.0 } else { distance_m }
    };
    let distances: Vec<u8> = (0..COLUMNS)
        .flat_map(|column| (0..16).map(move |layer| (column, layer)))
        .flat_map(|(column, layer)| {
            let uneven = (column * 7 + layer * 13 + revolution * 5) % 4;
            ((100.0 * distance_m(column, layer)) as u16 + uneven as u16).to_be_bytes()
        })
        .collect();
    let cloud = CompactPointCloud {
        start_azimuth_deg: 0.0,
        end_azimuth_deg: 359.8,
        layers: 16,
        distances: &distances,
        ..CompactPointCloud::default()
    };
    frame_of(&cloud, time_of(revolution))
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let rounds = arguments.iter().position(|argument| argument == "--rounds");
    let rounds: usize = rounds.map_or(100, |at| arguments[at + 1].parse().unwrap());
    let rounds = rounds + WARM;
    let configuration = Configuration::default();
    let street = simulated("street", rounds);
    table(
        "columns, street",
        [500, 1000, 1500, 2000].map(|columns| {
            let frames = with_columns(&street, columns);
            (columns.to_string(), row(&frames, &configuration))
        }),
    );
    table(
        "people",
        [0, 25, 50, 100, 200].map(|count| {
            let frames: Vec<_> = (0..rounds).map(|number| people(count, number)).collect();
            (count.to_string(), row(&frames, &configuration))
        }),
    );
    table(
        "reach of the grid in m, street",
        [10.0, 25.0, 50.0, 100.0].map(|reach_m| {
            let mut configuration = configuration.clone();
            configuration.grid.reach_m = reach_m;
            (reach_m.to_string(), row(&street, &configuration))
        }),
    );
}
