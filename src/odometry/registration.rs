//! Finds the pose from which the features lie on the surfaces of the map: point to plane (Chen, Medioni
//! 1992) by Gauss-Newton steps, with the prediction as one more measurement.

use nalgebra::{Matrix2, Matrix6, Vector2, Vector3, Vector6};

use super::features::Feature;
use super::map::{Map, View};
use super::motion::{Motion, inverse};
use super::uprights::Off;
use crate::geometry::{self, Rigid};

/// What of a view belongs to what of the map.
#[derive(Debug, Clone, Default)]
pub(super) struct Links {
    surfaces: Vec<SurfaceLink>,
    poles: Vec<UprightLink>,
    foliage: Vec<UprightLink>,
    /// What is upright of the view, linked or not, and for how much that counts.
    upright: f64,
}

/// A feature and the plane that it belongs to.
#[derive(Debug, Clone, Copy)]
struct SurfaceLink {
    /// As the sensor sees it.
    point_m: Vector3<f64>,
    /// Of the plane, in the odometry frame, and how far that is along it from the origin.
    normal: Vector3<f64>,
    along_m: f64,
}

/// A feature and the scatter that it belongs to.
#[derive(Debug, Clone, Copy)]
struct UprightLink {
    point_m: Vector3<f64>,
    /// The middle of the scatter in the odometry frame, and how much it counts in each direction.
    mean_m: Vector2<f64>,
    weight: Matrix2<f64>,
}

impl Links {
    /// Looks up what each feature of a view belongs to from a pose.
    fn find(&mut self, map: &Map, view: &View, pose: &Rigid) {
        self.surfaces.clear();
        self.surfaces
            .extend(view.surfaces.iter().filter_map(|feature| {
                let at_m = pose.place(&feature.point_m);
                let nearest = map
                    .surfaces
                    .nearest(&at_m, &(pose.rotation * feature.normal))?;
                Some(SurfaceLink {
                    point_m: feature.point_m,
                    normal: nearest.normal,
                    along_m: nearest.normal.dot(&at_m) - nearest.off_m,
                })
            }));
        let link = |feature: &Feature, off: Option<Off>, at_m: Vector3<f64>| {
            let off = off?;
            Some(UprightLink {
                point_m: feature.point_m,
                mean_m: at_m.xy() - off.off_m,
                weight: off.weight,
            })
        };
        self.poles.clear();
        self.poles.extend(view.poles.iter().filter_map(|feature| {
            let at_m = pose.place(&feature.point_m);
            link(feature, map.uprights.off_pole(&at_m), at_m)
        }));
        self.foliage.clear();
        self.foliage
            .extend(view.foliage.iter().filter_map(|feature| {
                let at_m = pose.place(&feature.point_m);
                link(feature, map.uprights.off(&at_m), at_m)
            }));
        let upright = view
            .surfaces
            .iter()
            .filter(|feature| is_upright(&feature.normal))
            .count();
        self.upright = (upright + view.poles.len()) as f64 + FOLIAGE * view.foliage.len() as f64;
    }

    /// How well what is upright fits from a pose, as [`Alignment::agreement`].
    fn agreement(&self, pose: &Rigid) -> Option<Agreement> {
        let mut fit = Fit::default();
        for link in self.surfaces.iter().filter(|link| is_upright(&link.normal)) {
            let off_m = link.normal.dot(&pose.place(&link.point_m)) - link.along_m;
            fit.add(1.0, Some((off_m * off_m, ABOUT_M)));
        }
        for (links, counts, about_m) in [
            (&self.poles, 1.0, ABOUT_M),
            (&self.foliage, FOLIAGE, FOLIAGE_ABOUT_M),
        ] {
            for link in links {
                let off_m = pose.place(&link.point_m).xy() - link.mean_m;
                fit.add(counts, Some((off_m.dot(&(link.weight * off_m)), about_m)));
            }
        }
        fit.count = self.upright;
        fit.agreement()
    }
}

/// What was found.
#[derive(Debug, Clone, Copy)]
pub(super) struct Alignment {
    pub(super) pose: Rigid,
    /// What features and prediction together say of the pose.
    pub(super) information: Matrix6<f64>,
    /// Standard deviation of the place that the features alone give, along the ground where they tell least.
    pub(super) deviation_m: f64,
    /// Features that have a surface of the map near them, and that lie on it.
    pub(super) met: usize,
    pub(super) fitting: usize,
    /// Root mean square of how far those lie off.
    pub(super) off_m: f64,
    /// How well what is upright fits; `None` where hardly anything is.
    pub(super) agreement: Option<Agreement>,
}

