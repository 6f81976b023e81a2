//! In which columns of which layers the neighbours of a point can stand.

use std::ops::Range;

use super::{ClusterParameters, WindowSetting};
use crate::cloud::{MAX_LAYERS, Scan};
use crate::float::greatest;

/// Finds windows that hold every neighbour of a point, from the geometry of the rays alone.
#[derive(Debug, Clone)]
pub(super) struct Windows {
    setting: WindowSetting,
    fixed_columns: usize,
    columns: usize,
    /// Columns that a chord of the length 1, in radii, may span.
    columns_per_chord: f32,
    /// Columns by which the end of the sweep overlaps its beginning.
    overlap: usize,
    /// Of each pair of layers.
    pairs: [[Pair; MAX_LAYERS]; MAX_LAYERS],
}

/// The square of the chord that the azimuth difference of two rays spans is `most` less `slope`
/// times the cosine of the angle between them.
#[derive(Debug, Clone, Copy, Default)]
struct Pair {
    most: f32,
    slope: f32,
}

/// The rays on which neighbours of a point can be.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cone {
    /// Of the angle to the point's own ray.
    least_cosine: f32,
}

impl Cone {
    /// Around the ray of a point at `range_m`, of which neighbours are within `eps_m`.
    ///
    /// A return on a ray is at least r sin(g) away, g being the angle between the rays, so
    /// only rays with cos(g) >= sqrt(1 - (eps / r)^2) count.
    #[inline]
    pub(super) fn around(range_m: f32, eps_m: f32) -> Self {
        let ratio = eps_m / range_m;
        Self {
            least_cosine: if ratio < 1.0 {
                (1.0 - ratio * ratio).sqrt()
            } else {
                -1.0
            },
        }
    }
}

/// A chord of this length, in radii, spans an arc of pi / 3; shorter ones are closer to theirs.
const LONGEST_CHORD: f32 = 1.0;
const ARC_PER_CHORD: f64 = std::f64::consts::FRAC_PI_3;
/// Rounding must not lose a neighbour that is exactly eps away.
const SLACK: f64 = 1e-6;

impl Windows {
    pub(super) fn new(parameters: &ClusterParameters) -> Self {
        Self {
            setting: parameters.window,
            fixed_columns: parameters.window_columns,
            columns: 0,
            columns_per_chord: 0.0,
            overlap: 0,
            pairs: Default::default(),
        }
    }

    /// Takes over the geometry of a revolution.
    pub(super) fn prepare(&mut self, scan: &Scan) {
        self.columns = scan.columns();
        self.columns_per_chord = (ARC_PER_CHORD / libm::fabs(scan.step_rad())) as f32;
        let turn_rad = scan.columns() as f64 * libm::fabs(scan.step_rad());
        let over_rad = (turn_rad - std::f64::consts::TAU).max(0.0);
        self.overlap = libm::ceil(over_rad / libm::fabs(scan.step_rad()).max(1e-9)) as usize;
        let mut rays = [(0.0, 1.0); MAX_LAYERS];
        for (ray, elevation_deg) in rays.iter_mut().zip(scan.sensor().elevation_deg) {
            *ray = libm::sincos(elevation_deg.to_radians());
        }
        for (pairs, (sine, cosine)) in self.pairs.iter_mut().zip(rays) {
            for (pair, (other_sine, other_cosine)) in pairs.iter_mut().zip(rays) {
                let flat = cosine * other_cosine;
                *pair = Pair {
                    most: (2.0 + 2.0 * sine * other_sine / flat + SLACK) as f32,
                    slope: (2.0 / flat) as f32,
                };
            }
        }
    }

    /// The layers that can hold neighbours of a point in a layer, and how many columns to either
    /// side of it.
    pub(super) fn extent(&self, layer: usize, cone: Cone) -> (Range<usize>, usize) {
        if self.setting == WindowSetting::Columns {
            return (0..MAX_LAYERS, self.fixed_columns());
        }
        let mut widest = 0.0;
        let mut is_seen = |other: usize| {
            let chord_squared = self.chord_squared(layer, other, cone);
            widest = greatest(widest, chord_squared);
            chord_squared >= 0.0
        };
        let mut layers = layer..layer;
        while layers.end < MAX_LAYERS && is_seen(layers.end) {
            layers.end += 1;
        }
        while layers.start > 0 && is_seen(layers.start - 1) {
            layers.start -= 1;
        }
        (layers, self.columns_on(widest))
    }

