//! Which returns of a patch lie in the places of known tracks.

use multiversion::multiversion;

use super::forecast::Forecasts;
use super::placing::Placed;
use crate::float::least;
use crate::geometry::Outline;

/// For every return of a patch the track that has it. Its buffers are made once.
#[derive(Debug, Clone, Default)]
pub(super) struct Claims {
    /// Where the returns are.
    x_m: Vec<f32>,
    y_m: Vec<f32>,
    /// Distance from the edge of that track's box, negative within.
    distances_m: Vec<f32>,
    /// The number of the track, or [`NOBODY`].
    owners: Vec<u32>,
    /// Those before the last track.
    former: Vec<u32>,
}

const NOBODY: u32 = u32::MAX;
/// In structure only what is well within the box of a track may be its own.
const STRUCTURE_MARGIN_M: f32 = 0.15;

impl Claims {
    /// Gives every return of a patch to the nearest of the tracks `near` it that can have a return
    /// there; of equally near ones to the first. Less is theirs in structure than in what
    /// `is_whole`, a road user from end to end; and what is new has little of what `is_old`.
    pub(super) fn settle(
        &mut self,
        placed: &[Placed],
        near: &[usize],
        forecasts: &Forecasts,
        is_whole: bool,
        is_old: bool,
    ) {
        self.owners.clear();
        self.owners.resize(placed.len(), NOBODY);
        if near.is_empty() {
            return;
        }
        self.former.resize(placed.len(), NOBODY);
        self.distances_m.clear();
        self.distances_m.resize(placed.len(), f32::INFINITY);
        for (axis, metres) in [&mut self.x_m, &mut self.y_m].into_iter().enumerate() {
            metres.clear();
            metres.extend(placed.iter().map(|placed| placed.at_m[axis]));
        }
        for track in near {
            let forecast = forecasts.of(*track);
            let margin_m = if is_whole && !(is_old && forecast.is_new) {
                forecast.margin_m
            } else {
                STRUCTURE_MARGIN_M
            };
            std::mem::swap(&mut self.owners, &mut self.former);
            claim(
                (&self.x_m, &self.y_m),
                (&forecast.outline, forecast.middle_m, margin_m),
                *track as u32,
                &mut self.distances_m,
                (&self.former, &mut self.owners),
            );
        }
    }

    /// The owner of every return, in their order.
    pub(super) fn owners(&self) -> impl Iterator<Item = Option<usize>> + use<'_> {
        let owners = self.owners.iter();
        owners.map(|owner| (*owner != NOBODY).then_some(*owner as usize))
    }

    /// The first of the tracks that have any of the returns.
    pub(super) fn first(&self) -> Option<usize> {
        self.owners().flatten().min()
    }

    /// The share of the returns that a track has.
    pub(super) fn share(&self, track: usize) -> f64 {
        let own = self.owners().filter(|owner| *owner == Some(track));
        own.count() as f64 / self.owners.len() as f64
    }

    /// The only track that has any of the returns, and the share of them that it has.
    pub(super) fn only(&self) -> Option<(usize, f64)> {
        let mut owners = self.owners().flatten();
        let first = owners.next()?;
        let mut count = 1;
        for other in owners {
            if other != first {
                return None;
            }
            count += 1;
        }
        Some((first, f64::from(count) / self.owners.len() as f64))
    }
}

/// Gives a track the returns that lie nearer to its box than to any before.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn claim(
    (x_m, y_m): (&[f32], &[f32]),
    (outline, [middle_x_m, middle_y_m], margin_m): (&Outline, [f32; 2], f32),
    track: u32,
    distances_m: &mut [f32],
    (former, owners): (&[u32], &mut [u32]),
) {
    let outline = *outline;
    let count = distances_m.len();
    let (x_m, y_m) = (&x_m[..count], &y_m[..count]);
    // Owners that are written where they are read would be stored under a mask, slowly.
    let (former, owners) = (&former[..count], &mut owners[..count]);
    for place in 0..count {
        let at_m = [x_m[place] - middle_x_m, y_m[place] - middle_y_m];
        let distance_m = outline.off_edge_m(at_m);
        let is_within = distance_m <= margin_m;
        let own_m = if is_within { distance_m } else { f32::INFINITY };
        let before_m = distances_m[place];
        owners[place] = if own_m < before_m {
            track
        } else {
            former[place]
        };
        distances_m[place] = least(own_m, before_m);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Rectangle;
    use crate::track::forecast::Forecast;

    fn at(x: f32) -> Placed {
        Placed {
            at_m: [x, 0.0],
            ..Placed::default()
        }
    }

    /// Two boxes of 2 m by 2 m, 4 m apart from middle to middle.
    fn forecasts() -> Forecasts {
        let boxes = [0.0, 4.0].map(|x| {
            let place = Rectangle {
                centre_m: [100.0 + x, 50.0],
                yaw_rad: 0.0,
                length_m: 2.0,
                width_m: 2.0,
            };
            Forecast {
                outline: place.outline(),
                middle_m: [x as f32, 0.0],
                margin_m: 1.2,
                is_new: false,
                from_m: Default::default(),
                rests: false,
            }
        });
        Forecasts::from(boxes.to_vec())
    }

    fn owners(placed: &[Placed], is_whole: bool) -> (Vec<Option<usize>>, Option<(usize, f64)>) {
        let mut claims = Claims::default();
        claims.settle(placed, &[0, 1], &forecasts(), is_whole, false);
        (claims.owners().collect(), claims.only())
    }

    #[test]
    fn the_nearest_track_has_a_return_and_the_first_of_two_as_near() {
        let placed = [0.0, 1.9, 2.0, 2.1, 4.0, 6.1, 6.3].map(at);
        let expected = [Some(0), Some(0), Some(0), Some(1), Some(1), Some(1), None];
        assert_eq!(owners(&placed, true), (expected.to_vec(), None));
        let in_structure = [Some(0), None, None, None, Some(1), None, None];
        assert_eq!(owners(&placed, false), (in_structure.to_vec(), None));
    }

    #[test]
    fn nothing_is_left_of_what_was_settled_before() {
        let mut claims = Claims::default();
        claims.settle(&[0.0, 4.0, 4.5].map(at), &[0, 1], &forecasts(), true, false);
        for near in [&[0, 1][..], &[0], &[]] {
            claims.settle(&[-50.0, -60.0].map(at), near, &forecasts(), true, false);
            assert_eq!(claims.owners().collect::<Vec<_>>(), [None; 2]);
            assert_eq!(claims.only(), None);
        }
    }

    #[test]
    fn the_only_owner_is_known_with_its_share_and_what_each_of_several_has() {
        assert_eq!(
            owners(&[-5.0, 0.0, 0.5, 1.0].map(at), true).1,
            Some((0, 0.75))
        );
        let mut claims = Claims::default();
        let placed = [0.0, 0.5, 4.0, 8.0].map(at);
        claims.settle(&placed, &[0, 1], &forecasts(), true, false);
        assert_eq!([0, 1, 2].map(|track| claims.share(track)), [0.5, 0.25, 0.0]);
        assert_eq!(owners(&[-5.0].map(at), true).1, None);
    }
}
