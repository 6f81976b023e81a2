//! What the standard library's floats do only with care for NaN, and therefore slowly.

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
