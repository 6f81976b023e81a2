//! Advice at a roundabout beside a recording's truth: the same rule on true road users, and what
//! they did then.

use std::collections::BTreeMap;

use super::window_score::WindowScore;
use crate::roadmap::{LaneKind, Roadmap};
use crate::roundabout::{
    Advice, Crossing, Place, RoundaboutParameters, Situation, Watcher, Window,
};
use crate::track::{Class, Object};

/// A gap that one should not miss.
const LONG_GAP_S: f64 = 4.0;
/// And that stays open so long: a shorter one is as long as it must be at one moment, and cannot be used.
const OPEN_S: f64 = 0.5;
/// A gap that opens sooner after the first revolution is not counted: who has just begun to look has not seen everybody.
const WARM_UP_S: f64 = 2.0;
/// Between its first and its last revolution a gap is open for one less than in all.
const REVOLUTION_S: f64 = 0.1;
/// Announcements that are wrong by more than this are no matter of rounding.
const CLEARLY_S: f64 = 0.25;
/// Times to the conflict point are compared from so early.
const HORIZON_S: std::ops::Range<f64> = 2.5..3.5;
/// What was said of a time so far off was of another coming, at which he left after all.
pub(super) const ANOTHER_S: f64 = 10.0;
/// Stay or exit is judged so long before the conflict point.
const JUDGED_S: f64 = 1.5;
/// Farther apart are two different things.
const MATCH_M: f64 = 2.0;

/// Figures so far.
#[derive(Debug)]
pub(super) struct GapScore {
    truth: Watcher,
    /// That should be left.
    margin_s: f64,
    /// Of each arm: its way in, and its way out.
    entries: Vec<WayScore>,
    exits: Vec<WayScore>,
    /// The arm that the vehicle was at first.
    own_arm: Option<usize>,
    /// Time of the first revolution.
    began_s: Option<f64>,
    revolutions: usize,
    agreed: usize,
    comings: Comings,
    windows: WindowScore,
    /// Right and all, of cars and of cyclists.
    lanes: [[usize; 2]; 2],
}

#[derive(Debug, Default)]
struct WayScore {
    was_open: bool,
    announced: usize,
    unsafe_goes: usize,
    clearly_unsafe: usize,
    /// True gaps, the last of which may last still.
    gaps: Vec<TrueGap>,
    was_truly_open: bool,
}

#[derive(Debug, Clone, Copy)]
struct TrueGap {
    from_s: f64,
    until_s: f64,
    was_announced: bool,
}

impl GapScore {
    pub(super) fn new(parameters: &RoundaboutParameters, roads: &Roadmap) -> Self {
        let mut truth = Watcher::new(parameters);
        truth.take_map(roads);
        Self {
            truth,
            margin_s: parameters.margin_s,
            entries: vec![],
            exits: vec![],
            own_arm: None,
            began_s: None,
            revolutions: 0,
            agreed: 0,
            comings: Comings::default(),
            windows: WindowScore::default(),
            lanes: [[0; 2]; 2],
        }
    }

    /// Compares a revolution's advice with what the same rule says of true road users.
    pub(super) fn take(&mut self, advice: &Advice, objects: &[Object], truth: &Situation<'_>) {
        self.truth.watch(truth);
        let Some(true_advice) = self.truth.advice() else {
            return;
        };
        let count = true_advice.arms.len();
        self.entries.resize_with(count, WayScore::default);
        self.exits.resize_with(count, WayScore::default);
        self.own_arm = self.own_arm.or(true_advice.own_arm);
        self.revolutions += count;
        let now_s = truth.time.seconds();
        let is_warm = now_s - *self.began_s.get_or_insert(now_s) >= WARM_UP_S;
        let arms = advice.arms.iter().zip(&true_advice.arms);
        let scores = self.entries.iter_mut().zip(&mut self.exits);
        for ((said, known), (entry, exit)) in arms.zip(scores) {
            self.agreed += usize::from(said.entry.may_go == known.entry.may_go);
            let margin_s = self.margin_s;
            entry.take(&said.entry, &known.entry, margin_s, now_s, is_warm);
            exit.take(&said.exit, &known.exit, margin_s, now_s, is_warm);
        }
        let pairs = pairs(objects, truth.objects);
        compare_lanes(&mut self.lanes, advice, true_advice, truth.objects, &pairs);
        let ours = pairs.iter().map(|&(object, user)| (user, object)).collect();
        self.windows.take(advice, true_advice, &ours);
        self.comings
            .take(advice, true_advice, &ours, truth.time.seconds());
    }