/// How often at most it is looked up what belongs to what, and the way after which it is not done again.
const MOST_LINKS: usize = 4;
const LAST_LINK_M: f64 = 0.01;
const LAST_LINK_RAD: f64 = 2e-3;
/// Most steps in between, and the step that is small enough to be the last.
const MOST_STEPS: usize = 4;
const LAST_STEP_M: f64 = 5e-3;
const LAST_STEP_RAD: f64 = 4e-4;
/// Standard deviation of how far a feature lies off its surface, for the weight against the prediction. Those of one
/// wall err alike, so that it is greater than what one return shows.
const DEVIATION_M: f64 = 0.1;
/// Distance from which on a feature weighs less (Geman, McClure 1985), at the first and at the last steps.
const WIDEST_M: f64 = 0.5;
const NARROWEST_M: f64 = 0.06;
/// A feature this near to its surface lies on it.
const FITTING_M: f64 = 0.2;

/// Aligns a view with the map, beginning at a pose; `usual_off_m` is how far features lay off lately. What belongs to what is looked up a
/// few times only: between them the surfaces found are taken for planes.
pub(super) fn align(
    map: &Map,
    view: &View,
    predicted: &Motion,
    start: &Rigid,
    usual_off_m: f64,
    links: &mut Links,
) -> Alignment {
    let prior = predicted.information();
    let narrow_m = (3.0 * usual_off_m).clamp(NARROWEST_M, WIDEST_M);
    let mut wide_m = predicted.slack_m().clamp(narrow_m, WIDEST_M);
    let mut pose = *start;
    let mut found = Sums::default().alignment(pose, prior);
    let mut seen = Matrix6::zeros();
    for _ in 0..MOST_LINKS {
        links.find(map, view, &pose);
        let begun = pose;
        for _ in 0..MOST_STEPS {
            let sums = Sums::of(links, &pose, wide_m);
            let scale = 1.0 / (DEVIATION_M * DEVIATION_M);
            seen = sums.information * scale;
            let information = seen + prior;
            let back = prior * pose.step_to(&predicted.pose);
            let Some(covariance) = inverse(&information) else {
                return found;
            };
            let by: Vector6<f64> = covariance * (sums.pull * scale + back);
            pose = pose.moved(&by);
            found = sums.alignment(pose, information);
            if is_less(&by, LAST_STEP_M, LAST_STEP_RAD) {
                break;
            }
            wide_m = (0.5 * wide_m).max(narrow_m);
        }
        wide_m = narrow_m;
        if is_less(&begun.step_to(&pose), LAST_LINK_M, LAST_LINK_RAD) {
            break;
        }
    }
    found.agreement = links.agreement(&pose);
    found.deviation_m = deviation_m(&seen);
    found
}

fn is_less(step: &Vector6<f64>, shift_m: f64, turn_rad: f64) -> bool {
    step.fixed_rows::<3>(0).norm_squared() < shift_m * shift_m
        && step.fixed_rows::<3>(3).norm_squared() < turn_rad * turn_rad
}

/// How well what is upright fits the map from a pose, as [`Alignment::agreement`], if the sensor moved by a
/// step more in so many seconds than it was thought to; of one in `every` features.
pub(super) fn agreement(
    map: &Map,
    view: &View,
    pose: &Rigid,
    step: &Vector6<f64>,
    seconds: f64,
    every: usize,
) -> Option<Agreement> {
    let (shift, turn) = (geometry::linear(step), geometry::angular(step));
    let place = |feature: &Feature| {
        let share = 1.0 + feature.late_s / seconds;
        let arm = pose.rotation * feature.point_m;
        arm + pose.translation_m + (shift + turn.cross(&arm)) * share
    };
    let mut fit = Fit::default();
    for feature in view.surfaces.iter().step_by(every) {
        let normal = pose.rotation * feature.normal;
        if is_upright(&normal) {
            let nearest = map.surfaces.nearest(&place(feature), &normal);
            fit.add(
                1.0,
                nearest.map(|nearest| (nearest.off_m * nearest.off_m, ABOUT_M)),
            );
        }
    }
    for feature in view.poles.iter().step_by(every) {
        let off = map.uprights.off_pole(&place(feature));
        fit.add(1.0, off.map(|off| (off.square_m2(), ABOUT_M)));
    }
    for feature in view.foliage.iter().step_by(every) {
        let off = map.uprights.off(&place(feature));
        fit.add(FOLIAGE, off.map(|off| (off.square_m2(), FOLIAGE_ABOUT_M)));
    }
    fit.agreement()
}

/// How far off counts half at most, and the same of foliage, where the spread of a cell is taken off; a return from foliage
/// tells less, too.
const ABOUT_M: f64 = 0.3;
const FOLIAGE_ABOUT_M: f64 = 0.1;
const FOLIAGE: f64 = 0.3;

fn is_upright(normal: &Vector3<f64>) -> bool {
    const MOST_UPWARD: f64 = 0.7;
    normal.z.abs() < MOST_UPWARD
}

/// How much fits.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Agreement {
    /// Of all features.
    pub(super) sum: f64,
    /// As a share of what could fit.
    pub(super) share: f64,
}

