//! Who drove where, for roundabouts that no map knows.
//!
//! Numbers were set by reasoning, and tried with `scripts/evaluate-roundabouts --seeds 1-6`.

use super::Situation;
use super::candidates::course;
use super::kerbs::Kerbs;
use crate::ego::wrapped_rad;
use crate::roadmap::{
    Access, Arm, DrivenRoundabout, DrivenWay, Edges, LaneKind, driven_roundabouts, simplified,
};
use crate::time::Time;
use crate::track::{Class, Object};

/// Slower road users tell no way.
const MOVING_MPS: f64 = 0.8;
/// Places of a way are so far apart.
const APART_M: f64 = 1.0;
/// Farther than this nobody goes between two places of a way: it is another one.
const LEAP_M: f64 = 8.0;
/// A way is looked at anew when it has grown by so many places.
const GROWN: usize = 15;
/// No way longer than this is kept: its older half goes.
const LONGEST: usize = 240;
/// Ways that are kept.
const MOST_WAYS: usize = 48;
/// Kerbs are looked at so often.
const LOOK_S: f64 = 1.0;
/// What is found with less confidence is not told.
const LEAST_CONFIDENCE: f64 = 0.6;

/// Ways of road users and of the vehicle itself, and what they lead round.
#[derive(Debug, Clone, Default)]
pub(super) struct Finder {
    /// In places that are used again.
    trails: Vec<Trail>,
    /// How many ways began.
    begun: u64,
    found: Vec<DrivenRoundabout>,
    /// Around each.
    kerbs: Vec<Kerbs>,
    /// When kerbs were looked at last.
    looked: Option<Time>,
}

