//! The elements of a roundabout and its type (thesis, section 2.2, definitions 2.1 to 2.8).

use super::LaneKind;
use super::polyline::distance_m;
use super::rings::circles_of;
use super::roundabout::{Access, Arm, Roundabout};

/// The thesis' types (section 2.2.2).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Its island can be driven over.
    Mini,
    /// One lane.
    Small,
    /// So wide that cars can drive side by side, without lines between them.
    TwoLane,
    /// Two lanes or more with lines between them.
    Large,
}

impl Kind {
    /// For people.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Mini => "mini",
            Self::Small => "small",
            Self::TwoLane => "two-lane",
            Self::Large => "large",
        }
    }
}

/// Outer diameters of mini roundabouts (thesis, section 2.2.2).
const MINI_M: [f64; 2] = [13.0, 22.0];
/// Least outer diameter of a small one (same place).
const SMALL_M: f64 = 26.0;
/// Least outer diameter of one with two lanes (same place).
const TWO_LANE_M: f64 = 40.0;
/// Least width of a circular path on which cars drive side by side, where the outer diameter
/// suffices for it (FGSV, Merkblatt fuer die Anlage von Kreisverkehren 2006: 8 to 10 m).
const TWO_LANE_PATH_M: f64 = 8.0;
/// Where dividers are measured, from the circle outward: where crossings lie (same source: one
/// or two cars' lengths off the circle).
const DIVIDER_AT_M: f64 = 5.0;

/// What a map says against itself.
#[derive(Debug, Clone, PartialEq)]
pub enum Contradiction {
    /// No type has this outer diameter.
    TooSmall,
    /// Too large for a mini roundabout, too small for a small one.
    BetweenMiniAndSmall,
    /// Two lanes need more.
    TooSmallForTwoLanes,
    /// The circular path leaves no island.
    NoIsland,
    /// The map has no points for a part of the way round.
    Open {
        /// That it has them for.
        covered_share: f64,
    },
    /// The map's points do not lie on a circle.
    NoCircle {
        /// The farthest one.
        off_m: f64,
    },
    /// One can enter and not leave, or leave and not enter.
    OneWay,
}

impl std::fmt::Display for Contradiction {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [mini_low, mini_high] = MINI_M;
        match self {
            Self::TooSmall => write!(f, "an outer diameter below {mini_low} m is no roundabout's"),
            Self::BetweenMiniAndSmall => write!(
                f,
                "an outer diameter between {mini_high} m (mini) and {SMALL_M} m (small)"
            ),
            Self::TooSmallForTwoLanes => {
                write!(f, "two lanes with an outer diameter below {TWO_LANE_M} m")
            }
            Self::NoIsland => write!(f, "the circular path leaves no island"),
            Self::Open { covered_share } => {
                let percent = 100.0 * covered_share;
                write!(f, "the map draws {percent:.0} % of the way round")
            }
            Self::NoCircle { off_m } => write!(f, "points up to {off_m:.1} m off the circle"),
            Self::OneWay => write!(f, "no way in or no way out"),
        }
    }
}

/// What can be measured at a roundabout.
#[derive(Debug, Clone, PartialEq)]
pub struct Elements {
    /// By the limits of the thesis.
    pub kind: Kind,
    /// Between the outer edges of the circular ring (definition 2.4).
    pub outer_diameter_m: f64,
    /// Of the island (definition 2.5).
    pub inner_diameter_m: f64,
    /// Width of the circular ring (definition 2.3).
    pub path_width_m: f64,
    /// Lanes of the circular path.
    pub lanes: usize,
    /// At each arm, in their order.
    pub arms: Vec<ArmElements>,
    /// What is against the limits, or against itself.
    pub contradictions: Vec<Contradiction>,
}

/// What can be measured at an arm.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmElements {
    /// Direction from the middle, counter-clockwise from east.
    pub bearing_rad: f64,
    /// Widths of the entry's lanes together (definition 2.7).
    pub entry_width_m: Option<f64>,
    /// And of the exit's.
    pub exit_width_m: Option<f64>,
    /// Radius of the right edge between entry and circle (definition 2.8), if the map draws it.
    pub entry_radius_m: Option<f64>,
    /// And between circle and exit.
    pub exit_radius_m: Option<f64>,
    /// Width of the island between entry and exit (definition 2.6), if there is one.
    pub divider_m: Option<f64>,
}

/// Less of the way round than this is said.
const WHOLE_SHARE: f64 = 0.95;
/// Points farther from the circle than this are said: the error bound of the simplification.
const ROUND_M: f64 = super::SIMPLIFIED_WITHIN_M;

impl Elements {
    /// Of a roundabout of a map.
    pub fn of(roundabout: &Roundabout) -> Self {
        let outer_m = roundabout.outer_m();
        let inner_m = roundabout.roads().map(|ring| ring.inner_m());
        let inner_m = inner_m.fold(outer_m, f64::min).max(0.0);
        let lanes = roundabout.roads().count();
        let path_width_m = outer_m - inner_m;
        let mut elements = Self {
            kind: kind(2.0 * outer_m, path_width_m, lanes, roundabout),
            outer_diameter_m: 2.0 * outer_m,
            inner_diameter_m: 2.0 * inner_m,
            path_width_m,
            lanes,
            arms: roundabout
                .arms
                .iter()
                .map(|arm| ArmElements::of(arm, roundabout))
                .collect(),
            contradictions: vec![],
        };
        elements.contradictions = elements.contradictions_with(roundabout);
        elements
    }