    /// Lines for people, and for scripts: of the vehicle's own arm, if it is at one, and of all.
    pub(super) fn summary(&self) -> String {
        let own = self.own_arm.and_then(|arm| self.entries.get(arm..=arm));
        let own = own.map(|own| format!("own arm: {}\n", gaps_of(own)));
        let mut errors_s = self.comings.errors_s.clone();
        errors_s.sort_by(f64::total_cmp);
        let share = |[right, all]: [usize; 2]| format!("{right} of {all}");
        format!(
            "{}all {} arms: {}; {} decisions, of which {} as the rule on true road users; time to the conflict \
             point at 3 s off by {:.2} s median, {:.2} s at 95 % of {}; stay or exit right {}; lane right: cars {}, \
             cyclists {}\nexits: {}\n{}",
            own.unwrap_or_default(),
            self.entries.len(),
            gaps_of(&self.entries),
            self.revolutions,
            self.agreed,
            quantile(&errors_s, 0.5),
            quantile(&errors_s, 0.95),
            errors_s.len(),
            share(self.comings.judged),
            share(self.lanes[0]),
            share(self.lanes[1]),
            gaps_of(&self.exits),
            self.windows.summary(),
        )
    }
}

/// Of sorted numbers the one below which a part of them lies; 0 of none.
pub(super) fn quantile(sorted: &[f64], part: f64) -> f64 {
    let index = (part * sorted.len() as f64) as usize;
    let index = index.min(sorted.len().saturating_sub(1));
    sorted.get(index).copied().unwrap_or(0.0)
}

/// How gaps were announced on ways.
fn gaps_of(ways: &[WayScore]) -> String {
    let sum = |count: fn(&WayScore) -> usize| ways.iter().map(count).sum::<usize>();
    let missed_of = |least_s: f64| {
        let gaps = ways.iter().flat_map(|way| &way.gaps);
        let gaps = gaps.filter(|gap| gap.until_s - gap.from_s > least_s);
        let missed = gaps.clone().filter(|gap| !gap.was_announced).count();
        format!("{missed} of {}", gaps.count())
    };
    format!(
        "{} gaps announced, {} unsafe, {} by more than {CLEARLY_S} s; {} true gaps of {LONG_GAP_S} s missed, and {} of \
         those that stay open for {OPEN_S} s",
        sum(|way| way.announced),
        sum(|way| way.unsafe_goes),
        sum(|way| way.clearly_unsafe),
        missed_of(f64::NEG_INFINITY),
        missed_of(OPEN_S - 1.5 * REVOLUTION_S),
    )
}

impl WayScore {
    fn take(
        &mut self,
        said: &Crossing,
        known: &Crossing,
        margin_s: f64,
        now_s: f64,
        is_warm: bool,
    ) {
        let short_s = margin_s - known.margin_s;
        let gap_s = known.gap_s;
        let (said, known) = (said.may_go, known.may_go);
        if said && !self.was_open {
            self.announced += 1;
            self.unsafe_goes += usize::from(!known);
            self.clearly_unsafe += usize::from(!known && short_s > CLEARLY_S);
        }
        self.was_open = said;
        let begins = is_warm && known && !self.was_truly_open && gap_s >= LONG_GAP_S;
        if begins {
            self.gaps.push(TrueGap {
                from_s: now_s,
                until_s: now_s,
                was_announced: said,
            });
            self.was_truly_open = true;
        } else if !known {
            self.was_truly_open = false;
        } else if let Some(gap) = self.gaps.last_mut().filter(|_| self.was_truly_open) {
            gap.until_s = now_s;
            gap.was_announced |= said;
        }
    }
}

/// By true road user and arm.
type ByComer<T> = BTreeMap<(u32, usize), T>;

/// Who comes when to the circle's conflict points, and who does not.
#[derive(Debug, Default)]
struct Comings {
    /// Times that road users were said to come, by true road user and arm: when it was said, and when they
    /// should come.
    expected: ByComer<Vec<f64>>,
    errors_s: Vec<f64>,
    /// What was said of staying, by true road user and arm, last before the judgement; and when he would truly
    /// come.
    stays: ByComer<(bool, f64)>,
    judged: [usize; 2],
}

