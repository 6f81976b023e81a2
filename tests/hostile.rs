//! Damaged, cut and spliced bytes do no harm: nothing panics, every fault is counted under
//! its own name, and good revolutions after them are answered.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use kreisel::config::Configuration;
use kreisel::pipeline::{Counts, Fault, Outcome, Pipeline};
use kreisel::random::Random;
use kreisel::simulate::{Simulation, scenario};
use kreisel::time::{Span, Time};
use kreisel::wire::envelope::Postmark;
use kreisel::wire::frame::HEADER_LEN;
use kreisel::wire::grid_tile::GridTile;
use kreisel::wire::object_list::{Object, ObjectList};
use kreisel::wire::point_cloud::{
    ByteOrder, CompactPointCloud, DistanceEncoding, IntensityPlacement, POINT_CLOUD_ID, Schema,
};
use kreisel::wire::pose::{ApplanixGroup1, GeodeticHeadingReading};
use kreisel::wire::recording::{Damage, Entry};
use kreisel::wire::status::Status;
use kreisel::wire::{Envelope, Message, Recording};
use std::collections::BTreeMap;

const REVOLUTIONS: &str = "vlp16-sampleShort.rec";
const PERIOD: Span = Span::from_micros(100_000);
/// One hostile message may cost one good revolution, so the second is answered.
const AFTER_ONE: usize = 2;
/// Of many hostile messages one may mislead about the azimuths and another about the time.
const AFTER_MANY: usize = 4;
/// Good revolutions until a sender is followed that was not the first, with some room.
const AFTER_ANOTHER_SENDER: usize = 25;

/// The content of a file of test data; `None` where the data is absent.
fn bytes(name: &str) -> Option<Vec<u8>> {
    let path = common::data(name)?;
    Some(std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display())))
}

/// A real recording; where there is none, what a simulated sensor that stands at a roundabout sends.
fn recording() -> Vec<u8> {
    bytes(REVOLUTIONS).unwrap_or_else(|| {
        let scenario = scenario::find("roundabout-waiting").unwrap();
        let (mut simulation, mut bytes) = (Simulation::new(scenario, 1), vec![]);
        (0..4).for_each(|_| drop(simulation.revolve(&mut bytes)));
        bytes
    })
}

/// A pipeline with a good sender, and all that it answered.
struct Session {
    pipeline: Pipeline,
    good_payload: Vec<u8>,
    now: Time,
    clouds: u64,
    poses: u64,
    faults: BTreeMap<&'static str, u64>,
    answers: u64,
}

impl Session {
    fn new(good_payload: Vec<u8>) -> Self {
        Self {
            pipeline: Pipeline::new(&Configuration::default(), 7),
            good_payload,
            now: Time::from_micros(1_700_000_000_000_000),
            clouds: 0,
            poses: 0,
            faults: BTreeMap::new(),
            answers: 0,
        }
    }

    /// A frame of the real revolution, a little later than all before.
    fn good_frame(&mut self) -> Vec<u8> {
        self.now = self.now + PERIOD;
        self.frame(0, self.now)
    }

    fn frame(&self, sender_stamp: u32, sampled: Time) -> Vec<u8> {
        let postmark = Postmark {
            sent: self.now,
            sampled,
            sender_stamp,
        };
        let mut frame = vec![];
        postmark.put_payload(&mut frame, POINT_CLOUD_ID, |out| {
            out.extend(&self.good_payload)
        });
        frame
    }

    /// Hands the real revolution in as another sender.
    fn send_as(&mut self, sender_stamp: u32) -> Result<Outcome, Fault> {
        self.now = self.now + PERIOD;
        let frame = self.frame(sender_stamp, self.now);
        self.hand_in(&frame).unwrap()
    }

    /// Hands the real revolution in with a time that is ahead of the session.
    fn send_ahead(&mut self, ahead: Span) -> Result<Outcome, Fault> {
        let frame = self.frame(0, self.now + ahead);
        self.hand_in(&frame).unwrap()
    }

    /// Hands a datagram in if it holds an envelope.
    fn hand_in(&mut self, datagram: &[u8]) -> Option<Result<Outcome, Fault>> {
        let (envelope, _) = Envelope::from_datagram(datagram).ok()?;
        Some(self.handle(&envelope))
    }

