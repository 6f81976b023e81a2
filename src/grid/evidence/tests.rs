use super::*;
use crate::cloud::scan_through_a_pane;
use crate::cloud::tests::scan_of;
use crate::parameter::Profile;

#[test]
fn columns_beside_the_seam_are_on_either_side_of_it() {
    let around = |is_round| [0, 1, 2, 11, 12, 13].map(|number| neighbour(number, 10, is_round));
    assert_eq!(around(true), [8, 9, 0, 9, 0, 1].map(Some));
    assert_eq!(around(false), [None, None, Some(0), Some(9), None, None]);
    assert_eq!([0, 2].map(|number| neighbour(number, 0, true)), [None; 2]);
}

#[test]
fn what_a_pulse_with_two_returns_passed_behind_the_first_is_free() {
    let scan = scan_through_a_pane();
    let plane = Plane::level(1.9);
    let heights_m: Vec<f32> = scan.z_m().iter().map(|z| z + 1.9).collect();
    let (mut evidence, mut passed) = (Evidence::default(), vec![]);
    gather(
        &mut evidence,
        0..scan.columns(),
        &scan,
        &plane,
        &vec![false; scan.len()],
        &heights_m,
        &GridParameters::profile(Profile::Default),
    );
    let nearest_m = |degrees: f64| {
        let column = scan.column_at(degrees.to_radians());
        evidence.nearest_m[BESIDE + column].round()
    };
    assert_eq!((nearest_m(15.0), nearest_m(30.0)), (4.0, 10.0));
    stretches(
        &mut evidence,
        &GridParameters::profile(Profile::Default),
        &mut passed,
    );
    let column = scan.column_at(15f64.to_radians());
    let behind = passed
        .iter()
        .filter(|stretch| stretch.column == column && stretch.to_m > 4.5)
        .map(|stretch| (stretch.to_m - stretch.from_m).round());
    assert_eq!(behind.collect::<Vec<_>>(), [5.0]);
}

#[test]
fn a_part_of_the_columns_is_seen_as_in_the_whole() {
    // A wall 10 m away behind posts, of which one stands on either side of each end of the part.
    let scan = scan_of(1800, |column, layer| match column {
        598..602 | 898..902 if layer < 7 => 300,
        596 | 604 | 896 | 904 => 0,
        _ => 1000,
    });
    let plane = Plane::level(1.9);
    let heights_m: Vec<f32> = scan.z_m().iter().map(|z| z + 1.9).collect();
    let parameters = GridParameters::profile(Profile::Default);
    let seen_of = |columns: Range<usize>| {
        let (mut evidence, mut passed) = (Evidence::default(), vec![]);
        let ground = vec![false; scan.len()];
        gather(
            &mut evidence,
            columns.clone(),
            &scan,
            &plane,
            &ground,
            &heights_m,
            &parameters,
        );
        stretches(&mut evidence, &parameters, &mut passed);
        passed.retain(|stretch| (600..900).contains(&stretch.column));
        let part = scan.points_of(&(600..900));
        let mut obstacles: Vec<_> = evidence.obstacles().collect();
        obstacles.retain(|point| part.contains(point));
        let is_known = |column| evidence.lowest_pass_m(column, 2.0, &ground) < NONE_M;
        (passed, obstacles, [599, 600, 899, 900].map(is_known))
    };
    let (whole, part) = (seen_of(0..1800), seen_of(600..900));
    assert!(whole.0.len() >= 300 && !whole.1.is_empty());
    assert_eq!((&whole.0, &whole.1), (&part.0, &part.1));
    assert_eq!((whole.2, part.2), ([true; 4], [false, true, true, false]));
}
