//! What the rays of the last seconds say of a place: that it was empty, that something was there, or nothing.
//!
//! A return where a ray passed a moment ago is one from something that moved there, whatever it looks like
//! (Yoon et al. 2019; Dynablox, Schmid et al. 2023, of which this is the form for a sensor of few layers: a place is
//! looked up in whole revolutions of the past instead of in voxels, of which its rays would meet one in ten).

mod range_image;

use nalgebra::Vector3;

use crate::cloud::Scan;
use crate::ego::{Placement, Sweep, wrapped_rad};
use crate::geometry::Rectangle;
use crate::time::{Span, Time};
use range_image::RangeImage;

/// What is known of a place in the past.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Seen {
    /// Rays passed on all sides of it.
    Empty,
    /// A ray met something there.
    Occupied,
    /// It was hidden, or between rays, or out of view.
    #[default]
    Unknown,
}

/// Some revolutions of the last seconds.
#[derive(Debug, Clone, Default)]
pub struct Beams {
    /// The oldest first.
    images: Vec<RangeImage>,
    epoch: u32,
    kept_at: Option<Time>,
    /// How far the sensor turned in the last sweep, and whether it turned as far in the one before.
    turned_rad: f64,
    /// Which way it looks at the end of it.
    yaw_rad: f64,
    is_steady: bool,
}

/// How many revolutions are remembered, and one in how long: somebody who walks slowly goes his own depth in the one, and
/// a lorry that turns goes its own length in all.
pub const MOST_IMAGES: usize = 4;
const APART: Span = Span::from_micros(480_000);
/// A sensor whose turn in a sweep differs by more than this from that in the one before was jerked meanwhile, and nobody
/// knows when: what is 40 m away may be placed a metre off.
const STEADY_RAD: f64 = 0.025;

/// In which columns of the images the last place was looked up: the next one lies beside it, mostly.
#[derive(Debug, Clone, Copy, Default)]
pub struct Hints([Option<usize>; MOST_IMAGES]);

impl Beams {
    /// Forgets everything.
    pub fn reset(&mut self) {
        self.images.iter_mut().for_each(RangeImage::forget);
        self.kept_at = None;
    }

    /// Takes in how the sensor moves in the sweep that [`Beams::seen`] is asked about.
    pub fn begin(&mut self, sweep: &Sweep) {
        let turned_rad = wrapped_rad(sweep.sensor.yaw_rad - sweep.pose(0.0).yaw_rad);
        self.is_steady = libm::fabs(turned_rad - self.turned_rad) < STEADY_RAD;
        self.turned_rad = turned_rad;
        self.yaw_rad = sweep.sensor.yaw_rad;
    }

    /// Remembers the revolution of that sweep, if the last one that it did is old enough; to be called after it was
    /// perceived. What `moving` boxes hold, in the sensor frame, is left out.
    pub fn remember(
        &mut self,
        scan: &Scan,
        ground: &[bool],
        moving: &[Rectangle],
        sweep: &Sweep,
        placements: &[Placement],
    ) {
        if self.epoch != sweep.epoch {
            self.reset();
            self.epoch = sweep.epoch;
        }
        let is_fresh = self.kept_at.is_some_and(|kept| scan.time() - kept < APART);
        if is_fresh || !self.is_steady {
            return;
        }
        self.kept_at = Some(scan.time());
        if self.images.len() < MOST_IMAGES {
            self.images.push(RangeImage::default());
        } else {
            self.images.rotate_left(1);
        }
        if let Some(image) = self.images.last_mut() {
            image.take(scan, ground, moving, sweep, placements);
        }
    }