    fn handle(&mut self, envelope: &Envelope<'_>) -> Result<Outcome, Fault> {
        self.clouds += u64::from(envelope.data_type == POINT_CLOUD_ID);
        let result = self.pipeline.handle(envelope);
        match &result {
            Ok(Outcome::Revolution(_)) => self.check_answer(envelope),
            Ok(Outcome::Pose) => self.poses += 1,
            Ok(Outcome::Own | Outcome::Other | Outcome::Packets) => {}
            Err(fault) => *self.faults.entry(fault.name()).or_default() += 1,
        }
        result
    }

    /// An object list of numbers that are finite, and tiles that can be drawn.
    fn check_answer(&mut self, question: &Envelope<'_>) {
        self.answers += 1;
        self.pipeline.update_map();
        for frame in self.pipeline.publish_map(self.now) {
            let (envelope, _) = Envelope::from_datagram(frame).unwrap();
            let tile = GridTile::decode(envelope.payload, envelope.payload_offset).unwrap();
            assert!(tile.levels(tile.map_id).is_ok(), "{tile:?}");
        }
        let mut frames = self.pipeline.publish_objects(self.now, 0.01);
        let (envelope, rest) = Envelope::from_datagram(frames.next().unwrap()).unwrap();
        assert_eq!(
            (envelope.data_type, envelope.sender_stamp, rest),
            (2021, 7, 0)
        );
        if question.sample_time_stamp == question.sample_time_stamp.time().into() {
            assert!(question.time().is_zero() || envelope.time() == question.time());
        }
        let list = ObjectList::decode(envelope.payload, envelope.payload_offset).unwrap();
        assert_eq!(list.count as usize, list.objects.0.len());
        assert!(list.objects.0.iter().all(is_finite), "{list:?}");
    }

    fn send_good(&mut self) -> bool {
        let frame = self.good_frame();
        matches!(self.hand_in(&frame), Some(Ok(Outcome::Revolution(_))))
    }

    /// How many good revolutions it takes until one is answered.
    fn good_until_answered(&mut self, most: usize) -> usize {
        let answered = (1..=most).find(|_| self.send_good());
        answered.unwrap_or_else(|| panic!("{most} good revolutions without an answer"))
    }

    /// What the pipeline counted is what was seen from outside.
    fn check_counts(&self) {
        let counts: &Counts = self.pipeline.counts();
        let faults: BTreeMap<_, _> = counts.faults.iter().collect();
        assert_eq!(faults, self.faults);
        let counted = counts.refused + counts.damaged + counts.poses_refused;
        assert_eq!(counts.faults.total(), counted);
        assert_eq!(
            (counts.revolutions, counts.poses),
            (self.clouds, self.poses)
        );
        assert_eq!(self.pipeline.status().revolutions_published, self.answers);
    }
}

fn is_finite(object: &Object) -> bool {
    let place = [object.x, object.y, object.z];
    let rest = [
        object.existence,
        object.yaw,
        object.speed,
        object.length,
        object.width,
        object.height,
        object.x_deviation,
        object.y_deviation,
        object.yaw_deviation,
        object.speed_deviation,
        object.age,
    ];
    place
        .into_iter()
        .chain(rest.map(f64::from))
        .all(f64::is_finite)
}

/// The second revolution of the recording, the first whole one.
fn good_payload(recording: &[u8]) -> Vec<u8> {
    let entry = Recording::new(recording).nth(1).unwrap().unwrap();
    entry.envelope.payload.to_vec()
}

/// Frames of all kinds as other peers send them; where these are not at hand, as Kreisel does.
fn frames() -> Vec<Vec<u8>> {
    let Some(folder) = common::data("golden") else {
        return own_frames();
    };
    let mut paths: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| !path.to_string_lossy().ends_with(".payload.bin"))
        .collect();
    paths.sort();
    paths
        .iter()
        .map(|path| std::fs::read(path).unwrap())
        .collect()
}

