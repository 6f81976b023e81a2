//! One road user, or what may become one: motion, shape, class, and whether it exists.

use nalgebra::{Matrix2, Vector2};

mod gating;

mod measured;

mod newness;

mod published;

mod rest;

mod reunion;

mod vacated;

use super::TrackParameters;
use super::belief::Belief;
use super::class::Class;
use super::existence::Existence;
use super::look::Look;
use super::motion::Motion;
use super::shape::Shape;
use super::sight::Sight;
use super::spots::Spot;
use super::trace::Trace;
use super::trail::Trails;
use super::view::View;
use crate::geometry::Rectangle;
use crate::time::Time;
pub(super) use gating::GATE;
use newness::Newness;
pub(crate) use reunion::MOST_LOST_S;
use reunion::Parting;

/// Standard deviation of the velocity of something seen for the first time, and of a vehicle: who
/// comes at 100 km/h is two of them fast.
const BIRTH_MPS: f64 = 6.0;
const VEHICLE_BIRTH_MPS: f64 = 14.0;
/// Probability of a road user below which something is structure for sure.
const SURELY_NONE: f64 = 0.05;

/// Returns below which an object may be no cluster in the next revolution.
const SPARSE: usize = 16;

/// Time within which what nobody knows of may turn out to be a piece of something.
const YOUNG_S: f64 = 1.6;

/// Speed from which an object counts as moving.
const MOVING_MPS: f64 = 0.6;

/// Usual returns from which on it is met for sure by rays through its place; between the few that
/// meet what is thin and far away there are revolutions without any.
const SURELY_MET: f64 = 8.0;
/// Part of the doubt that is left for what is met least.
const LEAST_TELLING: f64 = 0.3;

#[derive(Debug, Clone)]
pub(super) struct Track {
    pub(super) id: u32,
    /// The time for which everything holds.
    time: Time,
    first_seen: Time,
    /// Since when it was not lost.
    seen_since: Time,
    pub(super) last_measured: Time,
    motion: Motion,
    shape: Shape,
    belief: Belief,
    roughness_m: f64,
    goes_on: f64,
    upper_m: Option<f64>,
    /// How much likelier its looks of late are those of somebody on foot than of anything else.
    person_log: Option<f64>,
    speed_mps: f64,
    /// Whether it was seen to move, and how far.
    moves: bool,
    travelled_m: f64,
    newness: Newness,
    is_suspect: bool,
    /// Where it was first seen, since its frame is the same.
    born_m: Vector2<f64>,
    trails: Trails,
    trace: Trace,
    /// Whether it looks like a vehicle, by its place.
    pub(in crate::track) looks_like_vehicle: bool,
    existence: Existence,
    points: usize,
    /// Mean of the returns of late, where there were any.
    usual_points: f64,
    range_m: f64,
    is_hidden: bool,
    floor_z_m: f64,
    /// Where and how fast it was when it was last seen clearly.
    parted: Parting,
    /// Whether it was likely enough once to be listed.
    pub(super) was_likely: bool,
    /// Whether others know its id.
    pub(super) is_listed: bool,
    /// Whether it is not looked at now.
    rests: bool,
    /// In which of the revolutions it is looked at while it rests.
    turn: u32,
    /// The probability that it is a vehicle, if it is only followed as one that stands.
    standing_vehicle: Option<f64>,
}

