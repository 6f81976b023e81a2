//! One revolution for all tracks: what is whose, what is new, what is hidden, what is gone.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector2;

use super::assignment::assign;
use super::road_user::Track;
use super::shape::Look;
use super::sight::Sight;
use super::spots::{Patch, Placer, Spot};
use super::{Object, Outline, Rectangle, Scene, TrackParameters};
use crate::cloud::{MAX_LAYERS, Scan};
use crate::cluster::Clusters;
use crate::ego::{Pose, wrapped_rad};
use crate::time::{Span, Time};

/// Tracks of road users.
#[derive(Debug, Clone, Default)]
pub(super) struct ObjectTracker {
    next_id: u32,
    tracks: Vec<Track>,
    objects: Vec<Object>,
    placer: Placer,
    spots: Vec<Spot>,
    patches: Vec<Patch>,
    groups: Vec<Group>,
    /// Group numbers of what was cut off structure, ascending.
    suspects: Vec<u32>,
    outline: Vec<[f64; 2]>,
}

/// Returns that may be one object: a stretch of the spots.
#[derive(Debug, Clone, Copy)]
struct Group {
    begin: usize,
    end: usize,
    look: Look,
    /// The track in whose place they were found.
    claimed_by: Option<usize>,
    /// Whether a new object may come of it.
    may_be_new: bool,
}

/// Where a track is expected.
struct Forecast {
    rectangle: Rectangle,
    outline: Outline,
    reach_m: f64,
    margin_m: f64,
    most_m: [f64; 2],
    yaw_rad: f64,
}

/// Heights above the ground and distance from a known box at which a return of no cluster may be
/// the object's.
const STRAY_LOW_M: f64 = 0.25;
const STRAY_ABOVE_M: f64 = 0.3;
const STRAY_M: f64 = 0.4;
/// Group number of spots that belong to no group.
const NOBODY: u32 = u32::MAX;
/// Around the box of a track its returns may lie this far out, and farther where it is unsure.
const LEAST_MARGIN_M: f64 = 0.25;
const MOST_MARGIN_M: f64 = 0.9;
/// Two free groups this close may be pieces of one vehicle.
const GAP_M: f64 = 0.45;
const LONGEST_JOINED_M: f64 = 5.4;
/// Share of a cluster in the place of a track, from which on all of it may belong to that.
const LEAST_CLAIM: f64 = 0.3;
/// Fewer returns are noise.
const FEWEST_RETURNS: usize = 3;
/// Returns of a single low layer that show a vehicle.
const BUMPER_RETURNS: usize = 15;
/// Cost beyond which a group is not a track: chi-squared of two degrees of freedom at 0.9997,
/// and the prices for size and spread.
const GATE: f64 = 16.0;
/// What it speaks for a pairing that the group was found in the track's place.
const CLAIM_BONUS: f64 = 4.0;
/// Farthest leap from one revolution to the next.
const FARTHEST_LEAP_M: f64 = 6.0;

impl ObjectTracker {
    pub(super) fn reset(&mut self) {
        self.tracks.clear();
        self.objects.clear();
    }

    pub(super) fn objects(&self) -> &[Object] {
        &self.objects
    }

    /// Adds the boxes of vehicles that drive, as they will be at a time, seen from the sensor.
    pub(super) fn expect(&self, end: Time, sensor: &Pose, boxes: &mut Vec<Rectangle>) {
        let placement = sensor.placement();
        let driving = self
            .tracks
            .iter()
            .filter(|track| track.is_confirmed() && track.is_moving_vehicle());
        boxes.extend(driving.map(|track| {
            let mut later = track.clone();
            later.predict(end);
            let place = later.rectangle();
            Rectangle {
                centre_m: placement.sensor_m(place.centre_m),
                yaw_rad: wrapped_rad(place.yaw_rad - sensor.yaw_rad + FRAC_PI_2),
                ..place
            }
        }));
    }

    /// The frame changed: what was at `from` is now at `to`.
    pub(super) fn reframe(&mut self, from: &Pose, to: &Pose) {
        let (old, new) = (from.placement(), to.placement());
        let turn_rad = wrapped_rad(to.yaw_rad - from.yaw_rad);
        let rise_m = to.position_m[2] - from.position_m[2];
        for track in &mut self.tracks {
            track.reframe(turn_rad, |at| new.local_m(old.sensor_m(at)), rise_m);
        }
    }