/// How much fits, while it is summed.
#[derive(Debug, Default)]
struct Fit {
    sum: f64,
    count: f64,
}

impl Fit {
    /// Adds one that counts for so much, how far it lies off squared, and how far is about.
    fn add(&mut self, counts: f64, off: Option<(f64, f64)>) {
        self.count += counts;
        if let Some((square_m2, about_m)) = off {
            let share = about_m * about_m / (about_m * about_m + square_m2.max(0.0));
            self.sum += counts * share * share;
        }
    }

    fn agreement(&self) -> Option<Agreement> {
        const FEWEST: f64 = 8.0;
        (self.count >= FEWEST).then(|| Agreement {
            sum: self.sum,
            share: self.sum / self.count,
        })
    }
}

/// Normal equations of one step.
#[derive(Debug, Default)]
struct Sums {
    information: Matrix6<f64>,
    /// Its upper triangle, row by row, while it is summed.
    products: [f64; 21],
    pull: Vector6<f64>,
    met: usize,
    fitting: usize,
    squares_m2: f64,
}

impl Sums {
    fn of(links: &Links, pose: &Rigid, wide_m: f64) -> Self {
        let mut sums = Self {
            met: links.surfaces.len(),
            ..Self::default()
        };
        for link in &links.surfaces {
            let arm = pose.rotation * link.point_m;
            let off_m = link.normal.dot(&(arm + pose.translation_m)) - link.along_m;
            if off_m.abs() < FITTING_M {
                sums.fitting += 1;
                sums.squares_m2 += off_m * off_m;
            }
            sums.add(&link.normal, off_m, &arm, weight(off_m, wide_m));
        }
        for link in links.poles.iter().chain(&links.foliage) {
            let arm = pose.rotation * link.point_m;
            let off_m = (arm + pose.translation_m).xy() - link.mean_m;
            sums.add_upright(link, &off_m, &arm, wide_m);
        }
        let mut place = 0;
        for i in 0..6 {
            for j in i..6 {
                sums.information[(i, j)] = sums.products[place];
                sums.information[(j, i)] = sums.products[place];
                place += 1;
            }
        }
        sums
    }

    /// Takes in that a point with an arm from the sensor should be moved against a normal.
    fn add(&mut self, normal: &Vector3<f64>, off_m: f64, arm: &Vector3<f64>, weight: f64) {
        let turning = arm.cross(normal);
        let row = [
            normal.x, normal.y, normal.z, turning.x, turning.y, turning.z,
        ];
        let mut place = 0;
        for (i, a) in row.iter().enumerate() {
            let weighted = weight * a;
            self.pull[i] -= weighted * off_m;
            for b in &row[i..] {
                self.products[place] += weighted * b;
                place += 1;
            }
        }
    }

    /// The same in the two directions in which something upright is off.
    fn add_upright(
        &mut self,
        link: &UprightLink,
        off_m: &Vector2<f64>,
        arm: &Vector3<f64>,
        wide_m: f64,
    ) {
        let square = off_m.dot(&(link.weight * off_m));
        let trust = weight(libm::sqrt(square.max(0.0)), wide_m);
        // Two rows of the weight's Cholesky root.
        let [a, b, c] = [
            link.weight[(0, 0)],
            link.weight[(0, 1)],
            link.weight[(1, 1)],
        ];
        let rest = c - b * b / a;
        if a <= 0.0 || rest <= 0.0 {
            return;
        }
        let across = b / a;
        let first = Vector3::new(1.0, across, 0.0);
        self.add(&first, off_m.x + across * off_m.y, arm, trust * a);
        self.add(&Vector3::y(), off_m.y, arm, trust * rest);
    }

    fn alignment(&self, pose: Rigid, information: Matrix6<f64>) -> Alignment {
        Alignment {
            pose,
            information,
            deviation_m: 0.0,
            met: self.met,
            fitting: self.fitting,
            off_m: libm::sqrt(self.squares_m2 / self.fitting.max(1) as f64),
            agreement: None,
        }
    }
}

/// The greatest standard deviation along the ground, of a place that is known with some information.
fn deviation_m(information: &Matrix6<f64>) -> f64 {
    /// Of what nothing tells.
    const MOST_M: f64 = 100.0;
    let least = Matrix6::identity() / (MOST_M * MOST_M);
    inverse(&(information + least)).map_or(MOST_M, |covariance| {
        let [xx, xy, yy] = [covariance[(0, 0)], covariance[(0, 1)], covariance[(1, 1)]];
        let half = 0.5 * (xx - yy);
        let greatest = 0.5 * (xx + yy) + libm::sqrt(half * half + xy * xy);
        libm::sqrt(greatest).min(MOST_M)
    })
}

/// The weight of Geman and McClure.
fn weight(off_m: f64, wide_m: f64) -> f64 {
    let share = wide_m * wide_m / (wide_m * wide_m + off_m * off_m);
    share * share
}
