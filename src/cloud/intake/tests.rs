use super::*;
use crate::parameter::Profile;
use crate::wire::TimeStamp;

struct Sender {
    intake: Intake,
    parameters: CloudParameters,
    micros: i64,
}

impl Sender {
    fn new() -> Self {
        Self {
            intake: Intake::default(),
            parameters: CloudParameters::profile(Profile::Default),
            micros: 1_700_000_000_000_000,
        }
    }

    fn send(&mut self, start: f32, end: f32, columns: usize) -> Result<f64, Refusal> {
        self.micros += 100_000;
        self.send_at(self.micros, start, end, columns)
    }

    fn send_at(
        &mut self,
        micros: i64,
        start: f32,
        end: f32,
        columns: usize,
    ) -> Result<f64, Refusal> {
        // Every column is farther than the one before: a piece of a turn by its looks.
        let distances: Vec<u8> = (0..columns as u16)
            .flat_map(|column| std::iter::repeat_n(1000 + column, 16))
            .flat_map(u16::to_be_bytes)
            .collect();
        let cloud = CompactPointCloud {
            start_azimuth_deg: start,
            end_azimuth_deg: end,
            layers: 16,
            distances: &distances,
            ..CompactPointCloud::default()
        };
        let envelope = Envelope {
            sample_time_stamp: TimeStamp::from(Time::from_micros(micros)),
            ..Envelope::default()
        };
        let taken = self.intake.accept(&envelope, cloud, &self.parameters);
        taken.map(|revolution| revolution.step_deg)
    }
}

fn refused(result: Result<f64, Refusal>) -> &'static str {
    result.map_or_else(|refusal| refusal.name(), |_| "accepted")
}

#[test]
fn a_first_message_whose_azimuth_lies_is_refused_and_the_next_ones_are_not() {
    let mut sender = Sender::new();
    assert_eq!(refused(sender.send(0.0, 359.895, 656)), "first_azimuth");
    assert_eq!(refused(sender.send(0.09, 359.925, 1810)), "accepted");
    assert_eq!(refused(sender.send(0.12, 359.95, 1811)), "accepted");
    assert_eq!(refused(sender.send(0.0, 359.895, 900)), "first_azimuth");
    assert_eq!(refused(sender.send(0.15, 359.93, 1812)), "accepted");
}

#[test]
fn synthetic_revolutions_from_zero_are_taken_from_the_first_on() {
    for columns in [904, 1800, 1803] {
        assert_eq!(refused(Sender::new().send(0.0, 360.0, columns)), "accepted");
    }
}

#[test]
fn an_unusual_step_is_taken_when_it_comes_twice() {
    let mut sender = Sender::new();
    assert_eq!(refused(sender.send(0.0, 359.0, 360)), "first_azimuth");
    assert_eq!(refused(sender.send(0.0, 359.0, 360)), "accepted");
}

#[test]
fn lost_packets_and_split_revolutions_are_refused() {
    let mut sender = Sender::new();
    assert_eq!(refused(sender.send(0.1, 359.9, 1808)), "accepted");
    assert_eq!(refused(sender.send(0.1, 359.9, 1784)), "uneven_step");
    assert_eq!(refused(sender.send(0.1, 359.9, 1808)), "accepted");
    assert_eq!(refused(sender.send(0.0, 189.6, 1875)), "partial_revolution");
    assert_eq!(
        refused(sender.send(187.4, 359.9, 1702)),
        "partial_revolution"
    );
}

#[test]
fn a_sweep_over_zero_and_a_falling_one_keep_their_direction() {
    let step = 359.8 / 1799.0;
    let over_zero = Sender::new().send(200.0, 199.8, 1800).unwrap();
    assert!((over_zero - step).abs() < 1e-6);
    let falling = Sender::new().send(215.0, -144.8, 1800).unwrap();
    assert!((falling + step).abs() < 1e-6);
}

#[test]
fn impossible_azimuths_are_refused() {
    for (start, end) in [
        (f32::NAN, 1.0),
        (0.0, f32::INFINITY),
        (0.0, 1e9),
        (-10.0, 360.0),
    ] {
        assert_eq!(
            refused(Sender::new().send(start, end, 1800)),
            "impossible_azimuth"
        );
    }
}

#[test]
fn disorder_is_refused_and_a_restart_is_not() {
    let mut sender = Sender::new();
    let now = sender.micros;
    assert_eq!(refused(sender.send_at(now, 0.1, 359.9, 1800)), "accepted");
    assert_eq!(
        refused(sender.send_at(now, 0.1, 359.9, 1800)),
        "out_of_order"
    );
    assert_eq!(
        refused(sender.send_at(now - 200_000, 0.1, 359.9, 1800)),
        "out_of_order"
    );
    assert_eq!(
        refused(sender.send_at(now - 8_000_000, 0.1, 359.9, 1800)),
        "accepted"
    );
    assert_eq!(
        refused(sender.send_at(now - 7_900_000, 0.1, 359.9, 1800)),
        "accepted"
    );
}

