//! What is said of a roundabout: `kreisel.Roundabout` and the lists in it.

use super::message::List;

super::message! {
    /// One arm of a roundabout and the gap there.
    pub struct RoundaboutArm = 2026 "kreisel.RoundaboutArm" {
        /// Direction of the arm from the middle, counter-clockwise from east, radians.
        1 => bearing: f32,
        /// Whether the gap is long enough to enter now.
        2 => may_enter: bool,
        /// Why not. 0: one may; 1: a road user comes or is in the way; 2: somebody may come from where nothing is seen; 3: the
        /// arm has no such way.
        3 => hindrance: u32,
        /// The road user who comes first, of hindrance 1.
        4 => hindering_object: u32,
        /// Until the next road user may come to a conflict point, seconds; at most 15.
        5 => gap: f32,
        /// When the vehicle would come to the first conflict point, seconds from now: the own one as it goes, at other arms one
        /// that stands before the circle.
        6 => own_begin: f32,
        /// When it would leave the last one, seconds from now.
        7 => own_end: f32,
        /// What is left between its leaving and the next road user's coming, seconds; least of all conflict points.
        8 => margin: f32,
        /// Share of the circle on which nobody can be who was not seen, 0 to 1.
        9 => seen_share: f32,
        /// Whether the gap is long enough to leave by this arm now, across the bikeway and the pavement around the circle.
        10 => may_leave: bool,
        /// Why not, as for entering.
        11 => exit_hindrance: u32,
        /// The road user who comes first, of exit hindrance 1.
        12 => exit_hindering_object: u32,
        /// Until the next road user may come to a conflict point of the way out, seconds; at most 15.
        13 => exit_gap: f32,
        /// When the vehicle would come to the first of them, seconds from now: the own one as it goes round, where it is not on
        /// the circle one that stands before them.
        14 => exit_begin: f32,
        /// When it would leave the last one, seconds from now.
        15 => exit_end: f32,
        /// What is left between its leaving and the next road user's coming, seconds; least of all of them.
        16 => exit_margin: f32,
        /// From the vehicle's front to where it has to stand if it may not enter, metres; negative behind it. Where it is not on
        /// this way in, 0.
        17 => stop: f32,
        /// The same if it may not leave.
        18 => exit_stop: f32,
    }
}

super::message! {
    /// When a road user is where the way into an arm, or out of it, crosses its own.
    pub struct ConflictWindow = 2027 "kreisel.ConflictWindow" {
        /// Whose.
        1 => object_id: u32,
        /// Number of the arm, from 0.
        2 => arm: u32,
        /// What is crossed. 0: the circle; 1: a bikeway; 2: a pavement.
        3 => kind: u32,
        /// When it comes at the earliest, seconds from now.
        4 => begin: f32,
        /// When it is gone at the latest, seconds from now.
        5 => end: f32,
        /// When its front most likely comes, seconds from now.
        6 => expected: f32,
        /// Probability that it comes, 0 to 1: it may take an exit before.
        7 => probability: f32,
        /// Its way to the conflict point, metres.
        8 => way: f32,
        /// Whether it is the arm's way out that is crossed, and not its way in.
        9 => at_exit: bool,
    }
}

super::message! {
    /// The lane that a road user is most likely on.
    pub struct LaneUser = 2028 "kreisel.LaneUser" {
        /// Whose.
        1 => object_id: u32,
        /// 0: on a ring; 1: on a way in; 2: on a way out.
        2 => lane_kind: u32,
        /// Number of the ring, or of the arm, from 0.
        3 => number: u32,
        /// Probability of that lane, 0 to 1.
        4 => probability: f32,
        /// Along the lane, metres: on a ring from east, counter-clockwise.
        5 => along: f32,
        /// To the left of its middle, on a ring outward, metres.
        6 => offset: f32,
    }
}

super::message! {
    /// A lane of the circle, or a way around it.
    pub struct RoundaboutRing = 2029 "kreisel.RoundaboutRing" {
        /// 0: road; 1: bikeway; 2: pavement.
        1 => kind: u32,
        /// Of its middle, metres.
        2 => radius: f32,
        /// From edge to edge, metres.
        3 => width: f32,
    }
}

super::message! {
    /// The nearest roundabout: road users on its lanes, and at each arm the gap. Advice, no command.
    pub struct Roundabout = 2024 "kreisel.Roundabout" {
        /// That of the object list of the same revolution.
        1 => revolution: u32,
        /// As the map calls it.
        2 => name: String,
        /// Middle in the frame of the objects, metres.
        3 => x: f64,
        /// Metres.
        4 => y: f64,
        /// Outer diameter, metres.
        5 => diameter: f32,
        /// How far the vehicle has come. 0: at no arm; 1: approaching; 2: it has to brake, or stands before the circle; 3: on the
        /// circle; 4: on the way out.
        6 => state: u32,
        /// The arm that the vehicle is at, from 0; -1: none.
        7 => own_arm: i32,
        /// Arms in order, each with its length before it.
        8 => arms: List<RoundaboutArm>,
        /// Who comes when, each with its length before it.
        9 => windows: List<ConflictWindow>,
        /// Road users on lanes, each with its length before it.
        10 => users: List<LaneUser>,
        /// Lanes of the circle from the inside out, each with its length before it.
        11 => rings: List<RoundaboutRing>,
        /// How much speaks for it. 1: a map knows it; less: it was found by who drives round it.
        12 => confidence: f32,
    }
}
