//! Lanes with what is asked of them often.

use std::collections::{BTreeMap, BTreeSet};

use super::{Lane, LaneId, Polyline, Roadmap};
use crate::partition::Partition;

/// A map's lanes with what is asked of them often.
pub(super) struct Network<'a> {
    pub(super) lanes: &'a [Lane],
    pub(super) ways: Vec<Polyline>,
    /// Lanes that each one leads into.
    pub(super) leads: BTreeMap<LaneId, BTreeSet<LaneId>>,
}

impl<'a> Network<'a> {
    pub(super) fn of(map: &'a Roadmap) -> Self {
        let mut leads: BTreeMap<LaneId, BTreeSet<LaneId>> = BTreeMap::new();
        for connector in &map.connectors {
            let targets = leads.entry(connector.from.lane).or_default();
            targets.insert(connector.to.lane);
        }
        Self {
            lanes: &map.lanes,
            ways: map.lanes.iter().map(|lane| lane.curve.polyline()).collect(),
            leads,
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
