//! Windows at conflict points beside those of the same rule on true road users: how much earlier than told somebody
//! comes, and how much later he is gone.

use std::collections::BTreeMap;

use super::gap_score::{ANOTHER_S, quantile};
use crate::roadmap::LaneKind;
use crate::roundabout::{Advice, Window};

/// Windows that begin or end so soon decide whether one may enter.
const NEAR_S: std::ops::Range<f64> = 1.0..6.0;

/// Differences so far, by the kind of way that is crossed.
#[derive(Debug, Default)]
pub(super) struct WindowScore {
    /// By how much he came earlier than the window's begin, at ways in where no gap was announced.
    earlier_s: [Vec<f64>; 3],
    /// By how much he was gone later than its end.
    later_s: [Vec<f64>; 3],
}

impl WindowScore {
    /// Compares the windows of a revolution at ways in; `ours` are the ids of objects by true road user.
    pub(super) fn take(&mut self, said: &Advice, known: &Advice, ours: &BTreeMap<u32, u32>) {
        let of = |window: &Window| (window.object_id, window.arm, window.conflict);
        let said_windows = said.windows.iter().filter(|window| !window.at_exit);
        let said_windows: BTreeMap<_, _> =
            said_windows.map(|window| (of(window), window)).collect();
        for truth in known.windows.iter().filter(|window| !window.at_exit) {
            let Some(&object) = ours.get(&truth.object_id) else {
                continue;
            };
            let Some(window) = said_windows.get(&(object, truth.arm, truth.conflict)) else {
                continue;
            };
            let kind = truth.kind.number() as usize;
            let is_open = said.arms.get(truth.arm).is_some_and(|arm| arm.entry.may_go);
            let note = |into: &mut [Vec<f64>; 3], off_s: f64| {
                if off_s.abs() < ANOTHER_S {
                    into[kind].push(off_s);
                }
            };
            // Where a gap has been announced windows are as is likely.
            if NEAR_S.contains(&truth.begin_s) && !is_open {
                note(&mut self.earlier_s, window.begin_s - truth.begin_s);
            }
            if NEAR_S.contains(&truth.end_s) {
                note(&mut self.later_s, truth.end_s - window.end_s);
            }
        }
    }

    /// A line for people, and for scripts.
    pub(super) fn summary(&self) -> String {
        let told = |off_s: &Vec<f64>| {
            let mut off_s = off_s.clone();
            off_s.sort_by(f64::total_cmp);
            format!(
                "{:.2} s median, {:.2} s at 99 % of {}",
                quantile(&off_s, 0.5),
                quantile(&off_s, 0.99),
                off_s.len()
            )
        };
        let kinds = LaneKind::ALL.iter().map(|kind| {
            let index = kind.number() as usize;
            let [earlier, later] = [&self.earlier_s[index], &self.later_s[index]].map(told);
            format!(
                "{} comes earlier than told by {earlier}, is gone later by {later}",
                kind.name()
            )
        });
        format!("windows: {}", kinds.collect::<Vec<_>>().join("; "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn advice(object_id: u32, begin_s: f64, end_s: f64) -> Advice {
        let window = Window {
            object_id,
            arm: 2,
            at_exit: false,
            conflict: 1,
            kind: LaneKind::Bikeway,
            begin_s,
            end_s,
            expected_s: begin_s,
            probability: 1.0,
            way_m: 10.0,
        };
        Advice {
            windows: vec![window],
            ..Advice::default()
        }
    }

    #[test]
    fn who_comes_before_his_window_or_is_gone_after_it_is_told() {
        let mut score = WindowScore::default();
        let ours = BTreeMap::from([(7, 40)]);
        score.take(&advice(40, 3.5, 4.2), &advice(7, 3.0, 4.5), &ours);
        // Of somebody else, and too far off to matter.
        score.take(&advice(41, 3.9, 4.2), &advice(7, 3.0, 4.5), &ours);
        score.take(&advice(40, 9.0, 9.5), &advice(7, 8.0, 9.0), &ours);
        let said = score.summary();
        let due = "bikeway comes earlier than told by 0.50 s median, 0.50 s at 99 % of 1, is gone later by 0.30 s median, 0.30 s at \
                   99 % of 1;";
        assert!(said.contains(due), "{said}");
    }
}
