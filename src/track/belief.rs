//! What an object is, from what was seen of it so far.
//!
//! Every class has intervals for the measured qualities; outside of one, its probability falls
//! like a normal distribution. The intervals are sizes of everyday vehicles and people (sources
//! at the constants); only the roughness of foliage was read off a recording. Whether what stands is
//! a person shows in its appearance.

use super::Class;
use super::look::{COVERED_M, OUT_OF_VIEW_M};
use super::profiles::{PROFILES, ROAD_USERS, Within};

/// What was measured of an object over its life.
#[derive(Debug, Clone, Copy)]
pub(super) struct Qualities {
    /// Longer side of what was seen.
    pub(super) long_m: f64,
    /// Shorter side.
    pub(super) short_m: f64,
    /// Length, once it was seen from end to end.
    pub(super) whole_m: Option<f64>,
    /// Width, once it was seen from side to side.
    pub(super) wide_m: Option<f64>,
    /// Extent across the direction in which it moves, once that is known.
    pub(super) across_m: Option<f64>,
    /// Greatest extent of what is higher than a bonnet or a handlebar, if any of it was seen.
    pub(super) upper_m: Option<f64>,
    /// How much likelier its looks are those of somebody on foot than of anything else, if that is known.
    pub(super) person_log: Option<f64>,
    /// Top above the ground: at least this...
    pub(super) top_m: f64,
    /// ...and at most this, which is where the next ray passed over it.
    pub(super) top_below_m: f64,
    /// Share of its columns in which it goes on above.
    pub(super) goes_on: f64,
    /// How much neighbouring returns jump to and fro.
    pub(super) roughness_m: f64,
    /// Highest lasting speed.
    pub(super) speed_mps: f64,
    /// Whether it was seen to move.
    pub(super) moved: bool,
    /// Whether it did so to where nothing was before.
    pub(super) surely_moves: bool,
    /// Whether it is confirmed, and where nothing was before.
    pub(super) has_come: bool,
    /// Distance from the sensor.
    pub(super) range_m: f64,
    /// Returns on it.
    pub(super) points: usize,
    /// Whether it was cut off structure.
    pub(super) is_suspect: bool,
}

/// What moves and looks like no class is a road user all the same; what stands and does so is none.
const OTHER_LOG_PRIOR: f64 = -12.0;
const OTHER_MOVED_LOG: f64 = -2.5;
/// Structure is as frequent as everything else together, and does not move.
const STRUCTURE_LOG_PRIOR: f64 = -0.9;
const STRUCTURE_MOVED_LOG: f64 = -4.5;
/// What is where nothing was before came there, though nobody may have seen it move. Of 0, 1, 1.5, 2 and 3 the one with
/// the most people who walk listed: without [`Qualities::has_come`] 77 instead of 79 % of those along fronts, 57 instead
/// of 59 % of those in groups and 93 instead of 94 % of strangers, with as many false movers
/// (`scripts/evaluate --seeds 621-624 --duration 15 --scenarios pavement,strangers,groups,furniture`).
const STRUCTURE_CAME_LOG: f64 = -1.0;
/// A few returns from something that stands are rather a piece of structure, the more so the
/// fewer they are.
const FEW: usize = 15;
const FEW_LOG: f64 = 0.1;
/// The same for what was cut off structure.
const SUSPECT_LOG: f64 = 0.8;
/// How much of what the looks of a person say counts beside sizes and heights, which say a part of it again, what is
/// taken off since real streets hold more posts and fewer people than simulated ones, and how much it says at most. With
/// 0.6 and -1.0 only 50 instead of 63 % of the people who stand are listed (`scripts/evaluate --seeds 31-32`), and 0.1
/// objects a revolution less where nobody is (shared recording astyx_held_dev).
const PERSON_SHARE: f64 = 0.8;
const PERSON_LOG: f64 = -0.66;
const MOST_PERSON_LOG: f64 = 3.0;
/// Surfaces of vehicles and clothes jump by less than this, foliage by more.
const SMOOTH_M: Within = Within(0.0, 0.045, 0.018);
/// Share of columns in which a road user seems to go on above: what stands close behind it.
const ENDS: Within = Within(0.0, 0.15, 0.15);
/// Foliage and fences.
const ROUGH_M: Within = Within(0.05, 1.0, 0.02);

