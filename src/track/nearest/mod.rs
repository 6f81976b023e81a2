//! Tracking as the thesis has it (section 4.1.3): every cluster is an object, ids go to the
//! nearest cluster, and a CTRV filter gives the motion.

mod ctrv;

mod identity;

use nalgebra::Vector2;

use super::{Class, Object, TrackParameters};
use crate::cloud::Scan;
use crate::cluster::Clusters;
use crate::ego::{Sweep, wrapped_rad};
use crate::geometry::Rectangle;
use crate::ground::Plane;
use crate::time::Time;
use ctrv::Filter;
use identity::Identities;

/// Above this speed the box lies along the motion.
const MOVING_MPS: f64 = 0.8;
/// Of what is not known: any direction, any speed in a town.
const UNKNOWN_YAW_RAD: f64 = 0.9;
const UNKNOWN_SPEED_MPS: f64 = 8.0;
/// Standard deviation of where the middle of a cluster is seen.
const CENTRE_M: f64 = 0.2;

/// Clusters with ids.
#[derive(Debug, Clone, Default)]
pub(super) struct NearestTracker {
    identities: Identities,
    followed: Vec<Followed>,
    objects: Vec<Object>,
}

#[derive(Debug, Clone)]
struct Followed {
    id: u32,
    first_seen: Time,
    last_seen: Time,
    sightings: u32,
    filter: Filter,
}

impl NearestTracker {
    pub(super) fn reset(&mut self) {
        self.identities.forget();
        self.followed.clear();
        self.objects.clear();
    }

    pub(super) fn objects(&self) -> &[Object] {
        &self.objects
    }

    pub(super) fn process(
        &mut self,
        scan: &Scan,
        clusters: &Clusters,
        ground: &Plane,
        sweep: &Sweep,
        parameters: &TrackParameters,
    ) {
        let placement = sweep.sensor.placement();
        let place = |point: &u32| {
            let [x, y, _] = scan.point_m(*point as usize).map(f64::from);
            placement.local_m([x, y])
        };
        let middle = |points: &[u32]| {
            let sum = points
                .iter()
                .map(place)
                .fold([0.0; 2], |sum, at| [sum[0] + at[0], sum[1] + at[1]]);
            sum.map(|axis| axis / points.len() as f64)
        };
        let centres: Vec<[f64; 2]> = clusters.iter().map(middle).collect();
        let ids = self
            .identities
            .assign(&centres, parameters.association_distance_m);
        let mut pieces: Vec<(u32, usize)> = ids.iter().copied().zip(0..).collect();
        pieces.sort_unstable();
        self.followed
            .retain(|followed| pieces.iter().any(|(id, _)| *id == followed.id));
        self.objects.clear();
        for pieces in pieces.chunk_by(|a, b| a.0 == b.0) {
            let points = || {
                pieces
                    .iter()
                    .flat_map(|(_, cluster)| clusters.points(*cluster))
            };
            let outline: Vec<[f64; 2]> = points().map(place).collect();
            let above_m = points().map(|point| {
                let position = scan.point_m(*point as usize).map(f64::from);
                ground.above_m(&position.into())
            });
            let height_m = above_m.fold(0.0, f64::max);
            let followed = self.follow(pieces[0].0, scan.time(), middle_of(&outline));
            let object = object_of(followed, &outline, height_m, scan.time(), sweep);
            self.objects.push(object);
        }
    }

    fn follow(&mut self, id: u32, now: Time, centre_m: Vector2<f64>) -> &Followed {
        let found = self.followed.iter().position(|followed| followed.id == id);
        let index = found.unwrap_or_else(|| {
            self.followed.push(Followed {
                id,
                first_seen: now,
                last_seen: now,
                sightings: 0,
                filter: Filter::new(centre_m),
            });
            self.followed.len() - 1
        });
        let followed = &mut self.followed[index];
        followed
            .filter
            .step((now - followed.last_seen).seconds(), centre_m);
        followed.last_seen = now;
        followed.sightings = followed.sightings.saturating_add(1);
        followed
    }
}

fn middle_of(outline: &[[f64; 2]]) -> Vector2<f64> {
    let sum: Vector2<f64> = outline.iter().map(|at| Vector2::from(*at)).sum();
    sum / outline.len() as f64
}

fn object_of(
    followed: &Followed,
    outline: &[[f64; 2]],
    height_m: f64,
    now: Time,
    sweep: &Sweep,
) -> Object {
    let motion = followed.filter.motion();
    let moving = motion.filter(|[_, speed_mps, _]| *speed_mps > MOVING_MPS);
    let rectangle = Rectangle::fit(outline, moving.map(|[yaw_rad, _, _]| yaw_rad));
    let [x, y] = rectangle.centre_m;
    let [yaw_deviation_rad, speed_deviation_mps] = followed
        .filter
        .deviations()
        .unwrap_or([UNKNOWN_YAW_RAD, UNKNOWN_SPEED_MPS]);
    Object {
        id: followed.id,
        class: Class::Unclassified,
        class_probability: 0.0,
        measured: true,
        centre_m: [x, y, sweep.sensor.position_m[2] + 0.5 * height_m],
        yaw_rad: wrapped_rad(rectangle.yaw_rad),
        speed_mps: motion.map_or(0.0, |[_, speed_mps, _]| speed_mps),
        yaw_rate_radps: motion.map_or(0.0, |[_, _, rate]| rate),
        length_m: rectangle.length_m,
        width_m: rectangle.width_m,
        height_m,
        position_deviation_m: [CENTRE_M; 2],
        yaw_deviation_rad,
        speed_deviation_mps,
        // Half of all single clusters are noise, and each further sighting halves the doubt.
        existence: 1.0 - libm::exp2(-f64::from(followed.sightings.min(50))),
        first_seen: followed.first_seen,
        seen_since: followed.first_seen,
        last_measured: now,
        points: outline.len(),
    }
}