/// When each road user most likely comes to each arm's conflict point on the circle, and how probably.
fn on_circle(advice: &Advice) -> ByComer<(f64, f64)> {
    let windows = advice.windows.iter();
    let windows = windows.filter(|window| window.kind == LaneKind::Road);
    let who = |window: &Window| (window.object_id, window.arm);
    let when = |window: &Window| (window.expected_s, window.probability);
    windows.map(|window| (who(window), when(window))).collect()
}

impl Comings {
    fn take(&mut self, said: &Advice, known: &Advice, ours: &BTreeMap<u32, u32>, now_s: f64) {
        let (said, true_comings) = (on_circle(said), on_circle(known));
        for (&comer, &(true_s, _)) in &true_comings {
            if true_s <= 0.0 {
                self.has_come(comer, now_s);
                continue;
            }
            let (user, arm) = comer;
            let Some(&object) = ours.get(&user) else {
                continue;
            };
            let window = said.get(&(object, arm));
            if let Some((expected_s, _)) = window.filter(|_| HORIZON_S.contains(&true_s)) {
                let expected = self.expected.entry(comer).or_default();
                expected.push(now_s + expected_s);
            }
            let stays = self.stays.entry(comer).or_insert((true, 0.0));
            stays.1 = now_s + true_s;
        }
        for (&(user, arm), (stays, comes_s)) in &mut self.stays {
            if *comes_s - now_s < JUDGED_S {
                continue;
            }
            let window = ours.get(&user).and_then(|&object| said.get(&(object, arm)));
            *stays = window.is_some_and(|(_, probability)| *probability >= 0.5);
        }
        self.judge_leavers(known, now_s);
    }

    /// All that was said of when is judged by now.
    fn has_come(&mut self, comer: (u32, usize), now_s: f64) {
        let predictions = self.expected.remove(&comer).unwrap_or_default();
        let errors_s = predictions.iter().map(|at_s| (at_s - now_s).abs());
        self.errors_s
            .extend(errors_s.filter(|off_s| *off_s < ANOTHER_S));
        if let Some((stays, _)) = self.stays.remove(&comer) {
            self.judged[0] += usize::from(stays);
            self.judged[1] += 1;
        }
    }

    /// Who is truly on a way out does not come to that arm.
    fn judge_leavers(&mut self, known: &Advice, now_s: f64) {
        for user in known.users.iter().filter(|user| user.on.probability > 0.99) {
            let Place::Exit(arm, _) = user.on.place else {
                continue;
            };
            let comer = (user.object_id, arm);
            self.expected.remove(&comer);
            // He would have come by then: that is when it is judged.
            let known = self.stays.get(&comer).copied();
            if let Some((stays, _)) = known.filter(|(_, at_s)| at_s - now_s < JUDGED_S) {
                self.stays.remove(&comer);
                self.judged[0] += usize::from(!stays);
                self.judged[1] += 1;
            }
        }
    }
}

/// Ids of objects and true road users that are one, the closest first.
fn pairs(objects: &[Object], users: &[Object]) -> Vec<(u32, u32)> {
    let mut all: Vec<(f64, u32, u32)> = vec![];
    for object in objects {
        for user in users {
            let [x, y] = [0, 1].map(|axis| object.centre_m[axis] - user.centre_m[axis]);
            let away_m = libm::hypot(x, y);
            if away_m < MATCH_M {
                all.push((away_m, object.id, user.id));
            }
        }
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut found: Vec<(u32, u32)> = vec![];
    for (_, object, user) in all {
        if !found
            .iter()
            .any(|known| known.0 == object || known.1 == user)
        {
            found.push((object, user));
        }
    }
    found
}

/// Whether road users are on the lanes on which the rule puts them that knows them.
fn compare_lanes(
    lanes: &mut [[usize; 2]; 2],
    said: &Advice,
    known: &Advice,
    users: &[Object],
    pairs: &[(u32, u32)],
) {
    let place = |advice: &Advice, id: u32| {
        let user = advice.users.iter().find(|user| user.object_id == id);
        user.map(|user| user.on.place)
    };
    for &(object, user) in pairs {
        let class = users.iter().find(|one| one.id == user).map(|one| one.class);
        let kind = match class {
            Some(Class::Car | Class::LargeVehicle) => 0,
            Some(Class::Cyclist) => 1,
            _ => continue,
        };
        let Some(place_of_user) = place(known, user) else {
            continue;
        };
        lanes[kind][0] += usize::from(place(said, object) == Some(place_of_user));
        lanes[kind][1] += 1;
    }
}
