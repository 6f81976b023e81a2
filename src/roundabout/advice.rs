//! What is said of a roundabout, and of each arm.

use super::gap::{self, Asked, OwnMotion, User};
use super::on_lane::{OnLane, Place};
use super::unseen::Unseen;
use super::{RoundaboutParameters, Window};
use crate::roadmap::Ring;

/// How far the vehicle has come (thesis: start, to the roundabout, brake, in the roundabout,
/// exit).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum State {
    /// The vehicle is at no arm: a watcher beside the road, or far away.
    #[default]
    Watching,
    /// On its way in, with more way than it needs to brake.
    Approaching,
    /// It has to brake now, or stands before the circle.
    Braking,
    /// On the circle.
    Circling,
    /// On the way out.
    Leaving,
}

impl State {
    /// The number in `kreisel.Roundabout`.
    pub const fn number(self) -> u32 {
        match self {
            Self::Watching => 0,
            Self::Approaching => 1,
            Self::Braking => 2,
            Self::Circling => 3,
            Self::Leaving => 4,
        }
    }
}

/// Why one should not enter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hindrance {
    /// A road user who comes, or is in the way.
    RoadUser(u32),
    /// Somebody may come from where nothing is seen.
    Unseen,
    /// The arm has no such way.
    NoWay,
}

/// What is said of an arm.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmAdvice {
    /// Direction of the arm from the middle, counter-clockwise from east.
    pub bearing_rad: f64,
    /// Into the circle, across the bikeway and the pavement around it.
    pub entry: Crossing,
    /// Out of it, across them.
    pub exit: Crossing,
}

/// What is said of a way across others.
#[derive(Debug, Clone, PartialEq)]
pub struct Crossing {
    /// Whether the gap is long enough.
    pub may_go: bool,
    /// Why not.
    pub hindrance: Option<Hindrance>,
    /// Until the next road user may come to a conflict point, seconds.
    pub gap_s: f64,
    /// When the vehicle would come to the first conflict point and leave the last one: the own one as it
    /// goes, elsewhere one that stands before it.
    pub own_window_s: [f64; 2],
    /// What is left of the gap when the vehicle is past, least of all conflict points.
    pub margin_s: f64,
    /// From the vehicle's front to where it has to stand if it may not go; negative behind it.
    pub stop_m: f64,
    /// Share of the ways to be crossed on which nobody can be who was not seen.
    pub seen_share: f64,
}

/// A road user's lane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UserOnLane {
    /// Whose.
    pub object_id: u32,
    /// The likeliest lane.
    pub on: OnLane,
}

impl UserOnLane {
    /// If it is on a lane at all.
    pub(super) fn of(user: User<'_>) -> Option<Self> {
        let likeliest = user.lanes.first();
        let on = likeliest.filter(|on| on.place != Place::Elsewhere)?;
        Some(Self {
            object_id: user.object.id,
            on: *on,
        })
    }
}

/// What is said of the nearest roundabout in a revolution.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Advice {
    /// As the map calls it.
    pub name: String,
    /// Middle in the local frame.
    pub centre_m: [f64; 2],
    /// Outer diameter.
    pub diameter_m: f64,
    /// 1 by a map; less where it was found by who drives round it.
    pub confidence: f64,
    /// Its lanes, from the inside out, in the local frame.
    pub rings: Vec<Ring>,
    /// How far the vehicle has come.
    pub state: State,
    /// The arm that the vehicle is at.
    pub own_arm: Option<usize>,
    /// In the map's order.
    pub arms: Vec<ArmAdvice>,
    /// Of all road users at all arms.
    pub windows: Vec<Window>,
    /// Road users on lanes.
    pub users: Vec<UserOnLane>,
}

impl Crossing {
    /// Where there is no way.
    pub(super) const CLOSED: Self = Self {
        may_go: false,
        hindrance: Some(Hindrance::NoWay),
        gap_s: 0.0,
        own_window_s: [0.0; 2],
        margin_s: 0.0,
        stop_m: 0.0,
        seen_share: 0.0,
    };

    /// Nobody is let through, whoever comes.
    pub(super) fn hindered(&mut self, by: Hindrance) {
        self.may_go = false;
        self.hindrance = Some(by);
    }

    /// Whether the vehicle, as it goes, fits between those who come and those whom nobody sees.
    pub(super) fn of(
        asked: &Asked<'_>,
        motion: &OwnMotion,
        comers: &[Window],
        unseen: Option<&Unseen>,
        parameters: &RoundaboutParameters,
    ) -> Self {
        let mut advice = Self {
            may_go: true,
            hindrance: None,
            gap_s: gap::HORIZON_S,
            own_window_s: [f64::INFINITY, 0.0],
            margin_s: gap::HORIZON_S,
            stop_m: asked.stop_m - motion.front_m,
            seen_share: 1.0,
        };
        let [before_s, behind_s] = asked.cautions_s();
        let least_margin_s = parameters.margin_s + before_s;
        for (number, conflict) in asked.conflicts.iter().enumerate() {
            let [begin_s, end_s] = motion.window_s(conflict, parameters);
            if end_s <= 0.0 {
                // Past it already.
                continue;
            }
            advice.own_window_s = [
                advice.own_window_s[0].min(begin_s),
                advice.own_window_s[1].max(end_s),
            ];
            let at_point = comers.iter().filter(|window| window.conflict == number);
            for window in at_point {
                // Gone before the vehicle comes.
                if window.end_s + gap::BEHIND_S + behind_s <= begin_s {
                    continue;
                }
                let margin_s = window.begin_s - end_s;
                advice.gap_s = advice.gap_s.min(window.begin_s);
                if margin_s < advice.margin_s {
                    advice.margin_s = margin_s;
                    if margin_s < least_margin_s {
                        advice.hindrance = Some(Hindrance::RoadUser(window.object_id));
                    }
                }
            }
            if let Some(unseen) = unseen {
                let (comes_s, seen_share) =
                    unseen.before(asked.site, asked.arm, conflict, parameters.speed_mps);
                advice.seen_share = advice.seen_share.min(seen_share);
                if comes_s - end_s < least_margin_s && advice.hindrance.is_none() {
                    advice.hindrance = Some(Hindrance::Unseen);
                }
            }
        }
        if !advice.own_window_s[0].is_finite() {
            advice.own_window_s[0] = 0.0;
        }
        advice.may_go = advice.hindrance.is_none();
        advice
    }
}
