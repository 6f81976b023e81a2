//! Random sample consensus (Fischler, Bolles 1981) over the lowest returns.

use nalgebra::Vector3;

use super::minima::Minima;
use super::{GroundParameters, Plane, Scoring};
use crate::random::Random;

/// Draws for three returns before an iteration is given up: with few slices filled there may
/// be no three that are not neighbours.
const DRAWS: usize = 16;

/// The plausible plane with the least error, or `None` if no draw gives a plausible one.
/// `near` is the plane of the revolution before, if the next one must be close to it; `support`
/// is a buffer.
pub(super) fn find(
    minima: &Minima,
    near: Option<&Plane>,
    parameters: &GroundParameters,
    random: &mut Random,
    support: &mut Vec<Vector3<f64>>,
) -> Option<Plane> {
    if minima.len() < 3 {
        return None;
    }
    let mut best: Option<(f64, Plane)> = None;
    for _ in 0..parameters.iterations {
        let Some(plane) = candidate(minima, parameters, random, support) else {
            continue;
        };
        if !is_plausible(&plane, near, parameters) {
            continue;
        }
        let error = error(minima, &plane, parameters);
        if best.is_none_or(|(least, _)| error < least) {
            best = Some((error, plane));
        }
    }
    best.map(|(_, plane)| plane)
}

/// A plane through three returns, refined by all that lie close to it.
fn candidate(
    minima: &Minima,
    parameters: &GroundParameters,
    random: &mut Random,
    support: &mut Vec<Vector3<f64>>,
) -> Option<Plane> {
    let [a, b, c] = draw(minima, random)?;
    let drawn = Plane::through(a, b, c)?;
    let supports =
        |point: &Vector3<f64>| drawn.above_m(point).abs() <= parameters.inlier_distance_m;
    support.clear();
    support.extend(minima.points().filter(supports));
    let needed = (parameters.least_support * minima.len() as f64).max(3.0);
    if (support.len() as f64) < needed {
        return None;
    }
    Plane::fit(support.iter().copied())
}

/// Three returns from slices that are not neighbours of each other.
fn draw(minima: &Minima, random: &mut Random) -> Option<[Vector3<f64>; 3]> {
    let segments = minima.segments();
    let apart = |a: usize, b: usize| {
        let between = a.abs_diff(b);
        between.min(segments - between) > 1
    };
    (0..DRAWS).find_map(|_| {
        let [(s, a), (t, b), (u, c)] =
            std::array::from_fn(|_| minima.get(random.below(minima.len())));
        (apart(s, t) && apart(t, u) && apart(s, u)).then_some([a, b, c])
    })
}

/// Whether a plane is within the configured heights and tilts, and near the last one.
pub(super) fn is_plausible(
    plane: &Plane,
    near: Option<&Plane>,
    parameters: &GroundParameters,
) -> bool {
    let within = (parameters.height_low_m..=parameters.height_high_m).contains(&plane.height_m())
        && plane.tilt_rad() <= parameters.tilt_high_deg.to_radians();
    let follows = near.is_none_or(|last| {
        (plane.height_m() - last.height_m()).abs() <= parameters.follow_height_m
            && plane.angle_to_rad(last) <= parameters.follow_tilt_deg.to_radians()
    });
    within && follows
}

/// Sum of squared distances to the plane.
fn error(minima: &Minima, plane: &Plane, parameters: &GroundParameters) -> f64 {
    let most = match parameters.scoring {
        Scoring::All => f64::INFINITY,
        Scoring::Truncated => parameters.inlier_distance_m * parameters.inlier_distance_m,
    };
    let squared = |point: Vector3<f64>| plane.above_m(&point) * plane.above_m(&point);
    minima.points().map(|point| squared(point).min(most)).sum()
}