fn own_frames() -> Vec<Vec<u8>> {
    fn framed(message: &impl Message) -> Vec<u8> {
        let mut frame = vec![];
        Postmark::default().put(&mut frame, message);
        frame
    }
    let recording = recording();
    let clouds = Recording::new(&recording).map(|entry| entry.unwrap().frame.to_vec());
    let others = [
        framed(&ObjectList::default()),
        framed(&GridTile::default().with_cells(vec![0; 64])),
        framed(&Status::default()),
        framed(&ApplanixGroup1 {
            lat: 57.7,
            lon: 11.9,
            ..ApplanixGroup1::default()
        }),
        framed(&GeodeticHeadingReading { north_heading: 1.0 }),
    ];
    clouds.chain(others).collect()
}

fn clouds() -> Vec<Vec<u8>> {
    let is_cloud = |frame: &Vec<u8>| {
        let (envelope, _) = Envelope::from_datagram(frame).unwrap();
        envelope.data_type == POINT_CLOUD_ID
    };
    frames().into_iter().filter(is_cloud).collect()
}

/// A damaged copy of `frame`; splices take their end from `other`.
fn mutated(random: &mut Random, frame: &[u8], other: &[u8]) -> Vec<u8> {
    let mut bytes = frame.to_vec();
    match random.below(4) {
        0 => flip(random, &mut bytes),
        1 => bytes.truncate(random.below(frame.len())),
        2 => insert(random, &mut bytes),
        _ => {
            bytes.truncate(place(random, frame.len()));
            bytes.extend_from_slice(&other[place(random, other.len())..]);
        }
    }
    // Half of them keep a sound frame, so that the damage gets further in.
    if random.below(2) == 0 && bytes.len() >= HEADER_LEN {
        let length = (bytes.len() - HEADER_LEN) as u32;
        bytes[2..HEADER_LEN].copy_from_slice(&length.to_le_bytes()[..3]);
    }
    bytes
}

/// A place in `0..length`, most often near one of the ends, where the fields are.
fn place(random: &mut Random, length: usize) -> usize {
    let near = random.below(length.min(48));
    match random.below(5) {
        0 | 1 => near,
        2 | 3 => length - 1 - near,
        _ => random.below(length),
    }
}

fn flip(random: &mut Random, bytes: &mut [u8]) {
    for _ in 0..=random.below(4) {
        let place = place(random, bytes.len());
        bytes[place] ^= 1 << random.below(8);
    }
}

fn insert(random: &mut Random, bytes: &mut Vec<u8>) {
    let place = place(random, bytes.len());
    let inserted: Vec<u8> = (0..=random.below(16))
        .map(|_| random.next_u64() as u8)
        .collect();
    bytes.splice(place..place, inserted);
}

#[test]
fn ten_thousand_mutations_are_counted_and_good_revolutions_between_them_answered() {
    let recording = recording();
    let golden = frames();
    let mut session = Session::new(good_payload(&recording));
    let mut random = Random::new(2024);
    let mut delays = vec![session.good_until_answered(1)];
    for round in 1..=10_000 {
        let (source, other) = (random.below(golden.len()), random.below(golden.len()));
        let mutant = if round % 20 == 0 {
            let revolution = session.good_frame();
            mutated(&mut random, &revolution, &golden[other])
        } else {
            mutated(&mut random, &golden[source], &golden[other])
        };
        let _ = session.hand_in(&mutant);
        if round % 25 == 0 {
            delays.push(session.good_until_answered(AFTER_MANY));
        }
    }
    session.check_counts();
    let late = delays.iter().filter(|delay| **delay > 1).count();
    assert!(late * 20 < delays.len(), "{late} of {} late", delays.len());
    assert!(session.faults.len() >= 8, "{:?}", session.faults);
}

