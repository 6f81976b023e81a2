//! What is said of each arm: the gap at its way in and at its way out, and when it is announced.

use super::advice::{ArmAdvice, Crossing, Hindrance, UserOnLane};
use super::gap::{self, Asked, OwnMotion, Users};
use super::own::{Own, standing, standing_inside};
use super::site::Site;
use super::{Situation, Watcher, Window};

/// Who has only begun to watch has not seen everybody yet.
const FIRST_LOOK_S: f64 = 2.0;

impl Watcher {
    /// Says all that is told of a site, once it is known who is on which of its lanes.
    pub(super) fn advise(&mut self, index: usize, situation: &Situation<'_>) {
        let site = &self.sites[index];
        let last_arm = self.advice.own_arm;
        let own = Own::of(site, situation, last_arm, &self.parameters);
        let mut advice = std::mem::take(&mut self.advice);
        advice.name.clone_from(&site.name);
        advice.centre_m = site.centre_m;
        advice.diameter_m = 2.0 * site.outer_m;
        advice.confidence = site.confidence;
        advice.rings.clone_from(&site.rings);
        advice.state = own.state;
        advice.own_arm = own.arm;
        advice.users.clear();
        advice.windows.clear();
        advice.arms.clear();
        let users = Users {
            objects: situation.objects,
            lanes: &self.lanes,
        };
        let on_lanes = users.iter().filter_map(UserOnLane::of);
        advice.users.extend(on_lanes);
        for number in 0..site.arms.len() {
            let arm = self.arm(site, number, &own, users, situation, &mut advice.windows);
            advice.arms.push(arm);
        }
        let announced = advice.arms.iter();
        let announced = announced.map(|arm| [arm.entry.may_go, arm.exit.may_go]);
        self.announced.clear();
        self.announced.extend(announced);
        self.advice = advice;
    }

    /// What is said of an arm; the windows of those who come to it are added to the others.
    fn arm(
        &self,
        site: &Site,
        number: usize,
        own: &Own,
        users: Users<'_>,
        situation: &Situation<'_>,
        windows: &mut Vec<Window>,
    ) -> ArmAdvice {
        let arm = &site.arms[number];
        let is_seen = situation.sight.is_some();
        let asked = Asked {
            site,
            arm: number,
            at_exit: false,
            conflicts: &[],
            width_m: 0.0,
            stop_m: 0.0,
            road_mps: self.parameters.speed_mps,
            is_seen,
            is_announced: self.is_announced(number, false),
        };
        let mut crossing = |asked: Asked<'_>, motion: &OwnMotion| {
            self.crossing(&asked, motion, users, situation, windows)
        };
        let parameters = &self.parameters;
        let entry_by = Some(own).filter(|own| own.arm == Some(number) && own.motion.is_some());
        let entry = arm.entries.get(entry_by.map_or(0, |own| own.lane));
        let entry = entry.map_or(Crossing::CLOSED, |entry| {
            let waits = standing(entry, parameters.own_length_m);
            let motion = entry_by.and_then(|own| own.motion).unwrap_or(waits);
            let asked = Asked {
                stop_m: waits.front_m,
                conflicts: &entry.conflicts,
                width_m: entry.width_m,
                ..asked
            };
            let mut said = crossing(asked, &motion);
            if let Some(ahead) = entry_by.and_then(|own| own.ahead(entry, users)) {
                said.margin_s = 0.0;
                said.hindered(Hindrance::RoadUser(ahead));
            }
            said
        });
        let exit = arm.exits.first().map_or(Crossing::CLOSED, |exit| {
            let waits = standing_inside(exit);
            let motion = own.leaving(site, exit, situation, parameters);
            let motion = motion.unwrap_or(waits);
            let asked = Asked {
                stop_m: waits.front_m,
                at_exit: true,
                is_announced: self.is_announced(number, true),
                conflicts: &exit.conflicts,
                width_m: exit.width_m,
                ..asked
            };
            crossing(asked, &motion)
        });
        ArmAdvice {
            bearing_rad: arm.bearing_rad,
            entry,
            exit,
        }
    }

    /// Whether a gap was announced last at a way in or out.
    pub(super) fn is_announced(&self, arm: usize, at_exit: bool) -> bool {
        let announced = self.announced.get(arm);
        announced.is_some_and(|ways| ways[usize::from(at_exit)])
    }

    /// What is said of a way in or out.
    fn crossing(
        &self,
        asked: &Asked<'_>,
        motion: &OwnMotion,
        users: Users<'_>,
        situation: &Situation<'_>,
        windows: &mut Vec<Window>,
    ) -> Crossing {
        let first = windows.len();
        users
            .iter()
            .for_each(|user| gap::windows(asked, &user, windows));
        let unseen = situation.sight.map(|_| &self.unseen);
        let comers = &windows[first..];
        let mut said = Crossing::of(asked, motion, comers, unseen, &self.parameters);
        let since = self.since.unwrap_or(situation.time);
        let is_fresh = (situation.time - since).seconds() < FIRST_LOOK_S;
        if is_fresh && situation.sight.is_some() && !asked.conflicts.is_empty() {
            said.hindered(said.hindrance.unwrap_or(Hindrance::Unseen));
        }
        said
    }
}
