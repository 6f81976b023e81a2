//! How the sensor moves, from what it sees: each revolution is aligned with a small map of what stands.
//!
//! `features` and `poles` pick returns that tell something, `map` keeps what stands: `surfaces` and `uprights` in
//! `cells`. `registration` finds the pose from which the one lies on the other, `motion` knows where that must be
//! about, `search` looks farther where the sensor was jerked; `beginning` begins a frame, and `doubts` asks whether the
//! first motion was right.
//! This file takes a revolution through them, in the manner of KISS-ICP (Vizzo et al. 2023).

mod beginning;
mod cells;
mod doubts;
mod features;
mod guide;
mod map;
mod motion;
mod poles;
mod registration;
mod report;
mod search;
mod surfaces;
mod uprights;

use nalgebra::{Vector3, Vector6};

use crate::cloud::Scan;
use crate::geometry::{self, Rigid};
use crate::time::{Span, Time};
use doubts::Unsettled;
use features::Feature;
use map::{Map, View};
use motion::Motion;
use registration::{Agreement, Alignment, Links};

pub use report::{OdometryReport, Quality};
use search::Reach;

/// The odometry step.
#[derive(Debug, Clone)]
pub struct Odometry {
    motion: Motion,
    /// The middle of the last sweep: what the motion holds at.
    time: Option<Time>,
    /// Since the sweep before, and where the sensor was then.
    passed_s: f64,
    from_m: Vector3<f64>,
    /// The motion with which the view was moved to the middle of the sweep.
    skewed: Motion,
    map: Map,
    /// As the sensor met them, and as seen from the middle of the sweep.
    met: View,
    view: View,
    links: Links,
    /// Motions that are looked for, and how well each fits.
    found: Vec<(f64, Vector6<f64>)>,
    state: State,
    /// How far off the velocity may be at which the frame began, m/s, if one was told.
    led_within_mps: Option<f64>,
    /// Revolutions since then that were followed, while it is young.
    followed: u32,
    /// In so many of them, up to the last one, another motion fitted better.
    doubted: u32,
    epoch: u32,
    /// One in so many columns is looked at.
    every: usize,
    usual_off_m: f64,
    /// How well what is upright usually fits.
    usual_agreement: Agreement,
    report: OdometryReport,
    /// What waits for [`Odometry::settle`].
    unsettled: Option<Unsettled>,
}

/// How much is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// Nothing: the next revolution begins the map.
    New,
    /// One revolution, and no velocity.
    Begun,
    /// The motion is followed.
    Following,
    /// So many revolutions in a row did not fit.
    Lost(u32),
}

/// What may have become of a revolution.
#[derive(Debug, Clone, Copy)]
struct Attempt {
    motion: Motion,
    alignment: Alignment,
}

/// How far features lie off at first, and the share of a revolution in how far they usually do.
const FIRST_OFF_M: f64 = 0.05;
const FRESH: f64 = 0.1;
/// Deviation of the place from which on what is seen does not tell it.
const MOST_DEVIATION_M: f64 = 0.1;
/// One in so many columns is looked at first.
const FIRST_EVERY: usize = 8;
/// Fewer features say nothing.
const FEWEST: usize = 40;
/// Share of them that must have a surface near them, and of these that must lie on it.
const LEAST_MET: f64 = 0.25;
const LEAST_FITTING: f64 = 0.5;
/// Share of the usual agreement below which the sensor was jerked.
const LEAST_AGREEMENT: f64 = 0.5;
/// Revolutions in a row that may be lost before another map begins.
const PATIENCE: u32 = 5;
/// How often a revolution is aligned anew because it was skewed otherwise than thought.
const MOST_TURNS: usize = 3;
/// How surprising a pose may be before the prediction is trusted less.
const MOST_SURPRISE: f64 = 2.0;

impl Default for Odometry {
    fn default() -> Self {
        Self {
            motion: Motion::begin(Rigid::IDENTITY, None),
            time: None,
            passed_s: 0.0,
            from_m: Vector3::zeros(),
            skewed: Motion::begin(Rigid::IDENTITY, None),
            map: Map::new(),
            met: View::default(),
            view: View::default(),
            links: Links::default(),
            found: Vec::with_capacity(128),
            state: State::New,
            led_within_mps: None,
            followed: 0,
            doubted: 0,
            epoch: 0,
            every: FIRST_EVERY,
            usual_off_m: FIRST_OFF_M,
            usual_agreement: Agreement::default(),
            report: OdometryReport::default(),
            unsettled: None,
        }
    }
}