    fn contradictions_with(&self, roundabout: &Roundabout) -> Vec<Contradiction> {
        let mut found = vec![];
        let diameter_m = self.outer_diameter_m;
        if diameter_m < MINI_M[0] {
            found.push(Contradiction::TooSmall);
        }
        if diameter_m > MINI_M[1] && diameter_m < SMALL_M {
            found.push(Contradiction::BetweenMiniAndSmall);
        }
        let is_wide = matches!(self.kind, Kind::TwoLane | Kind::Large);
        if is_wide && diameter_m < TWO_LANE_M {
            found.push(Contradiction::TooSmallForTwoLanes);
        }
        if self.inner_diameter_m <= 0.0 {
            found.push(Contradiction::NoIsland);
        }
        if roundabout.covered_share < WHOLE_SHARE {
            found.push(Contradiction::Open {
                covered_share: roundabout.covered_share,
            });
        }
        if roundabout.off_circle_m > ROUND_M {
            found.push(Contradiction::NoCircle {
                off_m: roundabout.off_circle_m,
            });
        }
        let is_road = |access: &Access| access.kind == LaneKind::Road;
        let has_entry = roundabout
            .arms
            .iter()
            .any(|arm| arm.entries.iter().any(is_road));
        let has_exit = roundabout
            .arms
            .iter()
            .any(|arm| arm.exits.iter().any(is_road));
        if has_entry != has_exit {
            found.push(Contradiction::OneWay);
        }
        found
    }
}

fn kind(outer_m: f64, path_m: f64, lanes: usize, roundabout: &Roundabout) -> Kind {
    if lanes >= 2 && roundabout.roads().any(|ring| ring.is_marked) {
        Kind::Large
    } else if lanes >= 2 || (outer_m >= TWO_LANE_M && path_m >= TWO_LANE_PATH_M) {
        Kind::TwoLane
    } else if outer_m < (MINI_M[1] + SMALL_M) / 2.0 {
        Kind::Mini
    } else {
        Kind::Small
    }
}

impl ArmElements {
    fn of(arm: &Arm, roundabout: &Roundabout) -> Self {
        let roads = |accesses: &'_ [Access]| -> Vec<Access> {
            let roads = accesses
                .iter()
                .filter(|access| access.kind == LaneKind::Road);
            roads.cloned().collect()
        };
        let (entries, exits) = (roads(&arm.entries), roads(&arm.exits));
        let width_m = |accesses: &[Access]| {
            let sum_m: f64 = accesses.iter().map(|access| access.width_m).sum();
            (sum_m > 0.0).then_some(sum_m)
        };
        Self {
            bearing_rad: arm.bearing_rad,
            entry_width_m: width_m(&entries),
            exit_width_m: width_m(&exits),
            entry_radius_m: corner_radius_m(&entries, roundabout.is_clockwise),
            exit_radius_m: corner_radius_m(&exits, roundabout.is_clockwise),
            divider_m: divider_m(&entries, &exits, roundabout),
        }
    }
}

/// Smallest radius of a bend of the outer edge, away from the way round.
fn corner_radius_m(accesses: &[Access], is_clockwise: bool) -> Option<f64> {
    let outward = if is_clockwise { 1.0 } else { -1.0 };
    accesses
        .iter()
        .flat_map(|access| {
            let edge = access.way.beside(outward * access.width_m / 2.0);
            circles_of(&edge).collect::<Vec<_>>()
        })
        .filter(|(_, sweep_rad)| sweep_rad.signum() == outward)
        .map(|(circle, _)| circle.radius_m)
        .min_by(f64::total_cmp)
}

/// Between the inner edges of entry and exit, a little outside of the circle.
fn divider_m(entries: &[Access], exits: &[Access], roundabout: &Roundabout) -> Option<f64> {
    /// Less is a line.
    const LEAST_M: f64 = 0.5;
    let at_m = roundabout.outer_m() + DIVIDER_AT_M;
    let centre_m = roundabout.centre_m();
    let crosses = |access: &Access| {
        let pairs = access.way.points_m().windows(2);
        let is_across = |pair: &&[[f64; 2]]| {
            let [near_m, far_m] = [pair[0], pair[1]].map(|point_m| distance_m(centre_m, point_m));
            (near_m - at_m) * (far_m - at_m) <= 0.0
        };
        let pair = pairs.into_iter().find(is_across)?;
        let [near_m, far_m] = [pair[0], pair[1]].map(|point_m| distance_m(centre_m, point_m));
        let share = ((at_m - near_m) / (far_m - near_m)).clamp(0.0, 1.0);
        let share = if share.is_finite() { share } else { 0.0 };
        Some([0, 1].map(|axis| pair[0][axis] + share * (pair[1][axis] - pair[0][axis])))
    };
    let mut least_m: Option<f64> = None;
    for entry in entries {
        for exit in exits {
            let (Some(in_m), Some(out_m)) = (crosses(entry), crosses(exit)) else {
                continue;
            };
            let gap_m = distance_m(in_m, out_m) - (entry.width_m + exit.width_m) / 2.0;
            least_m = Some(least_m.map_or(gap_m, |least_m| least_m.min(gap_m)));
        }
    }
    least_m.filter(|&gap_m| gap_m >= LEAST_M)
}