impl Track {
    pub(super) fn new(
        id: u32,
        is_suspect: bool,
        spots: &[Spot],
        look: &Look,
        end: Time,
        floor_z_m: f64,
        outline: &mut Vec<[f64; 2]>,
    ) -> Self {
        let shape = Shape::first(spots, look, outline);
        let time = look.seen_at(end);
        let mut track = Self {
            id,
            time,
            first_seen: time,
            seen_since: time,
            last_measured: time,
            motion: Motion::new(look.middle_m, Matrix2::identity(), BIRTH_MPS),
            shape,
            belief: Belief::unknown(),
            roughness_m: look.roughness_m,
            goes_on: look.goes_on,
            upper_m: look.upper_m,
            person_log: look.person_log,
            speed_mps: 0.0,
            moves: false,
            travelled_m: 0.0,
            newness: Newness::of(look),
            is_suspect,
            born_m: look.middle_m,
            trails: Trails::default(),
            trace: Trace::default(),
            looks_like_vehicle: false,
            existence: Existence::new(),
            points: look.points,
            usual_points: look.points as f64,
            range_m: look.range_m,
            is_hidden: false,
            floor_z_m,
            parted: Parting::default(),
            was_likely: false,
            is_listed: false,
            rests: false,
            turn: 0,
            standing_vehicle: None,
        };
        track.belief = Belief::of(&track.qualities());
        let view = View::of(look, spots, track.shape.yaw_rad);
        let (centre_m, noise) = track.centre(&view, look.middle_m);
        track.trails.begin(centre_m, time);
        track.born_m = centre_m;
        let birth_mps = if track.is_vehicle() {
            VEHICLE_BIRTH_MPS
        } else {
            BIRTH_MPS
        };
        track.motion = Motion::new(centre_m, noise, birth_mps);
        track.parted = Parting::of(&track.motion.estimate(), look.points, time);
        track
    }

    /// From here on it is a vehicle that stands, with a probability.
    pub(super) fn stand_as_vehicle(&mut self, probability: f64) {
        self.standing_vehicle = Some(probability);
        self.belief = self.belief.of_vehicle();
        self.motion.halt();
        (self.moves, self.travelled_m) = (false, 0.0);
    }

    /// Whether it is a vehicle that stands, which is known by its place.
    pub(super) fn is_left_standing(&self) -> bool {
        let is_vehicle = matches!(self.belief.class().0, Class::Car | Class::LargeVehicle);
        is_vehicle && !self.goes_beyond_doubt()
    }

    /// Carries the object on to a time.
    pub(super) fn predict(&mut self, to: Time) {
        let seconds = (to - self.time).seconds();
        if seconds > 0.0 {
            carry_on(&mut self.motion, &mut self.shape, seconds);
            self.time = to;
        }
    }

    /// What moves of it, carried on to a time.
    fn later(&self, to: Time) -> (Motion, Shape) {
        let (mut motion, mut shape) = (self.motion.clone(), self.shape.clone());
        let seconds = (to - self.time).seconds();
        if seconds > 0.0 {
            carry_on(&mut motion, &mut shape, seconds);
        }
        (motion, shape)
    }

    /// The box, if the object is where it is thought to be.
    pub(super) fn rectangle(&self) -> Rectangle {
        self.rectangle_of(&self.motion, &self.shape)
    }

    /// The box at a later time.
    pub(super) fn rectangle_at(&self, to: Time) -> Rectangle {
        let (motion, shape) = self.later(to);
        self.rectangle_of(&motion, &shape)
    }

    fn rectangle_of(&self, motion: &Motion, shape: &Shape) -> Rectangle {
        let [length_m, width_m] = shape.size_m(self.belief.vehicle());
        Rectangle {
            centre_m: motion.position_m().into(),
            yaw_rad: shape.yaw_rad,
            length_m,
            width_m,
        }
    }

    /// How far the object may be from where it is thought to be, one standard deviation.
    pub(super) fn spread_m(&self) -> f64 {
        libm::sqrt(0.5 * self.motion.position_covariance().trace())
    }

    pub(super) fn velocity_mps(&self) -> Vector2<f64> {
        self.motion.velocity_mps()
    }

    pub(super) fn position_m(&self) -> Vector2<f64> {
        self.motion.position_m()
    }

    pub(super) fn height_m(&self) -> f64 {
        self.shape.top_m
    }

    /// Where the lowest ray passed over it that ever did.
    pub(super) fn top_below_m(&self) -> f64 {
        self.shape.top_below_m
    }

    pub(super) fn yaw_rad(&self) -> f64 {
        self.shape.yaw_rad
    }

    /// Whether it is a vehicle that was seen to drive.
    pub(super) fn is_moving_vehicle(&self) -> bool {
        self.moves && self.shape.front_known && self.is_vehicle()
    }

    /// Whether it was seen to move, and does.
    pub(super) fn is_surely_moving(&self) -> bool {
        const LEAST_MPS: f64 = 0.5;
        self.moves && self.velocity_mps().norm() > LEAST_MPS
    }