#[test]
fn more_columns_than_the_array_has_are_refused() {
    assert_eq!(refused(Sender::new().send(0.1, 359.9, 2000)), "accepted");
    assert_eq!(
        refused(Sender::new().send(0.1, 359.9, 2001)),
        "too_many_columns"
    );
}

#[test]
fn shapes_that_the_array_cannot_hold_are_refused_by_name() {
    let shape = |layers, distances, intensity_bits| {
        let cloud = CompactPointCloud {
            end_azimuth_deg: 359.8,
            layers,
            distances,
            intensity_bits,
            ..CompactPointCloud::default()
        };
        let parameters = CloudParameters::profile(Profile::Default);
        let result = Intake::default().accept(&Envelope::default(), cloud, &parameters);
        result.map_or_else(|refusal| refusal.name(), |_| "accepted")
    };
    assert_eq!(shape(0, &[1; 32], 0), "zero_layers");
    assert_eq!(shape(16, &[], 0), "no_distances");
    assert_eq!(shape(16, &[1; 33], 0), "broken_columns");
    assert_eq!(shape(12, &[1; 24], 0), "too_many_layers");
    assert_eq!(shape(13, &[1; 26], 0), "unknown_sensor");
    assert_eq!(shape(16, &[1; 64], 16), "unknown_encoding");
}

#[test]
fn the_first_sender_is_listened_to_and_another_one_while_it_is_silent() {
    let mut sender = Sender::new();
    let distances = [1; 32 * 1800];
    let mut send = |stamp: u32, micros: i64| {
        let cloud = CompactPointCloud {
            end_azimuth_deg: 359.8,
            layers: 16,
            distances: &distances,
            ..CompactPointCloud::default()
        };
        let envelope = Envelope {
            sender_stamp: stamp,
            sample_time_stamp: TimeStamp::from(Time::from_micros(micros)),
            ..Envelope::default()
        };
        sender
            .intake
            .accept(&envelope, cloud, &sender.parameters)
            .is_ok()
    };
    assert!(send(3, 1_000_000));
    assert!(!send(4, 1_050_000));
    assert!(send(3, 1_100_000));
    let taken = (0..30).filter(|n| send(4, 1_200_000 + n * 100_000)).count();
    assert_eq!(taken, 10);
    assert!(send(3, 4_200_000));
    assert!(!send(4, 4_300_000));
}

#[test]
fn of_two_other_senders_one_is_followed_when_the_first_is_silent() {
    let mut sender = Sender::new();
    let distances = [1; 32 * 1800];
    let mut send = |stamp: u32, tenths: i64| {
        let cloud = CompactPointCloud {
            end_azimuth_deg: 359.8,
            layers: 16,
            distances: &distances,
            ..CompactPointCloud::default()
        };
        let envelope = Envelope {
            sender_stamp: stamp,
            sample_time_stamp: TimeStamp::from(Time::from_micros(100_000 * tenths)),
            ..Envelope::default()
        };
        let taken = sender.intake.accept(&envelope, cloud, &sender.parameters);
        taken.is_ok()
    };
    assert!(send(3, 1));
    let taken = (0..60).filter(|n| send(4 + (n % 2) as u32, 2 + n)).count();
    assert_eq!(taken, 20);
}

#[test]
fn one_message_from_the_near_future_costs_one_revolution() {
    let mut sender = Sender::new();
    let now = sender.micros;
    let mut send = |millis: i64| refused(sender.send_at(now + 1000 * millis, 0.1, 359.9, 1800));
    assert_eq!(send(0), "accepted");
    assert_eq!(send(800), "accepted");
    assert_eq!(send(100), "out_of_order");
    assert_eq!(send(200), "accepted");
    assert_eq!(send(300), "accepted");
}

#[test]
fn a_rate_that_two_odd_messages_agree_on_does_not_displace_the_right_one() {
    let mut sender = Sender::new();
    assert_eq!(refused(sender.send(0.1, 359.9, 1808)), "accepted");
    assert_eq!(refused(sender.send(0.1, 352.0, 1808)), "uneven_step");
    assert_eq!(refused(sender.send(0.1, 352.5, 1808)), "accepted");
    assert_eq!(refused(sender.send(0.1, 359.9, 1808)), "accepted");
}
