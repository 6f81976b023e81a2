//! Advice at a roundabout as `kreisel.Roundabout`.

use crate::roadmap::Ring;
use crate::roundabout::{Advice, ArmAdvice, Hindrance, Place, UserOnLane, Window};
use crate::wire::message::List;
use crate::wire::roundabout::{
    ConflictWindow, LaneUser, Roundabout, RoundaboutArm, RoundaboutRing,
};

/// What a datagram has room for of a roundabout's lists, beside each other: more is no street.
const MOST_ARMS: usize = 32;
const MOST_WINDOWS: usize = 800;
const MOST_USERS: usize = 256;
const MOST_RINGS: usize = 16;
const LONGEST_NAME: usize = 100;

/// Says in a message what is said in a revolution. Of more windows than a datagram has room for, the soonest are kept.
pub(super) fn fill(message: &mut Roundabout, revolution: u32, advice: &Advice) {
    message.revolution = revolution;
    message.name.clear();
    message.name.extend(advice.name.chars().take(LONGEST_NAME));
    [message.x, message.y] = advice.centre_m;
    message.diameter = advice.diameter_m as f32;
    message.confidence = advice.confidence as f32;
    message.state = advice.state.number();
    message.own_arm = advice.own_arm.map_or(-1, |arm| arm as i32);
    let arms = advice.arms.iter().take(MOST_ARMS);
    refill(&mut message.arms, arms.map(arm_of));
    refill(
        &mut message.windows,
        advice.windows.iter().map(conflict_window),
    );
    let windows = &mut message.windows.0;
    if windows.len() > MOST_WINDOWS {
        windows.sort_by(|a, b| a.begin.total_cmp(&b.begin));
        windows.truncate(MOST_WINDOWS);
    }
    let users = advice.users.iter().filter_map(lane_user);
    refill(&mut message.users, users.take(MOST_USERS));
    let rings = advice.rings.iter().take(MOST_RINGS);
    refill(&mut message.rings, rings.map(ring_of));
}

fn refill<T>(list: &mut List<T>, items: impl Iterator<Item = T>) {
    list.0.clear();
    list.0.extend(items);
}

fn arm_of(arm: &ArmAdvice) -> RoundaboutArm {
    let ArmAdvice { entry, exit, .. } = arm;
    let (hindrance, hindering_object) = numbers(entry.hindrance);
    let (exit_hindrance, exit_hindering_object) = numbers(exit.hindrance);
    RoundaboutArm {
        bearing: arm.bearing_rad as f32,
        may_enter: entry.may_go,
        hindrance,
        hindering_object,
        gap: entry.gap_s as f32,
        own_begin: entry.own_window_s[0] as f32,
        own_end: entry.own_window_s[1] as f32,
        margin: entry.margin_s as f32,
        seen_share: entry.seen_share as f32,
        may_leave: exit.may_go,
        exit_hindrance,
        exit_hindering_object,
        exit_gap: exit.gap_s as f32,
        exit_begin: exit.own_window_s[0] as f32,
        exit_end: exit.own_window_s[1] as f32,
        exit_margin: exit.margin_s as f32,
        stop: entry.stop_m as f32,
        exit_stop: exit.stop_m as f32,
    }
}

/// A hindrance, and the road user of it.
fn numbers(hindrance: Option<Hindrance>) -> (u32, u32) {
    match hindrance {
        None => (0, 0),
        Some(Hindrance::RoadUser(id)) => (1, id),
        Some(Hindrance::Unseen) => (2, 0),
        Some(Hindrance::NoWay) => (3, 0),
    }
}

fn conflict_window(window: &Window) -> ConflictWindow {
    ConflictWindow {
        object_id: window.object_id,
        arm: window.arm as u32,
        kind: window.kind.number(),
        begin: window.begin_s as f32,
        end: window.end_s as f32,
        expected: window.expected_s as f32,
        probability: window.probability as f32,
        way: window.way_m as f32,
        at_exit: window.at_exit,
    }
}

fn lane_user(user: &UserOnLane) -> Option<LaneUser> {
    let (lane_kind, number) = match user.on.place {
        Place::Ring(number) => (0, number),
        Place::Entry(arm, _) => (1, arm),
        Place::Exit(arm, _) => (2, arm),
        Place::Elsewhere => return None,
    };
    Some(LaneUser {
        object_id: user.object_id,
        lane_kind,
        number: number as u32,
        probability: user.on.probability as f32,
        along: user.on.along_m as f32,
        offset: user.on.offset_m as f32,
    })
}

fn ring_of(ring: &Ring) -> RoundaboutRing {
    RoundaboutRing {
        kind: ring.kind.number(),
        radius: ring.circle.radius_m as f32,
        width: ring.width_m as f32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::roundabout::{Crossing, OnLane};
    use crate::wire::Message as _;
    use crate::wire::frame::MAX_DATAGRAM_LEN;

    #[test]
    fn the_busiest_roundabout_fits_a_datagram() {
        let window = Window {
            object_id: u32::MAX,
            arm: 1000,
            at_exit: true,
            conflict: 0,
            kind: crate::roadmap::LaneKind::Pavement,
            begin_s: 14.0,
            end_s: 15.0,
            expected_s: 14.5,
            probability: 0.5,
            way_m: 50.0,
        };
        let user = UserOnLane {
            object_id: u32::MAX,
            on: OnLane {
                place: Place::Exit(1000, 0),
                probability: 0.5,
                along_m: 1.0,
                offset_m: 1.0,
                speed_mps: 1.0,
                mean_speed_mps: 1.0,
                known_s: 1.0,
                came_in_by: None,
            },
        };
        let soon = Window {
            begin_s: 0.0,
            object_id: 1,
            ..window
        };
        let crossing = Crossing {
            may_go: true,
            hindrance: Some(Hindrance::RoadUser(u32::MAX)),
            gap_s: 14.0,
            own_window_s: [1.0, 2.0],
            margin_s: 10.0,
            stop_m: -1.0,
            seen_share: 0.5,
        };
        let arm = ArmAdvice {
            bearing_rad: 1.0,
            entry: crossing.clone(),
            exit: crossing,
        };
        let ring = Ring {
            circle: crate::roadmap::Circle {
                centre_m: [0.0; 2],
                radius_m: 11.0,
            },
            width_m: 8.0,
            kind: crate::roadmap::LaneKind::Pavement,
            is_marked: false,
        };
        let windows = (0..5000).map(|_| window).chain([soon]);
        let advice = Advice {
            name: "x".repeat(1000),
            windows: windows.collect(),
            users: vec![user; 1000],
            arms: vec![arm; 1000],
            rings: vec![ring; 1000],
            ..Advice::default()
        };
        /// Of an envelope.
        const HEADER: usize = 100;
        let mut said = Roundabout::default();
        fill(&mut said, 9, &advice);
        assert_eq!(said.windows.0[0].object_id, 1);
        let mut bytes = vec![];
        said.encode(&mut bytes);
        assert!(bytes.len() + HEADER < MAX_DATAGRAM_LEN, "{}", bytes.len());
    }
}
