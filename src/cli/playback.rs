//! A recording that is played in the view: on, paused, step by step, and sought.

use std::collections::BTreeSet;
use std::time::Duration;

use tokio::sync::mpsc;
use tokio::time::{Instant, sleep_until};

use super::replay::LONGEST_PAUSE_S;
use crate::config::Configuration;
use crate::pipeline::{Outcome, Pipeline, RevolutionReport, Step};
use crate::roadmap::Roadmap;
use crate::view::{Control, Feed, Player};
use crate::wire::Message as _;
use crate::wire::point_cloud::POINT_CLOUD_ID;
use crate::wire::recording::Entry;
use crate::wire::velodyne::captured::SensorPackets;

/// When the point clouds of a recording are due, in seconds since its begin. Gaps are as long as they are waited for,
/// and it never goes back, whatever the time stamps do.
#[derive(Debug)]
pub(super) struct Timeline {
    /// Of every entry: when the point cloud at it, or the last one before, is due.
    due_s: Vec<f64>,
    /// The entries that are point clouds.
    clouds: Vec<usize>,
}

impl Timeline {
    /// Of a recording's entries, if there is a point cloud among them.
    pub(super) fn of(entries: &[Entry<'_>]) -> Option<Self> {
        let (mut due_s, mut clouds) = (vec![], vec![]);
        let (mut now_s, mut last) = (0.0, None);
        for (number, entry) in entries.iter().enumerate() {
            if [POINT_CLOUD_ID, SensorPackets::ID].contains(&entry.envelope.data_type) {
                let time = entry.envelope.time();
                let passed_s = last
                    .replace(time)
                    .map_or(0.0, |last| (time - last).seconds());
                now_s += passed_s.clamp(0.0, LONGEST_PAUSE_S);
                clouds.push(number);
            }
            due_s.push(now_s);
        }
        (!clouds.is_empty()).then_some(Self { due_s, clouds })
    }

    fn duration_s(&self) -> f64 {
        self.due_s.last().copied().unwrap_or(0.0)
    }

    /// The first point cloud that is due at a time or later.
    fn cloud_at(&self, at_s: f64) -> Option<usize> {
        self.clouds
            .iter()
            .copied()
            .find(|cloud| self.due_s[*cloud] >= at_s)
    }

    /// The point cloud so many after an entry, or the last one.
    fn cloud_after(&self, entry: Option<usize>, more: usize) -> Option<usize> {
        let passed = self.clouds.partition_point(|cloud| Some(*cloud) <= entry);
        let last = self.clouds.len() - 1;
        self.clouds
            .get((passed + more).saturating_sub(1).min(last))
            .copied()
    }
}

/// A recording that is played, and how far.
pub(super) struct Playback<'a> {
    configuration: Configuration,
    roads: Option<Roadmap>,
    pipeline: Pipeline,
    entries: Vec<Entry<'a>>,
    timeline: Timeline,
    next: usize,
    /// The entry that is shown, and its revolution.
    shown: Option<(usize, RevolutionReport)>,
    /// Entries that were ever answered.
    answered: BTreeSet<usize>,
    /// The entry to which it goes without showing what lies before.
    sought: Option<usize>,
    feed: Feed,
    player: Player,
}

fn fresh(configuration: &Configuration, roads: Option<&Roadmap>) -> Pipeline {
    let mut pipeline = Pipeline::new(configuration, 0);
    if let Some(roads) = roads {
        pipeline.take_map(roads);
    }
    pipeline
}

/// Speeds that a viewer may choose.
const SPEEDS: std::ops::RangeInclusive<f64> = 0.1..=100.0;

/// How often somebody is looked for, and how often it is shown while it is paused.
const IDLE: Duration = Duration::from_millis(200);

impl<'a> Playback<'a> {
    /// A recording at its begin.
    pub(super) fn new(
        configuration: Configuration,
        roads: Option<Roadmap>,
        entries: Vec<Entry<'a>>,
        timeline: Timeline,
        feed: Feed,
    ) -> Self {
        Self {
            pipeline: fresh(&configuration, roads.as_ref()),
            configuration,
            roads,
            entries,
            player: Player {
                at_s: 0.0,
                duration_s: timeline.duration_s(),
                is_playing: true,
                speed: 1.0,
                run: 0,
            },
            timeline,
            next: 0,
            shown: None,
            answered: BTreeSet::new(),
            sought: None,
            feed,
        }
    }

    /// Plays for ever: it waits while nobody looks, and at its end to be begun anew.
    pub(super) async fn run(&mut self, mut controls: mpsc::Receiver<Control>) {
        let mut due = Instant::now();
        loop {
            let is_idle =
                !self.feed.is_watched() || (!self.player.is_playing && self.sought.is_none());
            let wake = if is_idle { Instant::now() + IDLE } else { due };
            tokio::select! {
                biased;
                Some(control) = controls.recv() => {
                    self.obey(control);
                    due = Instant::now();
                    continue;
                }
                () = sleep_until(wake) => {}
            }
            if is_idle {
                // Whoever comes now sees something, too.
                self.show();
                due = Instant::now();
                continue;
            }
            let before_s = self.player.at_s;
            let is_answered = self.revolve();
            if !is_answered {
                self.end();
            }
            if is_answered && self.sought.is_some_and(|sought| self.next <= sought) {
                // Viewers and signals have their turn.
                tokio::task::yield_now().await;
                continue;
            }
            self.sought = None;
            self.show();
            let passed_s = (self.player.at_s - before_s).clamp(0.0, LONGEST_PAUSE_S);
            due = due.max(Instant::now() - IDLE)
                + Duration::from_secs_f64(passed_s / self.player.speed);
        }
    }

