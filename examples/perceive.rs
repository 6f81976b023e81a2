//! The pipeline on a recording: prints who is around in each revolution.
//!
//! `cargo run --release --example perceive -- drive.rec`

use kreisel::config::Configuration;
use kreisel::pipeline::{Outcome, Pipeline};
use kreisel::wire::Recording;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("which recording?")?;
    let bytes = std::fs::read(path)?;
    let mut pipeline = Pipeline::new(&Configuration::default(), 0);
    for entry in Recording::new(&bytes).flatten() {
        if let Ok(Outcome::Revolution(report)) = pipeline.handle(&entry.envelope) {
            println!("{:.2} s:", report.time.seconds());
            for object in pipeline.objects() {
                let ([x, y, _], class) = (object.centre_m, object.class.name());
                println!(
                    "  {class} {} at {x:.1}, {y:.1} m, {:.1} m/s",
                    object.id, object.speed_mps
                );
            }
            pipeline.update_map();
        }
    }
    Ok(())
}
