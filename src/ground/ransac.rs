//! Random sample consensus (Fischler, Bolles 1981) over the lowest returns.

use nalgebra::Vector3;

use super::minima::Minima;
use super::moments::{moments_near, squared_distances};
use super::{GroundParameters, Plane, Scoring};
use crate::random::Random;

/// Draws for three returns before an iteration is given up: with few slices filled there may
/// be no three that are not neighbours.
const DRAWS: usize = 16;

/// The plausible plane with the least error, or `None` if no draw gives a plausible one.
/// `near` is the plane of the revolution before, if the next one must be close to it.
pub(super) fn find(
    minima: &Minima,
    near: Option<&Plane>,
    parameters: &GroundParameters,
    random: &mut Random,
) -> Option<Plane> {
    if minima.len() < 3 {
        return None;
    }
    let mut best: Option<(f32, Plane)> = None;
    for _ in 0..parameters.iterations {
        let Some(plane) = candidate(minima, parameters, random) else {
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
fn candidate(minima: &Minima, parameters: &GroundParameters, random: &mut Random) -> Option<Plane> {
    let [a, b, c] = draw(minima, random)?;
    let drawn = Plane::through(a, b, c)?;
    let near_m = parameters.inlier_distance_m as f32;
    let moments = moments_near(minima.points(), 1, &drawn, near_m, f32::INFINITY);
    let needed = (parameters.least_support * minima.len() as f64).max(3.0);
    if moments.count < needed {
        return None;
    }
    moments.plane()
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
fn error(minima: &Minima, plane: &Plane, parameters: &GroundParameters) -> f32 {
    let most = match parameters.scoring {
        Scoring::All => f64::INFINITY,
        Scoring::Truncated => parameters.inlier_distance_m * parameters.inlier_distance_m,
    };
    squared_distances(minima.points(), plane, most as f32)
}
