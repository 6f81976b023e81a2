//! `kreisel drive`: a simulated vehicle that enters a roundabout when the advice allows it, beside one whose driver
//! knows all road users; and what becomes of it.

mod driver;
mod judge;

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::Args;

use super::Completion;
use super::files;
use super::score::TrueUser;
use super::simulate;
use crate::ego::Pose;
use crate::ego::geodesy::Geodetic;
use crate::pipeline::Pipeline;
use crate::roadmap::Roadmap;
use crate::roundabout::{Advice, RoundaboutParameters, Situation, Watcher};
use crate::simulate::scenario::Scenario;
use crate::simulate::{Simulation, Truth};
use crate::track::Object;
use crate::wire::Recording;
use driver::Driver;
use judge::{Judge, Outcome};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Scenario in which the vehicle comes to a roundabout.
    #[arg(value_name = "SCENARIO", default_value = "roundabout-entry", value_parser = simulate::find)]
    scenario: Scenario,
    /// Traffic and noise follow from it.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// How long at most, in seconds.
    #[arg(long, value_name = "S", default_value_t = 60.0, value_parser = simulate::duration)]
    duration: f64,
    /// Configuration file; `kreisel config` prints one.
    #[arg(long, value_name = "FILE.toml")]
    config: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> Result<Completion> {
    let Some(roads) = arguments.scenario.roads() else {
        bail!("there is no roundabout in {}", arguments.scenario.name);
    };
    let configuration = files::configuration(arguments.config.as_deref())?;
    let drive = |eyes: Eyes| drive(arguments, &configuration.roundabout, eyes);
    let mut pipeline = Pipeline::new(&configuration, 0);
    pipeline.take_map(&roads);
    let advised = drive(Eyes::Sensor(Box::new(pipeline)));
    let knowing = drive(Eyes::truth(&configuration.roundabout, &roads));
    // Who is let in by nobody's advice loses no time.
    let unhindered = drive(Eyes::Shut);
    let waited = |outcome: &Outcome| match (outcome.entered_s, unhindered.entered_s) {
        (Some(entered_s), Some(least_s)) => format!("waited {:.1} s", entered_s - least_s),
        _ => "did not enter".to_owned(),
    };
    let told = |outcome: &Outcome| {
        format!(
            "{}, {} collisions, {} near misses, run into {} times",
            waited(outcome),
            outcome.collisions,
            outcome.near_misses,
            outcome.run_into
        )
    };
    say!("advised: {}", told(&advised));
    say!("knowing: {}", told(&knowing));
    say!("heedless: {}", told(&unhindered));
    Ok(Completion::Done)
}

/// What the driver goes by.
enum Eyes {
    /// The service's advice.
    Sensor(Box<Pipeline>),
    /// The same rule on true road users.
    Truth(Box<Watcher>),
    /// Nothing: as if nobody were there.
    Shut,
}

impl Eyes {
    fn truth(parameters: &RoundaboutParameters, roads: &Roadmap) -> Self {
        let mut watcher = Watcher::new(parameters);
        watcher.take_map(roads);
        Self::Truth(Box::new(watcher))
    }

    /// A revolution; who needs no rays casts none.
    fn revolve(&self, simulation: &mut Simulation, frames: &mut Vec<u8>) -> Truth {
        match self {
            Self::Sensor(_) => simulation.revolve(frames),
            Self::Truth(_) | Self::Shut => simulation.pass(),
        }
    }

    /// What is said after a revolution.
    fn advice(&mut self, frames: &[u8], truth: &Truth, reference: Geodetic) -> Option<&Advice> {
        match self {
            Self::Sensor(pipeline) => {
                for entry in Recording::new(frames).flatten() {
                    // The pipeline counts what it refuses.
                    let _ = pipeline.handle(&entry.envelope);
                }
                pipeline.advice()
            }
            Self::Truth(watcher) => {
                let users = truth.objects.iter();
                let users: Vec<Object> = users
                    .map(|user| TrueUser::from(user).object(truth.time))
                    .collect();
                watcher.watch(&Situation {
                    time: truth.time,
                    reference: Some(reference),
                    epoch: 0,
                    vehicle: Some(Pose {
                        position_m: truth.sensor_m,
                        yaw_rad: truth.sensor_yaw_rad,
                    }),
                    vehicle_speed_mps: truth.sensor_speed_mps,
                    objects: &users,
                    sight: None,
                });
                watcher.advice()
            }
            Self::Shut => None,
        }
    }
}

/// Drives until the vehicle has left the roundabout, or time is over.
fn drive(arguments: &Arguments, parameters: &RoundaboutParameters, mut eyes: Eyes) -> Outcome {
    let mut simulation = Simulation::new(arguments.scenario, arguments.seed);
    let mut driver = Driver::new(simulation.way_of_ego(), parameters);
    let mut judge = Judge::new(parameters);
    let mut frames = vec![];
    let begin = eyes.revolve(&mut simulation, &mut frames);
    let mut truth = begin.clone();
    while (truth.time - begin.time).seconds() < arguments.duration {
        let advice = eyes.advice(&frames, &truth, simulation.reference());
        simulation.drive(driver.speed_mps(&truth, advice));
        judge.take(&truth, &driver);
        if driver.is_past() {
            break;
        }
        frames.clear();
        truth = eyes.revolve(&mut simulation, &mut frames);
    }
    judge.outcome()
}
