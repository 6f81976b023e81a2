//! Marks on many points, of which few are set.

/// Marks that are looked at together: one bit of a word for each.
const AT_ONCE: usize = 64;

/// The places that are marked, in order.
pub(crate) fn marked(marks: &[bool]) -> impl Iterator<Item = usize> {
    let mut words = words(marks);
    let mut begin = 0;
    // Those that were given are taken out.
    let mut word = 0u64;
    std::iter::from_fn(move || {
        while word == 0 {
            word = words.next()?;
            begin += AT_ONCE;
        }
        let place = begin - AT_ONCE + word.trailing_zeros() as usize;
        word &= word - 1;
        Some(place)
    })
}

/// How many are marked.
pub(crate) fn count(marks: &[bool]) -> usize {
    words(marks).map(|word| word.count_ones() as usize).sum()
}

/// The bits that are set, from the lowest on.
#[inline(always)]
pub(crate) fn set_bits(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = bits.trailing_zeros();
        bits &= bits.wrapping_sub(1);
        (bit < u32::BITS).then_some(bit as usize)
    })
}

/// A bit for each mark, the first one lowest; the last word is filled up with none.
fn words(marks: &[bool]) -> impl Iterator<Item = u64> {
    let (chunks, rest) = marks.as_chunks::<AT_ONCE>();
    let mut last = [false; AT_ONCE];
    last[..rest.len()].copy_from_slice(rest);
    let last = std::iter::once_with(move || bits(&last));
    chunks.iter().map(bits).chain(last)
}

/// A bit for each mark, the first one lowest.
fn bits(marks: &[bool; AT_ONCE]) -> u64 {
    /// Brings the lowest bits of eight bytes together in the highest byte, the first one lowest.
    const TOGETHER: u64 = 0x0102_0408_1020_4080;
    let mut word = 0;
    for eight in marks.as_chunks::<8>().0.iter().rev() {
        let bytes = u64::from_le_bytes(eight.map(u8::from));
        word = word << 8 | bytes.wrapping_mul(TOGETHER) >> 56;
    }
    word
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_are_counted_however_many_are_marked() {
        assert_eq!(count(&[true; 9999]), 9999);
    }

    #[test]
    fn every_mark_is_found_also_behind_the_last_whole_word() {
        let all: Vec<usize> = (0..150).collect();
        for places in [vec![], vec![0], vec![7, 8, 63, 64, 149], all] {
            let marks: Vec<bool> = (0..150).map(|place| places.contains(&place)).collect();
            assert_eq!(marked(&marks).collect::<Vec<_>>(), places);
            assert_eq!(count(&marks), places.len());
        }
    }
}