    pub(super) fn process(
        &mut self,
        clusters: &Clusters,
        scene: &Scene<'_>,
        parameters: &TrackParameters,
    ) {
        let end = scene.scan.time();
        self.placer.place(
            clusters,
            scene,
            parameters,
            &mut self.spots,
            &mut self.patches,
        );
        self.predict(scene, end);
        self.divide(parameters, scene.scan);
        self.add_strays(clusters, scene);
        self.gather(scene);
        self.join_pieces(scene);
        let pairs = self.pair(parameters);
        self.update(&pairs, scene, end);
        self.begin(&pairs, scene, end, parameters);
        self.tidy(parameters);
        self.publish(end, parameters);
    }

    /// Every track to the time at which the sensor passed over its place.
    fn predict(&mut self, scene: &Scene<'_>, end: Time) {
        let placement = scene.sweep.sensor.placement();
        for track in &mut self.tracks {
            let expected = track.position_m()
                + track.velocity_mps() * (end - track.last_measured).seconds().clamp(0.0, 0.2);
            let [x, y] = placement.sensor_m(expected.into());
            let column = scene.scan.column_at(libm::atan2(x, y));
            let age_s = scene.scan.age_s(column);
            track.predict(end + Span::from_seconds(-age_s));
        }
    }

    fn forecasts(&self) -> Vec<Forecast> {
        let forecast = |track: &Track| {
            let rectangle = track.rectangle();
            let margin_m = (LEAST_MARGIN_M + track.spread_m()).min(MOST_MARGIN_M);
            let reach_m = 0.5 * libm::hypot(rectangle.length_m, rectangle.width_m) + margin_m;
            Forecast {
                rectangle,
                outline: rectangle.outline(),
                reach_m,
                margin_m,
                most_m: track.most_m(),
                yaw_rad: track.yaw_rad(),
            }
        };
        self.tracks.iter().map(forecast).collect()
    }

    /// Gives every spot a group: the track in whose place it lies, or its own cluster.
    fn divide(&mut self, parameters: &TrackParameters, scan: &Scan) {
        let forecasts = self.forecasts();
        let tracks = self.tracks.len();
        self.suspects.clear();
        for (number, patch) in self.patches.iter().enumerate() {
            if patch.is_suspect {
                self.suspects.push((tracks + number) as u32);
            }
            let own = (tracks + number) as u32;
            let spots = &mut self.spots[patch.begin..patch.end];
            let is_whole = patch.can_be_road_user(parameters);
            let near: Vec<usize> = (0..tracks)
                .filter(|track| is_near(&forecasts[*track], patch))
                .collect();
            let unclaimed = if is_whole { own } else { NOBODY };
            let mut claims = 0u32;
            let mut only = None;
            let mut several = false;
            for spot in spots.iter_mut() {
                spot.group = unclaimed;
                let nearest = near
                    .iter()
                    .map(|track| {
                        (
                            forecasts[*track].outline.distance_m(spot.at_m.into()),
                            *track,
                        )
                    })
                    .filter(|(distance_m, track)| {
                        // In structure only what is well within may be its own.
                        let margin_m = if is_whole {
                            forecasts[*track].margin_m
                        } else {
                            0.15
                        };
                        *distance_m <= margin_m
                    })
                    .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                if let Some((_, track)) = nearest {
                    spot.group = track as u32;
                    claims += 1;
                    several |= only.is_some_and(|only| only != track);
                    only = Some(track);
                }
            }
            // A part that reaches out of the only box belongs to it as long as the whole can be
            // one object.
            if let (Some(track), false, true) = (only, several, is_whole) {
                let forecast = &forecasts[track];
                let share = f64::from(claims) / spots.len() as f64;
                if share > LEAST_CLAIM && fits(spots, forecast) {
                    for spot in spots.iter_mut() {
                        spot.group = track as u32;
                    }
                }
            }
        }
        self.align_seam(scan);
    }