    fn obey(&mut self, control: Control) {
        match control {
            Control::Play(is_playing) => {
                self.player.is_playing = is_playing;
                let is_at_end = self.timeline.clouds.iter().all(|cloud| *cloud < self.next);
                if is_playing && is_at_end {
                    self.begin_anew();
                }
            }
            Control::Speed(speed) if speed.is_finite() => {
                self.player.speed = speed.clamp(*SPEEDS.start(), *SPEEDS.end());
            }
            Control::Seek(at_s) if at_s.is_finite() => {
                let at_s = at_s.clamp(0.0, self.player.duration_s);
                self.seek(self.timeline.cloud_at(at_s));
            }
            Control::Step(revolutions) => {
                self.player.is_playing = false;
                let from = self.sought.or(self.shown.map(|(entry, _)| entry));
                let count = revolutions.unsigned_abs() as usize;
                self.seek(if revolutions >= 0 {
                    self.timeline.cloud_after(from, count)
                } else {
                    let before = self.answered.range(..from.unwrap_or(0));
                    before.rev().take(count).last().copied().or(from)
                });
            }
            Control::Speed(_) | Control::Seek(_) => {}
        }
    }

    /// Goes to an entry, from the begin if it lies behind.
    fn seek(&mut self, entry: Option<usize>) {
        let Some(entry) = entry else { return };
        if self.shown.is_some_and(|(shown, _)| shown == entry) && self.sought.is_none() {
            return;
        }
        if entry < self.next {
            self.begin_anew();
        }
        self.sought = Some(entry);
    }

    fn begin_anew(&mut self) {
        self.pipeline = fresh(&self.configuration, self.roads.as_ref());
        self.feed.forget();
        (self.next, self.shown) = (0, None);
        self.player.at_s = 0.0;
        self.player.run = self.player.run.wrapping_add(1);
    }

    /// There is nothing more to perceive.
    fn end(&mut self) {
        self.player.is_playing = false;
        if self.shown.is_none() {
            let faults = &self.pipeline.counts().faults;
            tell!("kreisel: nothing to show: every point cloud is refused: {faults}");
        }
    }

    /// Perceives up to the next revolution that can be answered. Gives whether there was one.
    fn revolve(&mut self) -> bool {
        while let Some(entry) = self.entries.get(self.next) {
            let number = self.next;
            self.next += 1;
            self.feed.begin();
            let begun = Instant::now();
            let note = |step| self.feed.note(step);
            let Ok(Outcome::Revolution(report)) =
                self.pipeline.handle_watched(&entry.envelope, note)
            else {
                continue;
            };
            let processing_s = begun.elapsed().as_secs_f32();
            for frame in self.pipeline.publish_objects(report.time, processing_s) {
                self.feed.put(frame);
            }
            self.pipeline.update_map();
            self.feed.note(Step::Map);
            for frame in self.pipeline.publish_map(report.time) {
                self.feed.put(frame);
            }
            self.shown = Some((number, report));
            self.answered.insert(number);
            self.player.at_s = self.timeline.due_s[number];
            return true;
        }
        false
    }

    fn show(&mut self) {
        if let Some((_, report)) = &self.shown {
            self.feed.put_message(report.time, &self.pipeline.status());
            self.feed.show(&self.pipeline, report, Some(self.player));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::Time;
    use crate::wire::Recording;
    use crate::wire::envelope::Postmark;

    fn recording(seconds: &[(i32, f64)]) -> Vec<u8> {
        let mut bytes = vec![];
        for (data_type, seconds) in seconds {
            let time = Time::from_micros((1e6 * seconds) as i64);
            let postmark = Postmark {
                sent: time,
                sampled: time,
                sender_stamp: 0,
            };
            postmark.put_payload(&mut bytes, *data_type, |_| ());
        }
        bytes
    }

    #[test]
    fn a_timeline_never_goes_back_and_waits_no_longer_than_a_second() {
        let bytes = recording(&[
            (19, 1.0),
            (49, 5.0),
            (49, 5.1),
            (19, 5.15),
            (49, 900.0),
            (49, 2.0),
            (49, 2.5),
        ]);
        let entries: Vec<_> = Recording::new(&bytes).flatten().collect();
        let timeline = Timeline::of(&entries).unwrap();
        let rounded = timeline
            .due_s
            .iter()
            .map(|due_s| (10.0 * due_s).round() as i32);
        assert_eq!(rounded.collect::<Vec<_>>(), [0, 0, 1, 1, 11, 11, 16]);
        assert_eq!(timeline.cloud_at(0.05), Some(2));
        assert_eq!(timeline.cloud_at(1.05), Some(4));
        assert_eq!(timeline.cloud_after(Some(2), 1), Some(4));
        assert_eq!(timeline.cloud_after(None, 1), Some(1));
        assert_eq!(timeline.cloud_after(Some(6), 3), Some(6));
        assert!(Timeline::of(&entries[..1]).is_none());
    }
}
