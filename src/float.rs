//! Floats, many at once: what the standard library does only with care for NaN, and therefore
//! slowly.

use multiversion::multiversion;

/// The lesser of two numbers, of which none is NaN: one instruction for many at once.
#[inline(always)]
pub(crate) fn least<T: PartialOrd>(a: T, b: T) -> T {
    if a < b { a } else { b }
}

/// The greater of two numbers, of which none is NaN.
#[inline(always)]
pub(crate) fn greatest<T: PartialOrd>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

/// Floats that one register holds. Arrays of so many that are replaced as a whole, as [`each`] does,
/// stay in registers. What is written over in memory under a condition, be it that of [`least`],
/// becomes a masked store, of which some processors do one in thirty cycles.
pub(crate) const LANES: usize = 8;

/// What is computed of every lane.
#[inline(always)]
pub(crate) fn each<T>(of_lane: impl FnMut(usize) -> T) -> [T; LANES] {
    std::array::from_fn(of_lane)
}

/// The lesser one of each pair.
#[inline(always)]
pub(crate) fn least_each(a: [f32; LANES], b: [f32; LANES]) -> [f32; LANES] {
    each(|lane| least(a[lane], b[lane]))
}

/// The greater one of each pair.
#[inline(always)]
pub(crate) fn greatest_each(a: [f32; LANES], b: [f32; LANES]) -> [f32; LANES] {
    each(|lane| greatest(a[lane], b[lane]))
}

/// The least of a power of two of numbers, of which none is NaN.
#[inline(always)]
pub(crate) fn least_of<const N: usize>(values: [f32; N]) -> f32 {
    folded(values, least)
}

/// The greatest of a power of two of numbers, of which none is NaN.
#[inline(always)]
pub(crate) fn greatest_of<const N: usize>(values: [f32; N]) -> f32 {
    folded(values, greatest)
}

/// The least and the greatest of many numbers, of which none is NaN; infinities of none.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(crate) fn bounds_of(values: &[f32]) -> [f32; 2] {
    let (eights, rest) = values.as_chunks::<LANES>();
    let (mut low, mut high) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
    for eight in eights {
        low = least_each(*eight, low);
    }
    for eight in eights {
        high = greatest_each(*eight, high);
    }
    let mut bounds = [least_of(low), greatest_of(high)];
    for value in rest {
        bounds = [least(bounds[0], *value), greatest(bounds[1], *value)];
    }
    bounds
}

/// Compares the halves with each other until one number is left.
#[inline(always)]
fn folded<const N: usize>(mut values: [f32; N], better: impl Fn(f32, f32) -> f32) -> f32 {
    let mut width = N;
    while width > 1 {
        width /= 2;
        for at in 0..width {
            values[at] = better(values[at], values[at + width]);
        }
    }
    values[0]
}

/// The integer next to a number from 0 to 2^16: one addition, where a conversion would have to
/// mind the numbers that it cannot convert.
#[inline(always)]
pub(crate) fn rounded(value: f32) -> u16 {
    // From here on to twice as far the last bit of a float counts ones.
    const ONES: f32 = (1u32 << 23) as f32;
    (value + ONES).to_bits() as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_hold_all_numbers_wherever_the_outermost_stand() {
        assert_eq!(bounds_of(&[]), [f32::INFINITY, f32::NEG_INFINITY]);
        for count in [1, 7, 15, 16, 29, 53] {
            for (low, high) in [(0, count - 1), (count - 1, 0), (count / 2, count / 3)] {
                let mut values = vec![1.5; count];
                values[high] = 4.0;
                values[low] = -3.0;
                let highest = values.iter().copied().fold(f32::MIN, f32::max);
                assert_eq!(bounds_of(&values), [-3.0, highest]);
            }
        }
    }
}
