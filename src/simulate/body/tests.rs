use super::*;
use crate::random::Random;
use crate::simulate::solid::Ray;
use crate::simulate::variant::{Build, Freight, LorryBuild};

/// Ranges at which level rays from the side end, by height.
fn from_the_side(class: Class, size_m: [f64; 3], height_m: f64) -> Vec<f64> {
    let common = Variant {
        class,
        size_m,
        ..Variant::bus()
    };
    beside(&common, height_m)
}

fn beside(variant: &Variant, height_m: f64) -> Vec<f64> {
    let parts = parts(variant, 0.0);
    let luck = &mut Random::new(3);
    (-50..=50)
        .filter_map(|step| {
            let ray = Ray {
                origin: [f64::from(step) * 0.1, -10.0, height_m],
                direction: [0.0, 1.0, 0.0],
            };
            let hits = parts.iter().filter_map(|part| part.hit(&ray, luck));
            hits.map(|hit| hit.range_m).min_by(f64::total_cmp)
        })
        .collect()
}

#[test]
fn a_car_has_its_length_its_width_and_a_gap_below() {
    let size_m = [4.3, 1.8, 1.45];
    let body = from_the_side(Class::Car, size_m, 0.6);
    assert!((41..=44).contains(&body.len()), "{}", body.len());
    assert!((body[body.len() / 2] - 9.1).abs() < 0.05);
    let sill = from_the_side(Class::Car, size_m, 0.1);
    assert!((4..20).contains(&sill.len()), "{}", sill.len());
    let roof = from_the_side(Class::Car, size_m, 1.4);
    assert!((5..30).contains(&roof.len()), "{}", roof.len());
    assert!(from_the_side(Class::Car, size_m, 1.5).is_empty());
}

#[test]
fn a_cyclist_is_as_long_as_the_wheels_and_as_high_as_the_head() {
    let size_m = [1.75, 0.6, 1.75];
    assert!(!from_the_side(Class::Cyclist, size_m, 1.7).is_empty());
    let hub: usize = (0..20)
        .map(|_| from_the_side(Class::Cyclist, size_m, 0.34).len())
        .sum();
    assert!(hub > 20 * 4 && hub < 20 * 17, "{hub}");
}

#[test]
fn a_pedestrian_stands_on_the_ground() {
    let size_m = [0.4, 0.5, 1.75];
    for height_m in [0.05, 0.7, 1.2, 1.7] {
        assert!(!from_the_side(Class::Pedestrian, size_m, height_m).is_empty());
    }
}

#[test]
fn a_motorcycle_is_dense_where_a_bicycle_is_open() {
    let bicycle = Variant::cyclist(&mut Random::new(1));
    let motorcycle = Variant {
        build: Build::Motorcycle,
        ..bicycle
    };
    let rays = |variant: &Variant| (0..20).map(|_| beside(variant, 0.6).len()).sum::<usize>();
    assert!(rays(&motorcycle) > rays(&bicycle) + 20);
    assert!(!beside(&motorcycle, bicycle.size_m[2] - 0.05).is_empty());
}

#[test]
fn above_the_sides_of_a_tipper_only_the_cab_is_met_and_below_its_floor_what_hangs_there() {
    let tipper = |has_skirt: bool| Variant {
        build: Build::Lorry(LorryBuild {
            freight: Freight::Tipper { side_m: 0.8 },
            has_skirt,
            ..LorryBuild::of(false)
        }),
        ..Variant::lorry()
    };
    let cab = beside(&tipper(false), 2.2).len();
    assert!((10..20).contains(&cab), "{cab}");
    assert!(beside(&tipper(false), 1.4).len() > 60);
    let below = |has_skirt: bool| beside(&tipper(has_skirt), 0.7).len();
    assert!(below(true) > below(false) + 10);
}
