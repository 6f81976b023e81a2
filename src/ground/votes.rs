//! Neighbouring sectors vote on how high the ground is in one, in all layers at once.

use multiversion::multiversion;

use super::surface::{KERB_M, Ring};
use crate::cloud::MAX_LAYERS;
use crate::float::{LANES, each, greatest_each, least_each};

/// Sectors to either side that vote on a level.
pub(super) const VOTERS: usize = 3;
/// All that vote: they and the sector itself, which is in the middle.
const ALL: usize = 2 * VOTERS + 1;
/// As many of them know a level that the sector itself cannot see, or that rises by more than a kerb: what fewer see
/// is the rear of a vehicle.
const FEWEST_VOTES: f32 = 4.0;
/// Part of its distance by which the ring of another sector may be nearer or farther.
const ALIKE: f32 = 0.35;

/// The median level of those that know one and meet the ground about as far away, and their mean
/// distance, for every layer.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(super) fn elected(voters: &[[Ring; MAX_LAYERS]; ALL]) -> [Ring; MAX_LAYERS] {
    let mut elected = [Ring::default(); MAX_LAYERS];
    for half in 0..MAX_LAYERS / LANES {
        let voters = voters.each_ref().map(|rings| &rings.as_chunks().0[half]);
        elected.as_chunks_mut().0[half] = elected_of_half(voters);
    }
    elected
}

/// The same of one half of the layers.
#[inline(always)]
fn elected_of_half(voters: [&[Ring; LANES]; ALL]) -> [Ring; LANES] {
    let own = voters[VOTERS];
    let mut levels_m = [[f32::INFINITY; LANES]; ALL];
    let (mut total_m, mut votes) = ([0.0; LANES], [0.0; LANES]);
    for (rings, levels_m) in voters.into_iter().zip(&mut levels_m) {
        let votes_for_it: [bool; LANES] = each(|lane| {
            let (distance_m, own_m) = (rings[lane].distance_m, own[lane].distance_m);
            let is_alike = (own_m == 0.0) | ((distance_m - own_m).abs() < ALIKE * own_m);
            (distance_m > 0.0) & is_alike
        });
        let voted = |lane, value, otherwise| if votes_for_it[lane] { value } else { otherwise };
        *levels_m = each(|lane| voted(lane, rings[lane].level_m, f32::INFINITY));
        total_m = each(|lane| total_m[lane] + voted(lane, rings[lane].distance_m, 0.0));
        votes = each(|lane| votes[lane] + voted(lane, 1.0, 0.0));
    }
    let median_m = median_of(&levels_m, votes);
    each(|lane| {
        let is_seen = own[lane].distance_m > 0.0;
        if votes[lane] >= FEWEST_VOTES || is_seen && median_m[lane] < KERB_M {
            Ring {
                distance_m: total_m[lane] / votes[lane],
                level_m: median_m[lane],
            }
        } else {
            Ring::default()
        }
    })
}

/// The median of as many levels of each layer as there are votes; the others are infinite. Of two in
/// the middle it is the upper one. Without votes it is infinite.
#[inline(always)]
fn median_of(levels_m: &[[f32; LANES]; ALL], votes: [f32; LANES]) -> [f32; LANES] {
    // The lower half of them, lowest first.
    let mut sorted_m = [[f32::INFINITY; LANES]; VOTERS + 1];
    for level_m in levels_m {
        let mut level_m = *level_m;
        for sorted_m in &mut sorted_m {
            let lower_m = least_each(*sorted_m, level_m);
            level_m = greatest_each(*sorted_m, level_m);
            *sorted_m = lower_m;
        }
    }
    let mut median_m = sorted_m[0];
    for (below, sorted_m) in sorted_m.iter().enumerate().skip(1) {
        let least_votes = 2.0 * below as f32;
        for lane in 0..LANES {
            let is_lower = votes[lane] >= least_votes;
            median_m[lane] = if is_lower {
                sorted_m[lane]
            } else {
                median_m[lane]
            };
        }
    }
    median_m
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(distance_m: f32, level_m: f32) -> Ring {
        Ring {
            distance_m,
            level_m,
        }
    }

    /// What is elected in two layers, of either half one, given what all sectors see in both.
    fn of_layer(seen: [Ring; ALL]) -> Ring {
        let layers = [5, 13];
        let mut voters = [[Ring::default(); MAX_LAYERS]; ALL];
        for (voter, ring) in voters.iter_mut().zip(seen) {
            for layer in layers {
                voter[layer] = ring;
            }
        }
        let elected = elected(&voters);
        let mut others = (0..MAX_LAYERS).filter(|layer| !layers.contains(layer));
        assert!(others.all(|layer| elected[layer].distance_m == 0.0));
        let [a, b] = layers.map(|layer| elected[layer]);
        assert_eq!((a.distance_m, a.level_m), (b.distance_m, b.level_m));
        a
    }

    #[test]
    fn the_median_is_elected_by_those_that_are_as_far_away() {
        let levels_m = [0.4, 0.1, -0.2, 0.9, 0.3, 0.0, 0.2];
        let elected = of_layer(levels_m.map(|level_m| ring(10.0, level_m)));
        assert_eq!((elected.distance_m, elected.level_m), (10.0, 0.2));

        // Two are too far away, one knows nothing: four are left.
        let mut seen = levels_m.map(|level_m| ring(10.0, level_m));
        (seen[0].distance_m, seen[2].distance_m) = (14.0, 6.0);
        seen[6] = Ring::default();
        seen[1].distance_m = 12.0;
        let elected = of_layer(seen);
        assert_eq!((elected.distance_m, elected.level_m), (10.5, 0.3));
    }

    #[test]
    fn a_sector_that_sees_nothing_believes_four_others_and_no_fewer() {
        let mut seen = [ring(10.0, 0.1); ALL];
        (seen[3], seen[0], seen[6]) = (Ring::default(), Ring::default(), ring(30.0, 0.1));
        let elected = of_layer(seen);
        assert_eq!((elected.distance_m, elected.level_m), (14.0, 0.1));
        (seen[5], seen[6]) = (Ring::default(), Ring::default());
        assert_eq!(of_layer(seen).distance_m, 0.0);
        // It believes its own eyes, though, but for a rise.
        for (level_m, believed_m) in [(0.1, 0.1), (-0.8, -0.8), (0.5, 0.0)] {
            seen = [Ring::default(); ALL];
            seen[3] = ring(10.0, level_m);
            assert_eq!(of_layer(seen).level_m, believed_m);
        }
    }
}
