//! What may be one object: returns in the place of a known one, and clusters that none explains.

use nalgebra::Vector2;

use super::look::Look;
use super::rectangle::Extent;
use super::road_user::Track;
use super::spots::{Patch, Placer, Spot};
use super::{Outline, Rectangle, Scene, TrackParameters};
use crate::cloud::{MAX_LAYERS, Scan};
use crate::cluster::Clusters;

/// The groups of a revolution.
#[derive(Debug, Clone, Default)]
pub(super) struct Grouping {
    placer: Placer,
    spots: Vec<Spot>,
    /// Where the spots of each group begin, and the spots, while they are sorted.
    begins: Vec<usize>,
    sorted: Vec<Spot>,
    patches: Vec<Patch>,
    groups: Vec<Group>,
    /// Where the tracks are expected, and which of them may be in a patch.
    forecasts: Vec<Forecast>,
    near: Vec<usize>,
    /// The bounds of each group, and the one that it joins.
    boxes: Vec<[Vector2<f64>; 2]>,
    target: Vec<usize>,
    /// Group numbers of what was cut off structure, ascending.
    suspects: Vec<u32>,
}

/// Returns that may be one object: a stretch of the spots.
#[derive(Debug, Clone, Copy)]
pub(super) struct Group {
    begin: usize,
    end: usize,
    pub(super) look: Look,
    /// The track in whose place they were found; a new object may come of none.
    pub(super) claimed_by: Option<usize>,
}

/// Where a track is expected.
#[derive(Debug, Clone)]
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
impl Grouping {
    /// Forms the groups anew, given tracks that were carried on to this revolution.
    pub(super) fn form(
        &mut self,
        tracks: &[Track],
        clusters: &Clusters,
        scene: &Scene<'_>,
        parameters: &TrackParameters,
    ) {
        self.placer.place(
            clusters,
            scene,
            parameters,
            &mut self.spots,
            &mut self.patches,
        );
        self.divide(tracks, parameters, scene.scan);
        self.add_strays(tracks, clusters, scene);
        self.gather(tracks, scene);
        self.join_pieces(tracks, scene);
    }

    pub(super) fn groups(&self) -> &[Group] {
        &self.groups
    }

    /// The returns of a group.
    pub(super) fn spots(&self, group: &Group) -> &[Spot] {
        &self.spots[group.begin..group.end]
    }

    /// Whether a group was cut off structure.
    pub(super) fn is_suspect(&self, group: &Group) -> bool {
        let number = self.spots[group.begin].group;
        self.suspects.binary_search(&number).is_ok()
    }

    fn forecast(&mut self, tracks: &[Track]) {
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
        self.forecasts.clear();
        self.forecasts.extend(tracks.iter().map(forecast));
    }

