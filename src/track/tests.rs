use super::look::Look;
use super::spots::Spot;
use super::*;
use crate::ground::{Origin, Plane};

/// All returns of a scan, seen by a sensor at the origin.
pub(super) fn spots_of(scan: &Scan) -> Vec<Spot> {
    let points = (0..scan.len()).filter(|point| scan.range_m()[*point] > 0.0);
    with_scene(scan, |scene| {
        let spots = points.map(|point| {
            let [x, y, _] = scan.point_m(point);
            Spot::new(scene, point as u32, [x, y], 0)
        });
        spots.collect()
    })
}

/// A track of what scans show to a sensor at the origin, a tenth of a second after each other, and the time of the
/// last one.
pub(super) fn followed<'a>(scans: impl IntoIterator<Item = &'a Scan>) -> (Track, Time) {
    let (mut outline, mut known) = (vec![], None::<(Track, Time)>);
    for scan in scans {
        let spots = spots_of(scan);
        let look = Look::at(&spots, scan, Vector2::zeros());
        match &mut known {
            Some((track, end)) => {
                *end = *end + Span::from_seconds(0.1);
                track.measure(&spots, &look, *end, 0.0, &mut outline);
            }
            None => {
                let end = scan.time();
                let track = Track::new(0, false, &spots, &look, end, 0.0, &mut outline);
                known = Some((track, end));
            }
        }
    }
    known.expect("at least one scan")
}

/// What is seen by a sensor that stands still, 1.9 m above level ground.
pub(super) fn with_scene<T>(scan: &Scan, look: impl FnOnce(&Scene<'_>) -> T) -> T {
    let heights_m: Vec<f32> = scan.z_m().iter().map(|z| z + 1.9).collect();
    let ground = GroundReport {
        plane: Plane::level(1.9),
        origin: Origin::Found,
        candidates: 0,
        support: 0,
        points: 0,
    };
    let sweep = Sweep::still(0);
    let mut placements = vec![];
    sweep.placements(scan.columns(), &mut placements);
    look(&Scene {
        scan,
        heights_m: &heights_m,
        ground: &ground,
        sweep: &sweep,
        placements: &placements,
        beams: &Beams::default(),
    })
}