#[test]
#[cfg_attr(not(shared_data), ignore = "needs ../shared/data")]
fn a_fault_costs_no_good_revolution_and_a_mutant_that_passes_at_most_one() {
    let recording = recording();
    let clouds = clouds();
    let mut session = Session::new(good_payload(&recording));
    let mut random = Random::new(4711);
    session.good_until_answered(1);
    for round in 0..500 {
        let (frame, other) = (session.good_frame(), session.good_frame());
        let source = match random.below(2) {
            0 => &frame,
            _ => &clouds[random.below(clouds.len())],
        };
        let mutant = mutated(&mut random, source, &other);
        match session.hand_in(&mutant) {
            Some(Err(fault)) => assert!(session.send_good(), "round {round}, after {fault}"),
            Some(Ok(Outcome::Revolution(_))) => _ = session.good_until_answered(AFTER_ONE),
            Some(Ok(_)) | None => {}
        }
    }
    session.check_counts();
    let faults: u64 = session.faults.values().sum();
    assert!(faults > 50, "{:?}", session.faults);
}

#[test]
fn a_burst_of_mutants_delays_good_revolutions_by_a_few() {
    let recording = recording();
    let mut session = Session::new(good_payload(&recording));
    let mut random = Random::new(99);
    session.good_until_answered(1);
    for _ in 0..10 {
        for _ in 0..30 {
            let (frame, other) = (session.good_frame(), session.good_frame());
            let mutant = mutated(&mut random, &frame, &other);
            let _ = session.hand_in(&mutant);
        }
        session.good_until_answered(AFTER_MANY);
        assert!(session.send_good());
    }
    session.check_counts();
}

#[test]
fn bytes_of_no_meaning_do_no_harm_as_any_message() {
    let recording = recording();
    let mut session = Session::new(good_payload(&recording));
    let mut random = Random::new(5);
    for data_type in [
        12, 19, 49, 181, 189, 533, 1001, 1031, 1046, 1051, 1116, 2020, 2021,
    ] {
        for _ in 0..200 {
            let noise = (0..random.below(300)).map(|_| random.next_u64() as u8);
            let payload: Vec<u8> = noise.collect();
            let mut frame = vec![];
            Postmark::default().put_payload(&mut frame, data_type, |out| out.extend(&payload));
            let _ = session.hand_in(&frame).unwrap();
        }
    }
    session.check_counts();
    assert!(session.good_until_answered(AFTER_MANY) <= AFTER_ONE);
}

#[test]
fn another_sender_is_followed_after_twenty_refusals_and_the_first_welcome_back_at_once() {
    let recording = recording();
    let mut session = Session::new(good_payload(&recording));
    assert!(session.send_good());
    let taken = (0..22).filter(|_| session.send_as(1).is_ok()).count();
    assert_eq!(taken, 2);
    assert!(session.send_good());
    session.check_counts();
    assert_eq!(session.faults, BTreeMap::from([("other_sender", 20)]));
}

#[test]
fn a_hostile_first_sender_keeps_the_good_one_waiting_no_longer_than_its_patience() {
    let recording = recording();
    let mut session = Session::new(good_payload(&recording));
    assert!(session.send_as(9).is_ok());
    assert_eq!(session.good_until_answered(AFTER_ANOTHER_SENDER), 21);
    assert!(session.send_good());
    session.check_counts();
}

#[test]
fn a_refused_first_message_does_not_decide_who_is_listened_to() {
    let recording = recording();
    let good = good_payload(&recording);
    let mut session = Session::new(with_end_azimuth(&good, 180.0));
    let refused = session.send_as(9).unwrap_err();
    assert_eq!(refused.name(), "partial_revolution");
    session.good_payload = good;
    assert!(session.send_good());
    session.check_counts();
}

/// The same revolution with another last azimuth in degrees.
fn with_end_azimuth(payload: &[u8], end_azimuth_deg: f32) -> Vec<u8> {
    let mut cloud = CompactPointCloud::decode(payload, 0).unwrap();
    cloud.end_azimuth_deg = end_azimuth_deg;
    let mut out = vec![];
    cloud.encode(&mut out);
    out
}

#[test]
fn a_leap_in_time_costs_no_revolution() {
    let recording = recording();
    let mut session = Session::new(good_payload(&recording));
    assert!(session.send_good());
    for hours in [1, -1] {
        let leap = Span::from_micros(hours * 3_600_000_000);
        let outcome = session.send_ahead(leap);
        assert!(matches!(outcome, Ok(Outcome::Revolution(report)) if report.time_jumped));
        assert!(session.send_good());
    }
    session.check_counts();
    assert_eq!(session.pipeline.counts().time_jumps, 4);
}