    /// Gives every spot a group: the track in whose place it lies, or its own cluster.
    fn divide(&mut self, tracks: &[Track], parameters: &TrackParameters, scan: &Scan) {
        self.forecast(tracks);
        let (forecasts, near) = (&self.forecasts, &mut self.near);
        let count = tracks.len();
        self.suspects.clear();
        for (number, patch) in self.patches.iter().enumerate() {
            if patch.is_suspect {
                self.suspects.push((count + number) as u32);
            }
            let own = (count + number) as u32;
            let spots = &mut self.spots[patch.begin..patch.end];
            let is_whole = patch.can_be_road_user(parameters);
            near.clear();
            near.extend((0..count).filter(|track| is_near(&forecasts[*track], patch)));
            let unclaimed = if is_whole { own } else { NOBODY };
            let mut claims = 0u32;
            let mut only = None;
            let mut several = false;
            for spot in spots.iter_mut() {
                spot.group = unclaimed;
                let nearest = near
                    .iter()
                    .filter_map(|track| {
                        let forecast = &forecasts[*track];
                        // In structure only what is well within may be its own.
                        let margin_m = if is_whole { forecast.margin_m } else { 0.15 };
                        let at_m = spot.at_m.into();
                        let distance_m = forecast.outline.distance_within_m(at_m, margin_m)?;
                        Some((distance_m, *track))
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
        self.align_seam(tracks, scan);
    }

    /// Adds returns of no cluster to the known objects in whose places they lie: far away too few
    /// meet a cyclist to be a cluster.
    fn add_strays(&mut self, tracks: &[Track], clusters: &Clusters, scene: &Scene<'_>) {
        let Scene { scan, sweep, .. } = *scene;
        let placement = sweep.sensor.placement();
        for (number, track) in tracks.iter().enumerate() {
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
                    let at_m = scene.placements[column].local_m([x, y]);
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
    fn align_seam(&mut self, tracks: &[Track], scan: &Scan) {
        let duration_s = scan.duration_s();
        for patch in self.patches.iter().filter(|patch| patch.over_seam) {
            for spot in &mut self.spots[patch.begin..patch.end] {
                let is_old = spot.age_s > 0.5 * duration_s;
                if let (Some(track), true) = (tracks.get(spot.group as usize), is_old) {
                    spot.at_m += track.velocity_mps() * duration_s;
                    spot.age_s -= duration_s;
                }
            }
        }
    }

    /// Puts the spots of every group side by side and looks at it.
    fn gather(&mut self, tracks: &[Track], scene: &Scene<'_>) {
        let sensor_m = Vector2::from(scene.sweep.sensor.placement().origin_m());
        self.sort_spots(tracks.len() + self.patches.len());
        self.groups.clear();
        let mut begin = 0;
        for spots in self.spots.chunk_by(|a, b| a.group == b.group) {
            let end = begin + spots.len();
            let number = spots[0].group as usize;
            let claimed_by = (number < tracks.len()).then_some(number);
            if spots.len() >= FEWEST_RETURNS || claimed_by.is_some() {
                self.groups.push(Group {
                    begin,
                    end,
                    look: Look::at(spots, scene.scan, sensor_m),
                    claimed_by,
                });
            }
            begin = end;
        }
    }

    /// Sorts spots by their groups, which are numbered below a bound, and drops those of nobody.
    fn sort_spots(&mut self, bound: usize) {
        self.begins.clear();
        self.begins.resize(bound + 1, 0);
        let owned = || self.spots.iter().filter(|spot| spot.group != NOBODY);
        for spot in owned() {
            self.begins[spot.group as usize + 1] += 1;
        }
        for group in 1..=bound {
            self.begins[group] += self.begins[group - 1];
        }
        let total = self.begins[bound];
        self.sorted.clear();
        if let Some(any) = self.spots.first() {
            self.sorted.resize(total, *any);
        }
        for spot in owned() {
            let at = &mut self.begins[spot.group as usize];
            self.sorted[*at] = *spot;
            *at += 1;
        }
        std::mem::swap(&mut self.spots, &mut self.sorted);
    }

    /// Joins free groups that stand close together and can be one vehicle.
    fn join_pieces(&mut self, tracks: &[Track], scene: &Scene<'_>) {
        let (mut boxes, mut target) = (
            std::mem::take(&mut self.boxes),
            std::mem::take(&mut self.target),
        );
        boxes.clear();
        boxes.extend(self.groups.iter().map(|group| self.bounds(group)));
        target.clear();
        target.extend(0..self.groups.len());
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
                && let Some(owner) = self.missing_part(tracks, free)
            {
                (*target, joined) = (owner, true);
            }
        }
        for (number, group) in self.groups.iter().enumerate() {
            if target[number] != number {
                let to = self.spots[self.groups[target[number]].begin].group;
                for spot in &mut self.spots[group.begin..group.end] {
                    spot.group = to;
                }
            }
        }
        (self.boxes, self.target) = (boxes, target);
        if joined {
            self.gather(tracks, scene);
        }
    }

    /// The group of a vehicle whose bumper or rear a free group can be: a bonnet that rises
    /// towards the screen leaves a gap between two layers.
    fn missing_part(&self, tracks: &[Track], free: usize) -> Option<usize> {
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
            let Some(track) = other.claimed_by.map(|number| &tracks[number]) else {
                return false;
            };
            let apart_m = (other.look.middle_m - group.look.middle_m).norm();
            if !track.is_moving_vehicle() || apart_m > track.rectangle().length_m {
                return false;
            }
            let axes = |group: &Group| {
                let spots = self.spots(group);
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
        self.spots(group).iter().fold(
            [Vector2::repeat(f64::MAX), Vector2::repeat(f64::MIN)],
            |[low, high], spot| [low.inf(&spot.at_m), high.sup(&spot.at_m)],
        )
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

/// Least and greatest coordinates of spots along and across a direction.
fn extent(spots: &[Spot], yaw_rad: f64) -> [[f64; 2]; 2] {
    let (sine, cosine) = libm::sincos(yaw_rad);
    let extent = Extent::of(spots.iter().map(|spot| spot.at_m.into()), sine, cosine);
    [extent.low, extent.high]
}