impl Odometry {
    /// Counts how often a frame began because the sensor was lost.
    pub fn epoch(&self) -> u32 {
        self.epoch
    }

    /// Goes on to the middle of a scan, for [`Odometry::guide`] and [`Odometry::process`].
    pub fn predict(&mut self, scan: &Scan) {
        self.settle();
        let middle = scan.time() + Span::from_seconds(-0.5 * scan.duration_s());
        self.passed_s = self.time.map_or(0.0, |last| (middle - last).seconds());
        self.time = Some(middle);
        self.from_m = self.motion.pose.translation_m;
        self.motion.predict(self.passed_s);
    }

    /// How fast the sensor goes in a direction along the ground.
    pub fn speed_mps(&self, ahead_rad: f64) -> f64 {
        let (sine, cosine) = libm::sincos(ahead_rad);
        self.motion.velocity[0] * cosine + self.motion.velocity[1] * sine
    }

    /// How fast it turns, counter-clockwise.
    pub fn yaw_rate_radps(&self) -> f64 {
        self.motion.velocity[5]
    }

    /// Where the sensor is thought to be in the middle of the last sweep, or of the one that is predicted.
    pub fn pose(&self) -> Rigid {
        self.motion.pose
    }

    /// Where the sensor is expected to be at the end of a scan.
    pub fn expected(&self, scan: &Scan) -> Rigid {
        let seconds = self.time.map_or(0.0, |last| (scan.time() - last).seconds());
        self.motion.pose.moved(&(self.motion.velocity * seconds))
    }

    /// Takes a scan in. `is_used` says of a column and a point whether what it met stands.
    pub fn process(&mut self, scan: &Scan, is_used: impl Fn(usize, [f32; 3]) -> bool) {
        features::gather(
            scan,
            self.every,
            &is_used,
            &mut self.met.surfaces,
            &mut self.met.foliage,
        );
        poles::gather(scan, &is_used, &mut self.met.poles);
        self.thin();
        self.report = OdometryReport::default();
        if self.state == State::New {
            self.begin_map();
            self.report.quality = Quality::Begun;
            return;
        }
        let predicted = self.motion;
        let mut attempt = self.attempt(predicted);
        let mut doubtful = None;
        if self.state == State::Begun {
            let found = self.search(predicted, attempt, Reach::Anywhere);
            // Where little is upright another motion may seem to fit better than the one that poses tell.
            let off = geometry::linear(&(found.motion.velocity - predicted.velocity));
            let within_mps = self.led_within_mps.unwrap_or(f64::INFINITY);
            if off.norm_squared() > within_mps * within_mps {
                self.unskew(&attempt.motion);
            } else {
                attempt = found;
            }
        } else if !self.is_usual(&attempt) {
            attempt = self.search(predicted, attempt, Reach::Jerk);
        } else if self.is_young() {
            doubtful = Some((predicted, attempt));
        }
        let fits = self.take(scan, &attempt);
        self.unsettled = (self.state != State::New).then_some(Unsettled { doubtful, fits });
    }

    /// Looks at more columns in the next revolution where little is seen, and at less where much is.
    fn thin(&mut self) {
        const ENOUGH: std::ops::Range<usize> = 300..450;
        const MOST_EVERY: usize = 14;
        const LEAST_EVERY: usize = 4;
        let found = self.met.surfaces.len() + self.met.foliage.len() / 2;
        if found < ENOUGH.start {
            self.every = (self.every - 1).max(LEAST_EVERY);
        } else if found > ENOUGH.end {
            self.every = (self.every + 1).min(MOST_EVERY);
        }
    }

    /// Aligns the revolution from a prediction.
    fn attempt(&mut self, mut predicted: Motion) -> Attempt {
        self.unskew(&predicted);
        let mut start = predicted.pose;
        let mut turns = 0;
        loop {
            let mut alignment = self.align(&predicted, &start);
            let surprise = predicted.surprise(&alignment.pose);
            if surprise > MOST_SURPRISE {
                predicted.loosen(surprise);
                alignment = self.align(&predicted, &alignment.pose);
            }
            let motion = predicted.corrected(alignment.pose, &alignment.information);
            turns += 1;
            if turns == MOST_TURNS || !motion.skews_otherwise(&self.skewed.velocity) {
                return Attempt { motion, alignment };
            }
            start = alignment.pose;
            self.unskew(&motion);
        }
    }