#[derive(Debug, Clone, Default)]
struct Trail {
    use_of: Use,
    /// Number of the way.
    number: u64,
    points_m: Vec<[f64; 2]>,
    /// Places at which he was taken for what uses a kind of way.
    kinds: [usize; 3],
    /// Places that it had when it was looked at.
    looked_at: usize,
    way: Option<DrivenWay>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Use {
    #[default]
    Free,
    /// Of somebody who is listed.
    Going(Who),
    Over,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Who {
    Vehicle,
    Object(u32),
}

impl Finder {
    /// What was found, in the local frame.
    pub(super) fn found(&self) -> &[DrivenRoundabout] {
        &self.found
    }

    /// Takes in where everybody is. Gives whether something else is found than before.
    pub(super) fn take(&mut self, situation: &Situation<'_>) -> bool {
        let is_listed = |who: Who| match who {
            Who::Vehicle => situation.vehicle.is_some(),
            Who::Object(id) => situation.objects.iter().any(|object| object.id == id),
        };
        for trail in &mut self.trails {
            if matches!(trail.use_of, Use::Going(who) if !is_listed(who)) {
                trail.use_of = Use::Over;
            }
        }
        if let Some(pose) = situation.vehicle {
            let [x, y, _] = pose.position_m;
            self.extend(Who::Vehicle, [x, y], LaneKind::Road);
        }
        for object in situation.objects.iter().filter(|object| object.measured) {
            let (_, speed_mps) = course(object);
            if let Some(kind) = kind_of(object).filter(|_| speed_mps > MOVING_MPS) {
                let [x, y, _] = object.centre_m;
                self.extend(Who::Object(object.id), [x, y], kind);
            }
        }
        let is_grown = self.look();
        let is_seen = self.look_at_kerbs(situation);
        (is_grown || is_seen) && self.conclude()
    }

    /// Takes in where the road ends around what was found. Gives whether something was to be seen.
    fn look_at_kerbs(&mut self, situation: &Situation<'_>) -> bool {
        let Some(sight) = situation.sight.as_ref().filter(|_| !self.found.is_empty()) else {
            return false;
        };
        let passed_s = self
            .looked
            .map(|looked| (situation.time - looked).seconds());
        if passed_s.is_some_and(|passed_s| (0.0..LOOK_S).contains(&passed_s)) {
            return false;
        }
        self.looked = Some(situation.time);
        let around = |found: &DrivenRoundabout| {
            let centre_m = found.roundabout.centre_m();
            let known = self.kerbs.iter().find(|kerbs| kerbs.is_at(centre_m));
            let mut kerbs = known.cloned().unwrap_or_else(|| Kerbs::around(centre_m));
            kerbs.note_driven(found.driven_m);
            kerbs.take(sight);
            kerbs
        };
        self.kerbs = self.found.iter().map(around).collect();
        true
    }

    fn extend(&mut self, who: Who, at_m: [f64; 2], kind: LaneKind) {
        let mut trails = self.trails.iter_mut();
        if let Some(trail) = trails.find(|trail| trail.use_of == Use::Going(who)) {
            let last_m = trail.points_m.last().copied().unwrap_or(at_m);
            let gone_m = libm::hypot(at_m[0] - last_m[0], at_m[1] - last_m[1]);
            if gone_m < APART_M {
                return;
            }
            if gone_m < LEAP_M {
                trail.push(at_m, kind);
                return;
            }
            trail.use_of = Use::Over;
        }
        self.begun += 1;
        let number = self.begun;
        if let Some(trail) = self.place() {
            trail.begin(who, number);
            trail.push(at_m, kind);
        }
    }

    /// A place for another way: of too many the oldest goes, but those last that turn, or were not looked at.
    fn place(&mut self) -> Option<&mut Trail> {
        if self.trails.len() < MOST_WAYS {
            self.trails.push(Trail::default());
            return self.trails.last_mut();
        }
        let over = self
            .trails
            .iter_mut()
            .filter(|trail| !matches!(trail.use_of, Use::Going(_)));
        over.min_by_key(|trail| {
            let tells = trail.way.is_some() || !trail.is_looked_at();
            (trail.use_of == Use::Over, tells, trail.number)
        })
    }

    /// Looks at one of the ways that have grown or are over. Gives whether it leads round something.
    fn look(&mut self) -> bool {
        let grown = self.trails.iter_mut().filter(|trail| !trail.is_looked_at());
        let most = grown.max_by_key(|trail| (trail.use_of == Use::Over, trail.grown()));
        most.is_some_and(Trail::look)
    }

    /// Gives whether that is something else than before.
    fn conclude(&mut self) -> bool {
        let ways = self.trails.iter().filter_map(|trail| trail.way.clone());
        let ways: Vec<DrivenWay> = ways.collect();
        let mut found = driven_roundabouts(&ways, |centre_m| {
            let kerbs = self.kerbs.iter().find(|kerbs| kerbs.is_at(centre_m));
            kerbs.map_or(Edges::default(), Kerbs::edges)
        });
        found.retain(|one| one.confidence >= LEAST_CONFIDENCE);
        for one in &mut found {
            one.roundabout = simplified(&one.roundabout).roundabout;
        }
        let is_same = self.found.len() == found.len()
            && self.found.iter().zip(&found).all(|(a, b)| is_same(a, b));
        if is_same {
            // Places do not tremble; how much speaks for it may grow.
            let mut changed = false;
            for (known, new) in self.found.iter_mut().zip(&found) {
                changed |= known.confidence != new.confidence;
                known.confidence = new.confidence;
            }
            return changed;
        }
        self.found = found;
        true
    }
}

impl Trail {
    fn begin(&mut self, who: Who, number: u64) {
        self.use_of = Use::Going(who);
        self.number = number;
        self.points_m.clear();
        self.points_m.reserve(LONGEST);
        self.kinds = [0; 3];
        self.looked_at = 0;
        self.way = None;
    }

    fn push(&mut self, at_m: [f64; 2], kind: LaneKind) {
        if self.points_m.len() >= LONGEST {
            self.points_m.drain(..LONGEST / 2);
            self.looked_at = self.looked_at.saturating_sub(LONGEST / 2);
        }
        self.points_m.push(at_m);
        self.kinds[kind.number() as usize] += 1;
    }

    /// Whether nothing has come since that would change it.
    fn is_looked_at(&self) -> bool {
        match self.use_of {
            Use::Free => true,
            Use::Going(_) => self.grown() < GROWN,
            Use::Over => self.grown() == 0,
        }
    }

    /// Places since it was looked at.
    fn grown(&self) -> usize {
        self.points_m.len() - self.looked_at
    }

    fn look(&mut self) -> bool {
        self.looked_at = self.points_m.len();
        let kinds = LaneKind::ALL.into_iter();
        let kind = kinds.max_by_key(|kind| self.kinds[kind.number() as usize]);
        self.way = DrivenWay::new(kind.unwrap_or_default(), &self.points_m);
        if self.way.is_none() && self.use_of == Use::Over {
            self.use_of = Use::Free;
        }
        self.way.is_some()
    }
}

/// Whether the same circles and arms were found, at the same place, the arms known as far.
fn is_same(a: &DrivenRoundabout, b: &DrivenRoundabout) -> bool {
    const MOVED_M: f64 = 0.1;
    const LONGER_M: f64 = 1.0;
    const TURNED_RAD: f64 = 0.1;
    let (a, b) = (&a.roundabout, &b.roundabout);
    let is_same_way = |(a, b): (&Access, &Access)| {
        let longer_m = a.way.length_m() - b.way.length_m();
        longer_m.abs() < LONGER_M && wrapped_rad(a.mouth_rad - b.mouth_rad).abs() < TURNED_RAD
    };
    let are_same =
        |a: &[Access], b: &[Access]| a.len() == b.len() && a.iter().zip(b).all(is_same_way);
    let is_same_arm =
        |(a, b): (&Arm, &Arm)| are_same(&a.entries, &b.entries) && are_same(&a.exits, &b.exits);
    let rings = || a.rings.iter().zip(&b.rings);
    let is_near = |a: f64, b: f64| (a - b).abs() < MOVED_M;
    a.rings.len() == b.rings.len()
        && rings().all(|(a, b)| {
            a.kind == b.kind
                && is_near(a.circle.radius_m, b.circle.radius_m)
                && is_near(a.width_m, b.width_m)
                && is_near(a.circle.centre_m[0], b.circle.centre_m[0])
                && is_near(a.circle.centre_m[1], b.circle.centre_m[1])
        })
        && a.arms.len() == b.arms.len()
        && a.arms.iter().zip(&b.arms).all(is_same_arm)
}

/// The kind of way that a road user uses.
fn kind_of(object: &Object) -> Option<LaneKind> {
    match object.class {
        Class::Car | Class::LargeVehicle => Some(LaneKind::Road),
        Class::Cyclist => Some(LaneKind::Bikeway),
        Class::Pedestrian => Some(LaneKind::Pavement),
        Class::Unclassified => None,
    }
}
