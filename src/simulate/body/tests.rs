use super::*;
use crate::random::Random;
use crate::simulate::solid::Ray;

/// Ranges at which level rays from the side end, by height.
fn from_the_side(class: Class, size_m: [f64; 3], height_m: f64) -> Vec<f64> {
    let variant = Variant {
        class,
        size_m,
        ..Variant::bus()
    };
    let parts = parts(&variant, 0.0);
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