    /// Adds returns of no cluster to the known objects in whose places they lie: far away too few
    /// meet a cyclist to be a cluster.
    fn add_strays(&mut self, clusters: &Clusters, scene: &Scene<'_>) {
        let Scene { scan, sweep, .. } = *scene;
        let placement = sweep.sensor.placement();
        for (number, track) in self.tracks.iter().enumerate() {
            if !track.is_confirmed() || !track.is_sparse() {
                continue;
            }
            let place = track.rectangle();
            let outline = place.outline();
            let corners = place.corners().map(|corner| placement.sensor_m(corner));
            let Some((first, count)) = scan.columns_across(&corners) else {
                continue;
            };
            let heights_m = STRAY_LOW_M..track.height_m() + STRAY_ABOVE_M;
            for column in (first..first + count).map(|column| column % scan.columns()) {
                for layer in 0..MAX_LAYERS {
                    let point = scan.index(column, layer);
                    let above_m = f64::from(scene.heights_m[point]);
                    if clusters.labels()[point] != Clusters::NONE
                        || !scan.has_return(point)
                        || !heights_m.contains(&above_m)
                    {
                        continue;
                    }
                    let [x, y, _] = scan.point_m(point).map(f64::from);
                    let at_m = self.placer.placements()[column].local_m([x, y]);
                    if outline.distance_m(at_m) < STRAY_M {
                        self.spots.push(Spot {
                            at_m: Vector2::from(at_m),
                            above_m,
                            age_s: scan.age_s(column),
                            point: point as u32,
                            group: number as u32,
                        });
                    }
                }
            }
        }
    }

    /// What moves is seen twice at the seam of the sweep, a revolution apart: brings the older
    /// part of a known object to the time of the newer.
    fn align_seam(&mut self, scan: &Scan) {
        let duration_s = scan.duration_s();
        for patch in self.patches.iter().filter(|patch| patch.over_seam) {
            for spot in &mut self.spots[patch.begin..patch.end] {
                let is_old = spot.age_s > 0.5 * duration_s;
                if let (Some(track), true) = (self.tracks.get(spot.group as usize), is_old) {
                    spot.at_m += track.velocity_mps() * duration_s;
                    spot.age_s -= duration_s;
                }
            }
        }
    }

    /// Puts the spots of every group side by side and looks at it.
    fn gather(&mut self, scene: &Scene<'_>) {
        let sensor_m = Vector2::from(scene.sweep.sensor.placement().origin_m());
        self.spots.retain(|spot| spot.group != NOBODY);
        self.spots.sort_by_key(|spot| spot.group);
        self.groups.clear();
        let mut begin = 0;
        for spots in self.spots.chunk_by(|a, b| a.group == b.group) {
            let end = begin + spots.len();
            let number = spots[0].group as usize;
            let claimed_by = (number < self.tracks.len()).then_some(number);
            if spots.len() >= FEWEST_RETURNS || claimed_by.is_some() {
                self.groups.push(Group {
                    begin,
                    end,
                    look: Look::at(spots, scene.scan, sensor_m),
                    claimed_by,
                    may_be_new: claimed_by.is_none() && spots.len() >= FEWEST_RETURNS,
                });
            }
            begin = end;
        }
    }

    /// Joins free groups that stand close together and can be one vehicle.
    fn join_pieces(&mut self, scene: &Scene<'_>) {
        let boxes: Vec<[Vector2<f64>; 2]> =
            self.groups.iter().map(|group| self.bounds(group)).collect();
        let mut target: Vec<usize> = (0..self.groups.len()).collect();
        let mut joined = false;
        for a in 0..self.groups.len() {
            for b in a + 1..self.groups.len() {
                let (first, second) = (&self.groups[a], &self.groups[b]);
                if first.claimed_by.is_some() || second.claimed_by.is_some() {
                    continue;
                }
                let gap = (boxes[b][0] - boxes[a][1]).sup(&(boxes[a][0] - boxes[b][1]));
                if gap.sup(&Vector2::zeros()).norm() > GAP_M {
                    continue;
                }
                let whole = boxes[a][1].sup(&boxes[b][1]) - boxes[a][0].inf(&boxes[b][0]);
                let is_wide = |side: [Vector2<f64>; 2]| (side[1] - side[0]).norm() > 1.0;
                let one_is_wide = is_wide(boxes[a]) || is_wide(boxes[b]);
                if whole.norm() <= LONGEST_JOINED_M && one_is_wide && target[b] == b {
                    target[b] = target[a];
                    joined = true;
                }
            }
        }
        for (free, target) in target.iter_mut().enumerate() {
            if self.groups[free].claimed_by.is_none()
                && let Some(owner) = self.missing_part(free)
            {
                (*target, joined) = (owner, true);
            }
        }
        if !joined {
            return;
        }
        for (number, group) in self.groups.iter().enumerate() {
            if target[number] != number {
                let to = self.spots[self.groups[target[number]].begin].group;
                for spot in &mut self.spots[group.begin..group.end] {
                    spot.group = to;
                }
            }
        }
        self.gather(scene);
    }