#[test]
fn a_sample_time_a_little_ahead_costs_one_revolution() {
    let recording = recording();
    let mut session = Session::new(good_payload(&recording));
    assert!(session.send_good());
    for ahead_us in [150_000, 500_000, 999_000] {
        assert!(session.send_ahead(Span::from_micros(ahead_us)).is_ok());
        assert_eq!(session.good_until_answered(AFTER_ONE), 2, "{ahead_us}");
        assert!(session.send_good());
    }
    session.check_counts();
    assert_eq!(session.faults, BTreeMap::from([("out_of_order", 3)]));
}

#[test]
fn a_sample_time_that_a_later_revolution_shares_costs_one_revolution() {
    let recording = recording();
    let mut session = Session::new(good_payload(&recording));
    assert!(session.send_good());
    assert!(session.send_ahead(Span::from_micros(200_000)).is_ok());
    let answered: Vec<bool> = (0..3).map(|_| session.send_good()).collect();
    assert_eq!(answered, [false, true, true]);
    session.check_counts();
}

#[test]
fn refused_point_clouds_leave_the_byte_order_as_it_was() {
    let recording = recording();
    let good = good_payload(&recording);
    let mut session = Session::new(swapped_in_unknown_unit(&good));
    for _ in 0..5 {
        let refused = session.send_as(0).unwrap_err();
        assert_eq!(refused.name(), "unknown_encoding");
    }
    session.good_payload = good;
    let outcome = session.send_as(0).unwrap();
    let Outcome::Revolution(report) = outcome else {
        panic!("{outcome:?}")
    };
    assert_eq!(report.dialect.byte_order, ByteOrder::Big);
}

/// The same revolution in the other byte order and in a unit that no schema has.
fn swapped_in_unknown_unit(payload: &[u8]) -> Vec<u8> {
    let mut cloud = CompactPointCloud::decode(payload, 0).unwrap();
    let mut distances = cloud.distances.to_vec();
    distances.chunks_exact_mut(2).for_each(<[u8]>::reverse);
    cloud.distances = &distances;
    cloud.schema = Schema::OpenDaVinci {
        placement: IntensityPlacement::Higher,
        encoding: DistanceEncoding::Unknown(5),
    };
    let mut out = vec![];
    cloud.encode(&mut out);
    out
}

#[test]
fn wrong_azimuths_are_refused_once_and_right_ones_welcome_back_at_once() {
    let recording = recording();
    let good = good_payload(&recording);
    let wrong = with_end_azimuth(&good, 353.0);
    let mut session = Session::new(good.clone());
    assert!(session.send_good());
    for (payload, answered) in [
        (&wrong, false),
        (&good, true),
        (&wrong, false),
        (&wrong, true),
        (&good, true),
    ] {
        session.good_payload.clone_from(payload);
        assert_eq!(session.send_good(), answered);
    }
    session.check_counts();
    assert_eq!(session.faults, BTreeMap::from([("uneven_step", 2)]));
}

type Items<'a> = Vec<Result<Entry<'a>, Damage>>;

fn items(recording: &[u8]) -> Items<'_> {
    Recording::new(recording).collect()
}

fn entries<'a>(items: &Items<'a>) -> Vec<Entry<'a>> {
    items.iter().filter_map(|item| item.clone().ok()).collect()
}

/// Where to cut a recording: around the ends of its frames and anywhere.
fn cuts(recording: &[u8], random: &mut Random, count: usize) -> Vec<usize> {
    let starts = entries(&items(recording))
        .into_iter()
        .map(|entry| entry.offset);
    let near = starts.flat_map(|start| start.saturating_sub(12)..start + 12);
    let anywhere = (0..count).map(|_| random.below(recording.len()));
    near.chain(anywhere).collect()
}

#[test]
#[cfg_attr(not(shared_data), ignore = "needs ../shared/data")]
fn a_cut_recording_has_every_entry_before_the_cut_and_one_damage() {
    let mut random = Random::new(31);
    for name in [
        REVOLUTIONS,
        "hdl32e-synthetic.rec",
        "vlp16-synthetic-5hz.rec",
    ] {
        let Some(recording) = bytes(name) else { return };
        let whole = entries(&items(&recording));
        for cut in cuts(&recording, &mut random, 300) {
            check_cut(&recording[..cut], &whole, name);
        }
    }
}