    fn align(&mut self, predicted: &Motion, start: &Rigid) -> Alignment {
        registration::align(
            &self.map,
            &self.view,
            predicted,
            start,
            self.usual_off_m,
            &mut self.links,
        )
    }

    /// Whether what is upright fits as well as usual, if there is any.
    fn is_usual(&self, attempt: &Attempt) -> bool {
        // Something large that moves takes its share, what is new takes its sum.
        attempt.alignment.agreement.is_none_or(|agreement| {
            agreement.share >= LEAST_AGREEMENT * self.usual_agreement.share
                || agreement.sum >= LEAST_AGREEMENT * self.usual_agreement.sum
        })
    }

    /// Makes an attempt the motion, if it fits, and tells whether the revolution is one for the map.
    fn take(&mut self, scan: &Scan, attempt: &Attempt) -> bool {
        let alignment = &attempt.alignment;
        self.report = OdometryReport {
            features: self.view.surfaces.len(),
            met: alignment.met,
            fitting: alignment.fitting,
            off_m: alignment.off_m,
            deviation_m: alignment.deviation_m,
            quality: if alignment.deviation_m < MOST_DEVIATION_M {
                Quality::Following
            } else {
                Quality::Degenerate
            },
        };
        let fits = self.fits(alignment);
        if fits {
            self.motion = attempt.motion;
            let way_m = self.motion.pose.translation_m - self.from_m;
            self.map.advance(libm::sqrt(way_m.norm_squared()));
        }
        if !fits || !self.is_usual(attempt) {
            self.lose();
            return false;
        }
        self.usual_off_m += FRESH * (alignment.off_m - self.usual_off_m);
        if let Some(agreement) = attempt.alignment.agreement {
            let usual = &mut self.usual_agreement;
            usual.share += FRESH * (agreement.share - usual.share);
            usual.sum += FRESH * (agreement.sum - usual.sum);
        }
        if self.state == State::Begun && !self.is_led() {
            // The first sweep was taken for one from a standing sensor: it ended farther on.
            let early_s = -0.5 * scan.duration_s();
            self.motion.pose = self.motion.pose.moved(&(self.motion.velocity * early_s));
            self.map.clear();
        }
        self.state = State::Following;
        true
    }

    /// Counts a revolution that does not fit the map, and begins another map when there were too many.
    fn lose(&mut self) {
        let times = match self.state {
            State::Lost(times) => times + 1,
            _ => 1,
        };
        self.state = State::Lost(times);
        self.report.quality = Quality::Lost;
        if times > PATIENCE {
            self.begin_anew();
        }
    }

    /// Begins another frame with the next revolution, where the sensor is thought to be by now.
    fn begin_anew(&mut self) {
        let pose = self.motion.pose;
        self.begin(&pose, None);
        self.report.quality = Quality::Lost;
        self.epoch = self.epoch.wrapping_add(1);
    }

    fn fits(&self, alignment: &Alignment) -> bool {
        let share = |part: usize, of: usize| part as f64 / of.max(1) as f64;
        self.view.surfaces.len() >= FEWEST
            && share(alignment.met, self.view.surfaces.len()) >= LEAST_MET
            && share(alignment.fitting, alignment.met) >= LEAST_FITTING
    }

    /// Moves the features to where the sensor would have met them from the middle of the sweep.
    fn unskew(&mut self, motion: &Motion) {
        self.skewed = *motion;
        let back = motion.pose.rotation.transpose();
        let velocity = back * geometry::linear(&motion.velocity);
        let rate = back * geometry::angular(&motion.velocity);
        let moved = |feature: &Feature| {
            // Turns during half a sweep are small: two terms of the series leave less than 1e-4.
            let axis = rate * feature.late_s;
            let turned = |v: &Vector3<f64>| {
                let first = axis.cross(v);
                v + first + 0.5 * axis.cross(&first)
            };
            Feature {
                point_m: turned(&feature.point_m) + velocity * feature.late_s,
                normal: turned(&feature.normal),
                ..*feature
            }
        };
        self.met.put(&mut self.view, moved);
    }

    /// Where the sensor was, seconds after the end of the last sweep or, negative, before.
    pub fn pose_at(&self, scan: &Scan, after_end_s: f64) -> Rigid {
        let seconds = after_end_s + 0.5 * scan.duration_s();
        self.motion.pose.moved(&(self.motion.velocity * seconds))
    }

    /// What became of the last revolution.
    pub fn report(&self) -> &OdometryReport {
        &self.report
    }
}
