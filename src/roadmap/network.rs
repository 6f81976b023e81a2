//! Lanes with what is asked of them often.

use std::collections::{BTreeMap, BTreeSet};

use super::arms::REACH_M;
use super::polyline::distance_m;
use super::{Lane, LaneId, Polyline, Roadmap};
use crate::partition::Partition;

/// A map's lanes with what is asked of them often.
pub(super) struct Network<'a> {
    pub(super) lanes: &'a [Lane],
    pub(super) ways: Vec<Polyline>,
    /// Lanes that each one leads into.
    pub(super) leads: BTreeMap<LaneId, BTreeSet<LaneId>>,
    /// Lanes that lead into each one.
    comes: BTreeMap<LaneId, BTreeSet<LaneId>>,
    index: BTreeMap<LaneId, usize>,
}

impl<'a> Network<'a> {
    pub(super) fn of(map: &'a Roadmap) -> Self {
        let mut leads: BTreeMap<LaneId, BTreeSet<LaneId>> = BTreeMap::new();
        let mut comes: BTreeMap<LaneId, BTreeSet<LaneId>> = BTreeMap::new();
        for connector in &map.connectors {
            let [from, to] = [connector.from.lane, connector.to.lane];
            leads.entry(from).or_default().insert(to);
            comes.entry(to).or_default().insert(from);
        }
        let ids = map.lanes.iter().enumerate();
        Self {
            lanes: &map.lanes,
            ways: map.lanes.iter().map(|lane| lane.curve.polyline()).collect(),
            leads,
            comes,
            index: ids.map(|(index, lane)| (lane.id, index)).collect(),
        }
    }

    pub(super) fn index_of(&self, lane: LaneId) -> Option<usize> {
        self.index.get(&lane).copied()
    }

    pub(super) fn leads_on(&self, lane: LaneId) -> bool {
        self.leads.contains_key(&lane)
    }

    pub(super) fn comes_from(&self, lane: LaneId) -> bool {
        self.comes.contains_key(&lane)
    }

    /// A lane with those before it, where there is one way only, as far as arms are followed.
    pub(super) fn way_to(&self, lane: usize) -> Polyline {
        let mut pieces = vec![&self.ways[lane]];
        let mut last = lane;
        while let Some(before) = self.only(&self.comes, last, &pieces, |near, far| (near, far)) {
            pieces.push(&self.ways[before]);
            last = before;
        }
        let points = pieces.iter().rev().flat_map(|way| way.points_m());
        Polyline::through(points.copied())
    }

    /// A lane with those behind it, where there is one way only, as far as arms are followed.
    pub(super) fn way_from(&self, lane: usize) -> Polyline {
        let mut pieces = vec![&self.ways[lane]];
        let mut last = lane;
        while let Some(behind) = self.only(&self.leads, last, &pieces, |near, far| (far, near)) {
            pieces.push(&self.ways[behind]);
            last = behind;
        }
        let points = pieces.iter().flat_map(|way| way.points_m());
        Polyline::through(points.copied())
    }

    /// The only neighbour on that side that begins where the last piece ends, unless the pieces are long enough.
    /// `order` says which of the two comes first.
    fn only(
        &self,
        neighbours: &BTreeMap<LaneId, BTreeSet<LaneId>>,
        last: usize,
        pieces: &[&Polyline],
        order: impl Fn(usize, usize) -> (usize, usize),
    ) -> Option<usize> {
        /// Lanes that go on in each other touch.
        const TOUCHES_M: f64 = 1.0;
        /// No arm is drawn in more.
        const MOST_PIECES: usize = 50;
        let length_m: f64 = pieces.iter().map(|way| way.length_m()).sum();
        if length_m > REACH_M || pieces.len() > MOST_PIECES {
            return None;
        }
        let found = neighbours.get(&self.lanes[last].id)?;
        let touching = found.iter().filter_map(|id| {
            let other = *self.index.get(id)?;
            let (second, first) = order(last, other);
            let end_m = self.ways[first].points_m().last()?;
            let begin_m = self.ways[second].points_m().first()?;
            (distance_m(*end_m, *begin_m) < TOUCHES_M && !self.lanes[other].is_circular)
                .then_some(other)
        });
        let touching: Vec<usize> = touching.collect();
        match touching[..] {
            [one] => Some(one),
            _ => None,
        }
    }

    pub(super) fn leads(&self, from: LaneId, to: LaneId) -> bool {
        let targets = self.leads.get(&from);
        targets.is_some_and(|targets| targets.contains(&to))
    }

    /// Lanes that the map calls parts of roundabouts: those of each one together.
    pub(super) fn circular(&self) -> Vec<BTreeSet<usize>> {
        let circular = self.lanes.iter().enumerate();
        let circular: Vec<usize> = circular
            .filter(|(_, lane)| lane.is_circular)
            .map(|(index, _)| index)
            .collect();
        let mut together = Partition::default();
        together.reset(circular.len());
        let place: BTreeMap<LaneId, u32> = (0u32..)
            .zip(&circular)
            .map(|(place, &index)| (self.lanes[index].id, place))
            .collect();
        let mut roads: BTreeMap<(u32, u32), u32> = BTreeMap::new();
        for (&id, &own) in &place {
            let road = *roads.entry((id.layer, id.road)).or_insert(own);
            together.join(road, own);
            for other in self.leads.get(&id).into_iter().flatten() {
                if let Some(&other) = place.get(other) {
                    together.join(own, other);
                }
            }
        }
        let mut groups: BTreeMap<u32, BTreeSet<usize>> = BTreeMap::new();
        for (place, &index) in (0u32..).zip(&circular) {
            groups
                .entry(together.find(place))
                .or_default()
                .insert(index);
        }
        groups.into_values().collect()
    }
}