/// Probabilities of the classes, and of being no road user at all.
#[derive(Debug, Clone, Copy)]
pub(super) struct Belief {
    road_users: [f64; 4],
    /// A road user of no class that is known: a person with a load, a pram, a horse.
    other: f64,
    structure: f64,
}

impl Belief {
    /// What is known without any look at it.
    pub(super) fn unknown() -> Self {
        let mut belief = Self {
            road_users: PROFILES.map(|profile| libm::exp(profile.log_prior)),
            other: libm::exp(OTHER_LOG_PRIOR),
            structure: libm::exp(STRUCTURE_LOG_PRIOR),
        };
        belief.normalise();
        belief
    }

    /// What the qualities alone say.
    pub(super) fn of(qualities: &Qualities) -> Self {
        let smooth = SMOOTH_M.log(qualities.roughness_m);
        // The sides of something far away are seen by a few rays only.
        let slack_m = 0.004 * qualities.range_m;
        let road_users = std::array::from_fn(|number| {
            let profile = &PROFILES[number];
            let is_thin = matches!(ROAD_USERS[number], Class::Cyclist | Class::Pedestrian);
            let speed = if qualities.moved {
                let own = profile.speed_mps.log(qualities.speed_mps);
                if qualities.speed_mps > profile.speed_mps.1 {
                    own.max(profile.faster_log)
                } else {
                    own
                }
            } else if ROAD_USERS[number] == Class::Cyclist {
                STANDING_CYCLIST_LOG
            } else {
                0.0
            };
            // A bicycle from behind is as narrow as a person, a lorry as short as it is wide.
            let shortest_m = if qualities.moved {
                profile.end_on_m
            } else {
                profile.long_m.0
            };
            // People side by side are as wide as they are many.
            let is_group = ROAD_USERS[number] == Class::Pedestrian
                && qualities.moved
                && qualities.long_m > profile.long_m.1
                && qualities.short_m < GROUP_DEPTH_M;
            let (longest_m, group) = if is_group {
                (GROUP_WIDTH_M, GROUP_LOG)
            } else {
                (0.0, 0.0)
            };
            let sized = |own: &Within| Within(own.0, own.1.max(longest_m), own.2);
            let long_m = Within(shortest_m, profile.long_m.1, profile.long_m.2);
            // What goes on above the highest layer is rather a house than a vehicle, but people do near
            // the sensor.
            let endless = if qualities.top_below_m == COVERED_M
                || (qualities.top_below_m == OUT_OF_VIEW_M && !is_thin)
            {
                ENDLESS_LOG
            } else {
                0.0
            };
            let ends = ENDS.log(qualities.goes_on);
            let looks = if ROAD_USERS[number] == Class::Pedestrian {
                qualities.person_log.map_or(0.0, person_log)
            } else {
                0.0
            };
            let surface = if is_thin { 0.25 * smooth } else { smooth };
            // A wall is flat, a vehicle has bumpers, wheels and screens that do not line up, unless
            // it is a van from behind; walls do not move.
            let deep_m = if qualities.points >= MANY {
                &DEEP_M
            } else {
                &FLAT_M
            };
            let is_flat = !is_thin
                && !qualities.moved
                && qualities.points >= FEW
                && qualities.short_m < deep_m.0;
            let short = if is_flat {
                deep_m.log(qualities.short_m)
            } else {
                profile.short_m.log(qualities.short_m)
            };
            let log = profile.log_prior
                + sized(&long_m).log_between(qualities.long_m, qualities.long_m + slack_m)
                + short
                + group
                + known(&sized(&profile.whole_m), qualities.whole_m)
                + known(&sized(&profile.wide_m), qualities.wide_m)
                + known(&sized(&profile.across_m), qualities.across_m)
                + known(
                    &sized(&profile.upper_m),
                    qualities.upper_m.map(|seen_m| seen_m + slack_m),
                )
                + profile
                    .top_m
                    .log_between(qualities.top_m, qualities.top_below_m)
                + speed
                + surface
                + endless
                + ends
                + looks;
            libm::exp(log)
        });
        let moved = if qualities.moved || qualities.surely_moves {
            STRUCTURE_MOVED_LOG
        } else if qualities.has_come {
            STRUCTURE_CAME_LOG
        } else {
            0.0
        };
        let stands = !qualities.moved && !qualities.has_come;
        let few = if stands {
            FEW_LOG * FEW.saturating_sub(qualities.points) as f64
        } else {
            0.0
        };
        let suspect = stands && qualities.is_suspect;
        let moved = moved + few + if suspect { SUSPECT_LOG } else { 0.0 };
        let rough = 0.3 * ROUGH_M.log(qualities.roughness_m);
        let other = if qualities.surely_moves {
            OTHER_MOVED_LOG
        } else {
            OTHER_LOG_PRIOR
        };
        let mut belief = Self {
            road_users,
            other: libm::exp(other),
            structure: libm::exp(STRUCTURE_LOG_PRIOR + moved + rough.max(-0.5)),
        };
        belief.normalise();
        belief
    }

