//! Marks on many points, of which few are set.

/// Marks that are looked at together.
const AT_ONCE: usize = 8;

/// The places that are marked, in order. Where most are not, eight are passed over at once.
pub(crate) fn marked(marks: &[bool]) -> impl Iterator<Item = usize> {
    let (eights, _) = marks.as_chunks::<AT_ONCE>();
    let eights = eights.iter().enumerate();
    let some = eights.filter(|(_, eight)| **eight != [false; AT_ONCE]);
    let within = some.map(|(at, _)| AT_ONCE * at..AT_ONCE * (at + 1));
    let rest = marks.len() / AT_ONCE * AT_ONCE..marks.len();
    let places = within.chain([rest]).flatten();
    places.filter(|place| marks[*place])
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