    /// The group of a vehicle whose bumper or rear a free group can be: a bonnet that rises
    /// towards the screen leaves a gap between two layers.
    fn missing_part(&self, free: usize) -> Option<usize> {
        /// Between a bumper and the foot of a screen.
        const BONNET_M: f64 = 1.6;
        /// Narrower ones are people.
        const NARROWEST_M: f64 = 0.9;
        let group = &self.groups[free];
        let [low, high] = self.bounds(group);
        if (high - low).norm() < NARROWEST_M {
            return None;
        }
        self.groups.iter().position(|other| {
            let Some(track) = other.claimed_by.map(|number| &self.tracks[number]) else {
                return false;
            };
            let apart_m = (other.look.middle_m - group.look.middle_m).norm();
            if !track.is_moving_vehicle() || apart_m > track.rectangle().length_m {
                return false;
            }
            let axes = |group: &Group| {
                let spots = &self.spots[group.begin..group.end];
                extent(spots, track.yaw_rad())
            };
            let ([low, high], [other_low, other_high]) = (axes(group), axes(other));
            let size = [
                track.rectangle().length_m + 0.2,
                track.rectangle().width_m + 0.3,
            ];
            let gap_m = (low[0] - other_high[0]).max(other_low[0] - high[0]);
            gap_m < BONNET_M
                && (0..2).all(|axis| {
                    high[axis].max(other_high[axis]) - low[axis].min(other_low[axis]) <= size[axis]
                })
        })
    }

    fn bounds(&self, group: &Group) -> [Vector2<f64>; 2] {
        let spots = &self.spots[group.begin..group.end];
        spots.iter().fold(
            [Vector2::repeat(f64::MAX), Vector2::repeat(f64::MIN)],
            |[low, high], spot| [low.inf(&spot.at_m), high.sup(&spot.at_m)],
        )
    }

    /// The cheapest pairing of tracks with groups.
    fn pair(&self, parameters: &TrackParameters) -> Vec<Option<usize>> {
        let (rows, columns) = (self.tracks.len(), self.groups.len());
        let mut cost = vec![f64::MAX; rows * columns];
        for (row, track) in self.tracks.iter().enumerate() {
            let outline = track.rectangle().outline();
            let leap_m =
                FARTHEST_LEAP_M.min(parameters.association_distance_m + 2.0 * track.spread_m());
            for (column, group) in self.groups.iter().enumerate() {
                let is_claimed = group.claimed_by == Some(row);
                let apart_m = outline.distance_m(group.look.middle_m.into());
                if apart_m > leap_m && !is_claimed {
                    continue;
                }
                let spots = &self.spots[group.begin..group.end];
                let bonus = if is_claimed { CLAIM_BONUS } else { 0.0 };
                cost[row * columns + column] = track.cost(spots, &group.look) - bonus;
            }
        }
        // Costs may be below 0 by the bonus; all pairs are shifted alike.
        for cost in &mut cost {
            *cost += CLAIM_BONUS;
        }
        assign(rows, columns, &cost, GATE + CLAIM_BONUS)
    }

    fn update(&mut self, pairs: &[Option<usize>], scene: &Scene<'_>, end: Time) {
        let placement = scene.sweep.sensor.placement();
        let sensor_height_m = scene.ground.plane.height_m();
        for (track, pair) in self.tracks.iter_mut().zip(pairs) {
            match pair.map(|number| &self.groups[number]) {
                Some(group) => {
                    let spots = &self.spots[group.begin..group.end];
                    let floor_z_m = floor_z_m(spots, scene);
                    track.measure(spots, &group.look, end, floor_z_m, &mut self.outline);
                }
                None => {
                    let (place, height_m) = (track.rectangle(), track.height_m());
                    let sight =
                        Sight::at(scene.scan, &placement, sensor_height_m, &place, height_m);
                    track.miss(&sight, end);
                }
            }
        }
    }