fn check_cut(recording: &[u8], whole: &[Entry<'_>], name: &str) {
    let cut = recording.len();
    let found = items(recording);
    let kept: Vec<_> = whole
        .iter()
        .filter(|entry| end(entry) <= cut)
        .copied()
        .collect();
    let kept_end = kept.last().map_or(0, end);
    assert_eq!(entries(&found), kept, "{name} cut at {cut}");
    let damages: Vec<_> = found
        .iter()
        .filter_map(|item| item.as_ref().err())
        .collect();
    if kept_end == cut {
        assert!(damages.is_empty(), "{name} cut at {cut}");
        return;
    }
    let [damage] = damages[..] else {
        panic!("{name} cut at {cut}: {damages:?}")
    };
    assert_eq!((damage.offset, damage.skipped), (kept_end, cut - kept_end));
    assert_eq!(damage.error.name(), "frame_truncated");
}

fn end(entry: &Entry<'_>) -> usize {
    entry.offset + entry.frame.len()
}

#[test]
fn a_recording_after_a_cut_one_is_found_again_and_no_byte_is_lost() {
    let recording = recording();
    let mut random = Random::new(8);
    let whole = entries(&items(&recording));
    for cut in cuts(&recording, &mut random, 60) {
        let joined = [&recording[..cut], &recording].concat();
        let found = items(&joined);
        assert_eq!(tiled_len(&found), joined.len(), "cut at {cut}");
        let found = entries(&found);
        let before = whole.iter().filter(|entry| end(entry) <= cut).count();
        assert_eq!(found[..before], whole[..before], "cut at {cut}");
        // The last frame before the cut may swallow up to two frames after it.
        let after: Vec<_> = found
            .iter()
            .rev()
            .take(2)
            .map(|entry| entry.frame)
            .collect();
        assert_eq!(after, [whole[3].frame, whole[2].frame], "cut at {cut}");
    }
}

/// The length of a recording that its items cover without gap or overlap.
fn tiled_len(items: &Items<'_>) -> usize {
    items.iter().fold(0, |covered, item| {
        let (offset, length) = match item {
            Ok(entry) => (entry.offset, entry.frame.len()),
            Err(damage) => (damage.offset, damage.skipped),
        };
        assert_eq!(offset, covered);
        covered + length
    })
}

#[test]
fn a_mutated_recording_is_walked_to_its_end_without_gaps() {
    let golden = frames();
    let recording = golden.concat();
    let mut random = Random::new(77);
    for _ in 0..2000 {
        let mutant = mutated(&mut random, &recording, &recording);
        assert_eq!(tiled_len(&items(&mutant)), mutant.len());
    }
}

#[test]
#[cfg_attr(not(shared_data), ignore = "needs ../shared/data")]
fn a_recording_that_follows_itself_loses_its_first_whole_revolution() {
    let recording = recording();
    let mut session = Session::new(good_payload(&recording));
    for entry in items(&recording.repeat(2)) {
        let _ = session.handle(&entry.unwrap().envelope);
    }
    session.check_counts();
    assert_eq!(
        (session.answers, session.pipeline.counts().time_jumps),
        (5, 1)
    );
    let expected = BTreeMap::from([("first_azimuth", 2), ("out_of_order", 1)]);
    assert_eq!(session.faults, expected);
}

#[test]
fn cut_recordings_end_to_end_do_no_harm_to_the_pipeline() {
    let recording = recording();
    let mut session = Session::new(good_payload(&recording));
    let mut random = Random::new(15);
    for _ in 0..40 {
        let (first, second) = (random.below(recording.len()), random.below(recording.len()));
        let joined = [&recording[..first], &recording[second..]].concat();
        for entry in entries(&items(&joined)) {
            let _ = session.handle(&entry.envelope);
        }
    }
    session.check_counts();
    assert!(session.good_until_answered(AFTER_MANY) <= AFTER_ONE);
}