    /// Whether it was ever seen to move.
    pub(super) fn has_moved(&self) -> bool {
        self.moves
    }

    /// The time for which everything holds.
    pub(super) fn time(&self) -> Time {
        self.time
    }

    /// Where it was at a time of late.
    pub(super) fn was_at_m(&self, time: Time) -> Option<Vector2<f64>> {
        self.trace.at(time)
    }

    /// Whether it may turn out to be a piece of something.
    pub(super) fn is_young(&self, now: Time) -> bool {
        !self.was_likely && !self.rests && (now - self.first_seen).seconds() < YOUNG_S
    }

    /// Whether it stands and is rather no road user: what comes before it is none of it.
    pub(super) fn is_background(&self) -> bool {
        const HARDLY: f64 = 0.25;
        !self.moves && !self.is_new() && self.belief.road_user() < HARDLY
    }

    /// Whether it is rather a vehicle than anything else on the road.
    pub(super) fn is_vehicle(&self) -> bool {
        self.belief.vehicle() > 0.5
    }

    /// Whether it moves, and a few rays meet it at most.
    pub(super) fn is_hardly_met(&self) -> bool {
        self.moves && self.usual_points < SURELY_MET
    }

    pub(super) fn is_confirmed(&self) -> bool {
        self.existence.is_confirmed()
    }

    /// Whether it returns so little that it may be no cluster.
    pub(super) fn is_sparse(&self) -> bool {
        self.points < SPARSE
    }

    /// Whether a group shows so much more than it did of late that it is no piece of it.
    pub(super) fn is_dwarfed_by(&self, look: &Look) -> bool {
        const TIMES: f64 = 4.0;
        /// Of a few returns there may be many more in the next revolution.
        const FEW: f64 = 4.0;
        look.points as f64 > TIMES * (self.usual_points + FEW)
    }

    pub(super) fn odds(&self) -> f64 {
        self.existence.odds()
    }

    /// The narrower side of what was seen of it.
    pub(super) fn narrow_m(&self) -> f64 {
        let [length_m, width_m] = self.shape.seen_m;
        length_m.min(width_m)
    }

    /// Nothing was found that is this object.
    pub(super) fn miss(&mut self, sight: &Sight, end: Time) {
        self.points = 0;
        self.is_hidden = sight.is_hidden();
        if !self.moves {
            self.motion.halt();
        }
        let age_s = (end - self.first_seen).seconds();
        self.existence.miss(sight, age_s, self.telling());
    }

    /// How much it says, 0 to 1, that nothing is found of it.
    fn telling(&self) -> f64 {
        if self.moves && !self.is_vehicle() {
            (self.usual_points / SURELY_MET).clamp(LEAST_TELLING, 1.0)
        } else {
            1.0
        }
    }

    /// Whether nothing is left of it.
    pub(super) fn is_gone(&self, parameters: &TrackParameters) -> bool {
        let unseen_s = (self.time - self.last_measured).seconds();
        self.existence.is_gone()
            || unseen_s > parameters.hidden_memory_s
            || (self.is_hidden && !self.is_confirmed())
    }

    pub(super) fn reframe(
        &mut self,
        turn_rad: f64,
        moved: impl Fn([f64; 2]) -> [f64; 2] + Copy,
        rise_m: f64,
    ) {
        let (sine, cosine) = libm::sincos(turn_rad);
        self.motion.reframe(sine, cosine, moved);
        self.shape.yaw_rad = crate::ego::wrapped_rad(self.shape.yaw_rad + turn_rad);
        self.trails.reframe(moved);
        self.trace.clear();
        self.newness.vacated.reframe();
        self.newness.reframe();
        self.born_m = Vector2::from(moved(self.born_m.into()));
        self.parted.reframe((sine, cosine), moved);
        self.floor_z_m += rise_m;
    }
}

/// Carries motion and direction on by some seconds.
fn carry_on(motion: &mut Motion, shape: &mut Shape, seconds: f64) {
    motion.predict(seconds);
    let turning = (1.0 - motion.standing()) * motion.yaw_rate_radps();
    shape.predict(turning, seconds);
}
