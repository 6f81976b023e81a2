//! Advice at a simulated roundabout, from point clouds to messages.
#![cfg(feature = "shell")]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::process::Command;

use kreisel::config::Configuration;
use kreisel::pipeline::{Outcome, Pipeline};
use kreisel::roundabout::Hindrance;
use kreisel::simulate::{Simulation, scenario};
use kreisel::wire::roundabout::Roundabout;
use kreisel::wire::{Envelope, Message, Recording};

/// What was not seen yet may hold somebody.
#[test]
fn nobody_is_sent_in_before_all_is_seen() {
    let scenario = scenario::find("roundabout-traffic").unwrap();
    let mut pipeline = Pipeline::new(&Configuration::default(), 0);
    assert_eq!(pipeline.take_map(&scenario.roads().unwrap()), 1);
    let mut simulation = Simulation::new(scenario, 2);
    let mut opened = 0;
    for revolution in 0..60 {
        let mut frames = vec![];
        simulation.revolve(&mut frames);
        for entry in Recording::new(&frames).flatten() {
            if !matches!(pipeline.handle(&entry.envelope), Ok(Outcome::Revolution(_))) {
                continue;
            }
            let advice = pipeline.advice().unwrap();
            assert_eq!(advice.arms.len(), 4);
            if revolution < 10 {
                let waits = |hindrance| {
                    matches!(hindrance, Some(Hindrance::Unseen | Hindrance::RoadUser(_)))
                };
                assert!(
                    advice.arms.iter().all(|arm| waits(arm.entry.hindrance)),
                    "{advice:?}"
                );
            }
            opened += advice.arms.iter().filter(|arm| arm.entry.may_go).count();
        }
    }
    assert!(opened > 0, "nobody is ever sent in");
}

#[test]
fn every_revolution_has_its_message_where_a_map_is_given() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let run = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kreisel"));
        let output = command.args(arguments).output().unwrap();
        (
            output.status.code().unwrap(),
            String::from_utf8(output.stderr).unwrap(),
        )
    };
    let (session, roads, out) = (path("in.rec"), path("roads.scn"), path("out.rec"));
    let simulate = ["simulate", "roundabout-traffic", "--duration", "2"];
    assert_eq!(
        run(&[&simulate[..], &["--output", &session, "--map", &roads]].concat()).0,
        0
    );
    assert_eq!(
        run(&["process", &session, "--output", &out, "--map", &roads]).0,
        0
    );
    let bytes = std::fs::read(&out).unwrap();
    let envelopes = Recording::new(&bytes).map(|entry| entry.unwrap().envelope);
    let said = |envelope: &Envelope<'_>| envelope.data_type == Roundabout::ID;
    let said: Vec<_> = envelopes.filter(said).collect();
    assert_eq!(said.len(), 20);
    let last = Roundabout::decode(said[19].payload, 0).unwrap();
    assert_eq!(
        (last.arms.0.len(), last.rings.0.len(), last.own_arm),
        (4, 3, 0)
    );
    assert_eq!((last.revolution, last.diameter), (19, 30.0));
    // The same file without a map says nothing of it.
    assert_eq!(run(&["process", &session, "--output", &out]).0, 0);
    let bytes = std::fs::read(&out).unwrap();
    let mut ids = Recording::new(&bytes).map(|entry| entry.unwrap().envelope.data_type);
    assert!(ids.all(|id| id != Roundabout::ID));
    // A map without any is a mistake.
    std::fs::write(&roads, "<osm/>").unwrap();
    let (code, text) = run(&["process", &session, "--output", &out, "--map", &roads]);
    assert_eq!((code, text.lines().count()), (1, 1));
    assert!(text.contains("no roundabout is in it"), "{text}");
}

#[test]
fn a_driver_who_heeds_the_advice_enters_and_hits_nobody() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kreisel"));
    let output = command.args(["drive", "--seed", "21"]).output().unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    let line = |who: &str| said.lines().find(|line| line.starts_with(who)).unwrap();
    let clean = "0 collisions, 0 near misses";
    assert!(line("advised: waited").contains(clean), "{said}");
    assert!(line("knowing: waited").contains(clean), "{said}");
    // Who does not look runs into somebody.
    assert!(
        line("heedless: waited 0.0 s").contains("1 collisions"),
        "{said}"
    );
    let output = Command::new(env!("CARGO_BIN_EXE_kreisel"))
        .args(["drive", "street"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("no roundabout in street"), "{said}");
}