    /// How many columns to either side are looked at whatever the cone, if that is set.
    fn fixed_columns(&self) -> usize {
        self.fixed_columns.min(self.columns / 2)
    }

    /// Square of the longest chord that azimuths of two layers may span within a cone; negative if
    /// the layers are too far from each other.
    ///
    /// cos(g) = sin v sin w + cos v cos w cos(d) for elevations v, w and an azimuth difference
    /// d, which spans a chord of the square 2 (1 - cos d).
    #[inline(always)]
    fn chord_squared(&self, layer: usize, other: usize, cone: Cone) -> f32 {
        let Pair { most, slope } = self.pairs[layer][other];
        most - slope * cone.least_cosine
    }

    /// How many columns a chord spans at most.
    fn columns_on(&self, chord_squared: f32) -> usize {
        if chord_squared > LONGEST_CHORD * LONGEST_CHORD {
            return self.columns / 2;
        }
        let reach = (chord_squared.sqrt() * self.columns_per_chord) as usize + 1 + self.overlap;
        reach.min(self.columns / 2)
    }

    /// How many columns off neighbours are at most, if that is set: otherwise eps says it.
    pub(super) fn most_columns(&self) -> Option<usize> {
        match self.setting {
            WindowSetting::Exact => None,
            WindowSetting::Columns => Some(self.fixed_columns),
        }
    }

    /// Whether two columns are not too far from each other for neighbours.
    pub(super) fn are_in_reach(&self, a: usize, b: usize) -> bool {
        let apart = a.abs_diff(b);
        let apart = apart.min(self.columns - apart);
        self.most_columns().is_none_or(|most| apart <= most)
    }

    /// The columns up to `reach` before and behind a column, over the seam at 0: at most two
    /// stretches, the second one often empty.
    pub(super) fn stretches(&self, column: usize, reach: usize) -> [Range<usize>; 2] {
        let columns = self.columns;
        if 2 * reach + 1 >= columns {
            return [0..columns, 0..0];
        }
        let (low, high) = (column + columns - reach, column + columns + reach + 1);
        if low >= columns && high > 2 * columns {
            [low - columns..columns, 0..high - 2 * columns]
        } else if low < columns {
            [low..columns, 0..high - columns]
        } else {
            [low - columns..high - columns, 0..0]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::tests::scan_of;
    use crate::parameter::Profile;

    fn windows(columns: usize, profile: Profile) -> Windows {
        let mut windows = Windows::new(&ClusterParameters::profile(profile));
        windows.prepare(&scan_of(columns, |_, _| 0));
        windows
    }

    #[test]
    fn the_seam_is_no_edge() {
        let windows = windows(100, Profile::Default);
        assert_eq!(windows.stretches(50, 3), [47..54, 0..0]);
        assert_eq!(windows.stretches(1, 3), [98..100, 0..5]);
        assert_eq!(windows.stretches(98, 3), [95..100, 0..2]);
        assert_eq!(windows.stretches(99, 0), [99..100, 0..0]);
        assert_eq!(windows.stretches(5, 50), [0..100, 0..0]);
    }

    #[test]
    fn the_extent_shrinks_with_range() {
        let windows = windows(1800, Profile::Default);
        let extent = |range_m| windows.extent(8, Cone::around(range_m, 0.5));
        let (layers, reach) = extent(10.0);
        // Layers are 2 degrees apart, and 0.5 m are 2.9 degrees.
        assert_eq!(layers, 7..10);
        assert!((15..=18).contains(&reach), "{reach}");
        let (layers, reach) = extent(40.0);
        assert_eq!(layers, 8..9);
        assert!(reach <= 6, "{reach}");
        assert_eq!(extent(0.4), (0..16, 900));
    }

    #[test]
    fn the_thesis_looks_at_eighty_candidates() {
        let windows = windows(1800, Profile::Thesis);
        let extent = windows.extent(3, Cone::around(20.0, 1.8));
        assert_eq!(extent, (0..16, 2));
        assert_eq!(windows.stretches(100, 2)[0].len() * 16, 80);
    }
}