    fn normalise(&mut self) {
        let total = self.road_users.iter().sum::<f64>() + self.other + self.structure;
        for probability in &mut self.road_users {
            *probability /= total;
        }
        self.other /= total;
        self.structure /= total;
    }

    /// Learns from a further look, a share of the way.
    pub(super) fn learn(&mut self, fresh: &Self, share: f64) {
        for (probability, fresh) in self.road_users.iter_mut().zip(fresh.road_users) {
            *probability += share * (fresh - *probability);
        }
        self.other += share * (fresh.other - self.other);
        self.structure += share * (fresh.structure - self.structure);
    }

    /// The same of what is known to be a vehicle.
    pub(super) fn of_vehicle(&self) -> Self {
        let [car, _, _, large] = self.road_users;
        let mut belief = Self {
            // Of what looks like none, cars are the most frequent.
            road_users: [car.max(f64::MIN_POSITIVE), 0.0, 0.0, large],
            other: 0.0,
            structure: 0.0,
        };
        belief.normalise();
        belief
    }

    /// Probability that it is a road user of any class.
    pub(super) fn road_user(&self) -> f64 {
        1.0 - self.structure
    }

    /// Probability, among road users, of a class with the bulk of a car or more.
    pub(super) fn vehicle(&self) -> f64 {
        let [car, _, _, large] = self.road_users;
        (car + large) / self.road_user().max(1e-9)
    }

    /// Probability, among the classes that are known, of being a lorry or a bus.
    pub(super) fn lorry(&self) -> f64 {
        let [_, _, _, large] = self.road_users;
        large / self.road_users.iter().sum::<f64>().max(1e-9)
    }

    /// The likeliest class and its probability among road users.
    pub(super) fn class(&self) -> (Class, f64) {
        /// Below this nobody can tell.
        const LEAST: f64 = 0.4;
        let (number, probability) =
            self.road_users
                .iter()
                .enumerate()
                .fold((0, 0.0), |best, (number, probability)| {
                    if *probability > best.1 {
                        (number, *probability)
                    } else {
                        best
                    }
                });
        let share = probability / self.road_user().max(1e-9);
        if share < LEAST {
            (Class::Unclassified, 1.0 - share)
        } else {
            (ROAD_USERS[number], share)
        }
    }
}

/// What the looks say for a person, or against.
fn person_log(looks: f64) -> f64 {
    (PERSON_SHARE * (looks + PERSON_LOG)).clamp(-MOST_PERSON_LOG, MOST_PERSON_LOG)
}

/// Logarithm for a quality that may not be known.
fn known(within: &Within, value: Option<f64>) -> f64 {
    value.map_or(0.0, |value| within.log(value))
}

/// Depth of a vehicle's side with all that does not line up, as a few returns show it, and as
/// many do.
const FLAT_M: Within = Within(0.25, 3.0, 0.07);
const DEEP_M: Within = Within(0.6, 3.0, 0.13);
const MANY: usize = 60;
/// Of a road user that reaches out of the sensor's view, or behind something nearer.
const ENDLESS_LOG: f64 = -1.5;
/// Greatest width and depth of people who walk side by side, and how much rarer they are.
const GROUP_WIDTH_M: f64 = 2.3;
const GROUP_DEPTH_M: f64 = 0.8;
const GROUP_LOG: f64 = -1.0;
/// Bicycles that stand have mostly no rider.
const STANDING_CYCLIST_LOG: f64 = -1.0;

#[cfg(test)]
mod tests;