    /// Of the revolutions that are remembered, the oldest first.
    pub fn times(&self) -> impl Iterator<Item = Time> + use<'_> {
        self.images.iter().map(RangeImage::time)
    }

    /// What was seen of a place in the odometry frame, where the sensor now looks at an azimuth, as far back as it is known.
    /// What `is_own` of a revolution, by its number in [`Beams::times`], met there is left out of it: it was what is there
    /// now. Nothing is known of what something else stood in and left again, and in the frame of another epoch.
    pub fn seen(
        &self,
        epoch: u32,
        at_m: &Vector3<f64>,
        azimuth_rad: f64,
        hints: &mut Hints,
        is_own: impl Fn(usize) -> bool,
    ) -> Seen {
        if epoch != self.epoch || !self.is_steady {
            return Seen::Unknown;
        }
        let mut look = |number: usize| {
            let image = &self.images[number];
            let guess = || image.guess(azimuth_rad, self.yaw_rad);
            image.seen(at_m, hints.0[number].get_or_insert_with(guess))
        };
        for number in 0..self.images.len() {
            match look(number) {
                Seen::Empty => return Seen::Empty,
                Seen::Occupied if !is_own(number) => {
                    let is_left = look(self.images.len() - 1) == Seen::Empty;
                    return if is_left {
                        Seen::Unknown
                    } else {
                        Seen::Occupied
                    };
                }
                _ => {}
            }
        }
        Seen::Unknown
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::scan_through_a_pane;
    use crate::cloud::tests::{later, scan_of};
    use crate::cloud::{MAX_LAYERS, Scan};
    use crate::ego::Pose;

    const COLUMNS: usize = 1800;

    /// The columns from azimuth 0 to 40 degrees end at 20 m, all others nowhere.
    fn wall() -> Scan {
        scan_of(COLUMNS, |column, _| if column < 200 { 2000 } else { 0 })
    }

    /// What a scan leaves in the memory of a sensor that stood so.
    fn beams(scan: &Scan, ground: bool, sensor: &Pose) -> Beams {
        let mut beams = Beams::default();
        add(&mut beams, scan, ground, sensor);
        beams
    }

    fn add(beams: &mut Beams, scan: &Scan, ground: bool, sensor: &Pose) {
        let mut sweep = Sweep::still(0);
        sweep.attitude = sensor.rigid();
        let placements = vec![sensor.placement(); COLUMNS];
        beams.begin(&sweep);
        beams.remember(
            scan,
            &vec![ground; COLUMNS * MAX_LAYERS],
            &[],
            &sweep,
            &placements,
        );
    }

    /// A place so far away at an azimuth, in degrees, a little above the sensor's height.
    fn place(range_m: f64, azimuth_deg: f64) -> Vector3<f64> {
        let (sine, cosine) = azimuth_deg.to_radians().sin_cos();
        Vector3::new(range_m * sine, range_m * cosine, 0.01 * range_m)
    }

    fn seen(beams: &Beams, at_m: Vector3<f64>) -> Seen {
        let azimuth_rad = libm::atan2(at_m.x, at_m.y);
        beams.seen(0, &at_m, azimuth_rad, &mut Hints::default(), |_| false)
    }

    #[test]
    fn between_two_returns_of_a_pulse_it_was_empty_and_at_both_occupied() {
        let scan = scan_through_a_pane();
        let mut beams = Beams::default();
        let (sweep, columns) = (Sweep::still(0), scan.columns());
        let placements = vec![Pose::SENSOR.placement(); columns];
        beams.begin(&sweep);
        beams.remember(&scan, &vec![false; scan.len()], &[], &sweep, &placements);
        let at = |range_m: f64| seen(&beams, place(range_m, 15.0));
        assert_eq!([2.0, 7.0].map(at), [Seen::Empty; 2]);
        assert_eq!([4.0, 10.0].map(at), [Seen::Occupied; 2]);
        assert_eq!(seen(&beams, place(11.0, 15.0)), Seen::Unknown);
    }

    #[test]
    fn before_a_wall_it_was_empty_in_it_occupied_and_behind_and_beside_it_unknown() {
        let beams = beams(&wall(), false, &Pose::SENSOR);
        for range_m in [2.0, 10.0, 19.0] {
            assert_eq!(seen(&beams, place(range_m, 20.0)), Seen::Empty);
        }
        for range_m in [19.7, 20.0, 20.3] {
            assert_eq!(seen(&beams, place(range_m, 20.0)), Seen::Occupied);
        }
        assert_eq!(seen(&beams, place(21.0, 20.0)), Seen::Unknown);
        // Nothing came back from there, which may be for want of anything as well as of light.
        assert_eq!(seen(&beams, place(10.0, 60.0)), Seen::Unknown);
        let too_high = Vector3::new(0.0, 10.0, 5.0);
        assert_eq!(seen(&beams, too_high), Seen::Unknown);
    }

    #[test]
    fn a_ray_that_ends_on_the_ground_met_nothing() {
        let beams = beams(&wall(), true, &Pose::SENSOR);
        assert_eq!(seen(&beams, place(10.0, 20.0)), Seen::Empty);
        assert_eq!(seen(&beams, place(20.0, 20.0)), Seen::Unknown);
    }

    #[test]
    fn a_ray_that_something_near_stopped_says_nothing_of_what_lies_behind() {
        let post = scan_of(COLUMNS, |column, layer| match (column, layer) {
            (100, 8) => 500,
            (0..200, _) => 2000,
            _ => 0,
        });
        let beams = beams(&post, false, &Pose::SENSOR);
        assert_eq!(seen(&beams, place(10.0, 20.0)), Seen::Unknown);
        assert_eq!(seen(&beams, place(10.0, 25.0)), Seen::Empty);
    }

    #[test]
    fn places_are_of_the_frame_not_of_the_sensor() {
        let pose = Pose {
            position_m: [30.0, -4.0, 0.0],
            yaw_rad: Pose::SENSOR.yaw_rad - 0.5,
        };
        let beams = beams(&wall(), false, &pose);
        let placed = |range_m: f64| {
            let at_m = place(range_m, 20.0);
            let [x, y] = pose.placement().local_m([at_m.x, at_m.y]);
            Vector3::new(x, y, at_m.z)
        };
        assert_eq!(seen(&beams, placed(10.0)), Seen::Empty);
        assert_eq!(seen(&beams, placed(20.0)), Seen::Occupied);
    }

    #[test]
    fn what_is_there_now_is_left_out_of_what_was_seen() {
        let beams = beams(&wall(), false, &Pose::SENSOR);
        let at_m = place(20.0, 20.0);
        assert_eq!(
            beams.seen(0, &at_m, 0.3, &mut Hints::default(), |image| image == 0),
            Seen::Unknown
        );
        assert_eq!(
            beams.seen(0, &at_m, 0.3, &mut Hints::default(), |image| image == 1),
            Seen::Occupied
        );
    }

    #[test]
    fn what_moved_is_neither_met_nor_passed() {
        let car = Rectangle {
            centre_m: [0.0, 10.0],
            yaw_rad: 0.0,
            length_m: 4.0,
            width_m: 1.6,
        };
        let scan = scan_of(COLUMNS, |column, _| match column {
            0..30 => 1000,
            30..200 => 2000,
            _ => 0,
        });
        let ground = vec![false; COLUMNS * MAX_LAYERS];
        let (sweep, placements) = (Sweep::still(0), vec![Pose::SENSOR.placement(); COLUMNS]);
        let remembered = |moving: &[Rectangle]| {
            let mut beams = Beams::default();
            beams.begin(&sweep);
            beams.remember(&scan, &ground, moving, &sweep, &placements);
            beams
        };
        let at_m = place(10.0, 3.0);
        assert_eq!(seen(&remembered(&[]), at_m), Seen::Occupied);
        let beams = remembered(&[car]);
        assert_eq!(seen(&beams, at_m), Seen::Unknown);
        assert_eq!(seen(&beams, place(5.0, 3.0)), Seen::Unknown);
        assert_eq!(seen(&beams, place(20.0, 20.0)), Seen::Occupied);
    }

    #[test]
    fn nothing_is_asked_of_a_sweep_in_which_the_sensor_was_jerked() {
        let mut beams = beams(&wall(), false, &Pose::SENSOR);
        let mut sweep = Sweep::still(0);
        sweep.sensor.yaw_rad += 0.05;
        beams.begin(&sweep);
        assert_eq!(seen(&beams, place(10.0, 20.0)), Seen::Unknown);
        beams.begin(&sweep);
        assert_eq!(seen(&beams, place(10.0, 20.0)), Seen::Empty);
    }

    #[test]
    fn nothing_is_known_of_what_something_stood_in_and_left_nor_in_another_frame() {
        let nearer = scan_of(COLUMNS, |column, _| if column < 200 { 1000 } else { 0 });
        let mut beams = beams(&nearer, false, &Pose::SENSOR);
        add(&mut beams, &later(&wall(), 0.5), false, &Pose::SENSOR);
        assert_eq!(seen(&beams, place(10.0, 20.0)), Seen::Unknown);
        assert_eq!(seen(&beams, place(5.0, 20.0)), Seen::Empty);
        assert_eq!(
            beams.seen(1, &place(5.0, 20.0), 0.3, &mut Hints::default(), |_| false),
            Seen::Unknown
        );
    }

    #[test]
    fn the_last_seconds_are_remembered_and_no_more() {
        let sweep = Sweep::still(0);
        let mut placements = vec![];
        sweep.placements(COLUMNS, &mut placements);
        let ground = vec![false; COLUMNS * MAX_LAYERS];
        let mut beams = Beams::default();
        let scan = wall();
        for step in 0..40 {
            let scan = later(&scan, 0.1 * f64::from(step));
            beams.begin(&sweep);
            beams.remember(&scan, &ground, &[], &sweep, &placements);
        }
        let times: Vec<f64> = beams
            .times()
            .map(|time| (time - scan.time()).seconds())
            .collect();
        assert_eq!(times.len(), MOST_IMAGES);
        assert!(
            times
                .windows(2)
                .all(|two| (0.45..0.55).contains(&(two[1] - two[0])))
        );
        assert!(times[3] > 3.4);
        let other = Sweep::still(1);
        let nearer = scan_of(COLUMNS, |column, _| if column < 200 { 1000 } else { 0 });
        beams.remember(&later(&nearer, 4.0), &ground, &[], &other, &placements);
        assert_eq!(
            beams.seen(1, &place(20.0, 20.0), 0.3, &mut Hints::default(), |_| false),
            Seen::Unknown
        );
        assert_eq!(
            beams.seen(1, &place(10.0, 20.0), 0.3, &mut Hints::default(), |_| false),
            Seen::Occupied
        );
    }
}
