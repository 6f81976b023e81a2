//! Marks on many points, of which few are set.

/// Marks that are looked at together.
const AT_ONCE: usize = 8;

/// The places that are marked, in order. Where most are not, eight are passed over at once.
pub(crate) fn marked(marks: &[bool]) -> impl Iterator<Item = usize> {
    let (eights, rest) = marks.as_chunks::<AT_ONCE>();
    let mut last = [false; AT_ONCE];
    last[..rest.len()].copy_from_slice(rest);
    let mut eights = eights.iter().copied().chain([last]);
    let mut begin = 0;
    // A byte for each, the first one lowest; those that were given are taken out.
    let mut word = 0u64;
    std::iter::from_fn(move || {
        while word == 0 {
            word = u64::from_le_bytes(eights.next()?.map(u8::from));
            begin += AT_ONCE;
        }
        let place = begin - AT_ONCE + word.trailing_zeros() as usize / 8;
        word &= word - 1;
        Some(place)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mark_is_found_also_behind_the_last_eight() {
        for places in [vec![], vec![0], vec![7, 8, 20], vec![16, 17, 18, 19, 20]] {
            let marks: Vec<bool> = (0..21).map(|place| places.contains(&place)).collect();
            assert_eq!(marked(&marks).collect::<Vec<_>>(), places);
        }
    }
}
