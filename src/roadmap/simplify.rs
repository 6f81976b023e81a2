//! A lane network reduced to what the question of the gap needs: circles and arms.

use super::Polyline;
use super::polyline::distance_m;
use super::roundabout::Roundabout;

/// No point of the map's arms is farther than this from what is left of them; nor, where the map
/// is a circle at all, of its rings.
pub const SIMPLIFIED_WITHIN_M: f64 = 0.2;

/// A reduced roundabout.
#[derive(Debug, Clone, PartialEq)]
pub struct Simplified {
    /// With arms of few points.
    pub roundabout: Roundabout,
    /// Points of the arms before.
    pub points: usize,
    /// Of these left out.
    pub dropped: usize,
    /// Largest distance of a point that was left out from what is left.
    pub off_m: f64,
}

/// Leaves out the points of the arms that change nothing by more than
/// [`SIMPLIFIED_WITHIN_M`] (Douglas and Peucker 1973).
pub fn simplified(roundabout: &Roundabout) -> Simplified {
    let mut result = Simplified {
        roundabout: roundabout.clone(),
        points: 0,
        dropped: 0,
        off_m: 0.0,
    };
    for arm in &mut result.roundabout.arms {
        for access in arm.entries.iter_mut().chain(&mut arm.exits) {
            let kept = thinned(access.way.points_m());
            result.points += access.way.points_m().len();
            result.dropped += access.way.points_m().len() - kept.points_m().len();
            for &point_m in access.way.points_m() {
                let station = kept.nearest(point_m);
                let off_m = station.map_or(0.0, |station| station.distance_m);
                result.off_m = result.off_m.max(off_m);
            }
            access.way = kept;
        }
    }
    result
}

fn thinned(points_m: &[[f64; 2]]) -> Polyline {
    let mut is_kept = vec![false; points_m.len()];
    let Some(last) = points_m.len().checked_sub(1) else {
        return Polyline::default();
    };
    is_kept[0] = true;
    is_kept[last] = true;
    let mut pieces = vec![(0, last)];
    while let Some((from, to)) = pieces.pop() {
        let mut worst = (SIMPLIFIED_WITHIN_M, None);
        for (index, &point_m) in points_m.iter().enumerate().take(to).skip(from + 1) {
            let off_m = off_m(point_m, points_m[from], points_m[to]);
            if off_m > worst.0 {
                worst = (off_m, Some(index));
            }
        }
        if let (_, Some(index)) = worst {
            is_kept[index] = true;
            pieces.extend([(from, index), (index, to)]);
        }
    }
    let kept = points_m.iter().zip(is_kept);
    Polyline::through(kept.filter(|(_, kept)| *kept).map(|(&point_m, _)| point_m))
}

/// From a point to the piece between two others.
fn off_m(point_m: [f64; 2], from_m: [f64; 2], to_m: [f64; 2]) -> f64 {
    let piece = Polyline::through([from_m, to_m]);
    let station = piece.nearest(point_m);
    station.map_or_else(|| distance_m(point_m, from_m), |station| station.distance_m)
}
