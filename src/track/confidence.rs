//! What a track's existence is worth: how often somebody is there.

/// Existence that the filters and the looks give, and the share of objects that have it at which a road user is; between
/// two knots in proportion. `scripts/calibrate`; up to 0.5, which stays so that the same is listed, only the order is known.
const SHARES: [[f64; 2]; 12] = [
    [0.00, 0.000],
    [0.50, 0.500],
    [0.52, 0.501],
    [0.55, 0.546],
    [0.60, 0.584],
    [0.65, 0.637],
    [0.70, 0.735],
    [0.80, 0.779],
    [0.90, 0.836],
    [0.96, 0.902],
    [0.98, 0.981],
    [1.00, 0.995],
];

/// The probability that a road user is there.
pub(super) fn confidence(existence: f64) -> f64 {
    let after = SHARES.partition_point(|[from, _]| *from <= existence);
    let after = after.clamp(1, SHARES.len() - 1);
    let ([from, low], [to, high]) = (SHARES[after - 1], SHARES[after]);
    low + (high - low) * (existence - from) / (to - from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn confidence_grows_with_existence_and_leaves_what_is_listed() {
        assert!(
            SHARES
                .windows(2)
                .all(|two| (0..2).all(|axis| two[0][axis] < two[1][axis]))
        );
        for (existence, expected) in [(0.0, 0.0), (0.25, 0.25), (0.5, 0.5)] {
            assert!((confidence(existence) - expected).abs() < 1e-12);
        }
        let many = (0..=1000).map(|step| confidence(0.001 * f64::from(step)));
        assert!(
            many.clone()
                .zip(many.skip(1))
                .all(|(less, more)| less < more && more <= 1.0)
        );
    }
}