    /// New tracks from what no track explains.
    fn begin(
        &mut self,
        pairs: &[Option<usize>],
        scene: &Scene<'_>,
        end: Time,
        parameters: &TrackParameters,
    ) {
        let known: Vec<Outline> = self
            .tracks
            .iter()
            .map(|track| track.rectangle().outline())
            .collect();
        for (number, group) in self.groups.iter().enumerate() {
            if pairs.contains(&Some(number)) || !group.may_be_new {
                continue;
            }
            let is_piece = known
                .iter()
                .any(|place| place.distance_m(group.look.middle_m.into()) < 0.0);
            let spots = &self.spots[group.begin..group.end];
            // Of a vehicle that is far away a single layer may show the bumper.
            let may_be_bumper = spots.len() >= BUMPER_RETURNS
                && group.look.top_below_m > parameters.lowest_object_m;
            let is_low = group.look.top_m < parameters.lowest_object_m && !may_be_bumper;
            if is_piece || is_low {
                continue;
            }
            let floor_z_m = floor_z_m(spots, scene);
            let is_suspect = self.suspects.binary_search(&spots[0].group).is_ok();
            let track = Track::new(
                self.next_id,
                is_suspect,
                spots,
                &group.look,
                end,
                floor_z_m,
                &mut self.outline,
            );
            self.next_id = self.next_id.wrapping_add(1);
            self.tracks.push(track);
        }
    }

    /// Drops what is gone, and the younger of two that stand in one place.
    fn tidy(&mut self, parameters: &TrackParameters) {
        self.tracks.retain(|track| !track.is_gone(parameters));
        let places: Vec<(Rectangle, f64, bool)> = self
            .tracks
            .iter()
            .map(|track| (track.rectangle(), track.odds(), track.is_hidden))
            .collect();
        let mut number = 0;
        self.tracks.retain(|track| {
            let own = number;
            number += 1;
            let centre_m = places[own].0.centre_m;
            let doubled = places.iter().enumerate().any(|(other, (place, odds, _))| {
                let within_m = -0.3 * place.width_m.min(1.6);
                let is_better =
                    (*odds, std::cmp::Reverse(other)) > (track.odds(), std::cmp::Reverse(own));
                other != own && is_better && place.outline().distance_m(centre_m) < within_m
            });
            !doubled
        });
    }

    fn publish(&mut self, end: Time, parameters: &TrackParameters) {
        self.objects.clear();
        let all = self.tracks.iter().map(|track| track.object(end));
        self.objects
            .extend(all.filter(|object| object.existence >= parameters.least_confidence));
        self.objects.sort_by_key(|object| object.id);
    }
}

/// Whether a track's box can hold any of a patch.
fn is_near(forecast: &Forecast, patch: &Patch) -> bool {
    let [x, y] = forecast.rectangle.centre_m;
    let reach_m = forecast.reach_m;
    patch.low_m.x - reach_m <= x
        && x <= patch.high_m.x + reach_m
        && patch.low_m.y - reach_m <= y
        && y <= patch.high_m.y + reach_m
}

/// Whether spots can all belong to the object that is expected.
fn fits(spots: &[Spot], forecast: &Forecast) -> bool {
    let [low, high] = extent(spots, forecast.yaw_rad);
    (0..2).all(|axis| high[axis] - low[axis] <= forecast.most_m[axis])
}

/// Least and greatest coordinates along and across a direction.
fn extent(spots: &[Spot], yaw_rad: f64) -> [[f64; 2]; 2] {
    let (sine, cosine) = libm::sincos(yaw_rad);
    let (mut low, mut high) = ([f64::MAX; 2], [f64::MIN; 2]);
    for spot in spots {
        let along = [
            spot.at_m.x * cosine + spot.at_m.y * sine,
            spot.at_m.y * cosine - spot.at_m.x * sine,
        ];
        for axis in 0..2 {
            low[axis] = low[axis].min(along[axis]);
            high[axis] = high[axis].max(along[axis]);
        }
    }
    [low, high]
}

/// Height of the ground below a group in the local frame.
fn floor_z_m(spots: &[Spot], scene: &Scene<'_>) -> f64 {
    let lowest = spots.iter().min_by(|a, b| a.above_m.total_cmp(&b.above_m));
    let z_m = lowest.map_or(0.0, |spot| {
        f64::from(scene.scan.z_m()[spot.point as usize]) - spot.above_m
    });
    scene.sweep.sensor.position_m[2] + z_m
}
