//! Which patch that stands apart is which track.

/// Patches and the tracks that they are, one of each at most. Its buffers are made once.
#[derive(Debug, Clone, Default)]
pub(super) struct Mains {
    /// By the numbers of the tracks, and of the patches.
    patches: Vec<Option<usize>>,
    tracks: Vec<Option<usize>>,
    proposals: Vec<Proposal>,
}

/// A patch that may be a track.
#[derive(Debug, Clone, Copy)]
struct Proposal {
    /// How far their middles are apart.
    off_m: f32,
    track: usize,
    patch: usize,
}

impl Mains {
    /// Begins anew with so many tracks and patches.
    pub(super) fn begin(&mut self, tracks: usize, patches: usize) {
        self.patches.clear();
        self.patches.resize(tracks, None);
        self.tracks.clear();
        self.tracks.resize(patches, None);
        self.proposals.clear();
    }

    /// Adds a pair whose middles are so far apart.
    pub(super) fn propose(&mut self, off_m: f32, track: usize, patch: usize) {
        self.proposals.push(Proposal {
            off_m,
            track,
            patch,
        });
    }

    /// Pairs the nearest first; of equally near ones the first track.
    pub(super) fn pair(&mut self) {
        self.proposals.sort_unstable_by(|one, other| {
            let rank = |proposal: &Proposal| (proposal.track, proposal.patch);
            let nearer = one.off_m.total_cmp(&other.off_m);
            nearer.then(rank(one).cmp(&rank(other)))
        });
        for Proposal { track, patch, .. } in &self.proposals {
            if self.patches[*track].is_none() && self.tracks[*patch].is_none() {
                self.patches[*track] = Some(*patch);
                self.tracks[*patch] = Some(*track);
            }
        }
    }

    /// The patch that a track is, if one that stands apart is it.
    pub(super) fn patch_of(&self, track: usize) -> Option<usize> {
        self.patches[track]
    }

    /// The track that a patch is.
    pub(super) fn track_of(&self, patch: usize) -> Option<usize> {
        self.tracks[patch]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_are_paired_first_and_each_once() {
        let mut mains = Mains::default();
        mains.begin(2, 3);
        for (off_m, track, patch) in [(0.5, 0, 0), (0.2, 0, 1), (0.3, 1, 1), (0.9, 1, 2)] {
            mains.propose(off_m, track, patch);
        }
        mains.pair();
        assert_eq!(
            [0, 1].map(|track| mains.patch_of(track)),
            [Some(1), Some(2)]
        );
        assert_eq!(
            [0, 1, 2].map(|patch| mains.track_of(patch)),
            [None, Some(0), Some(1)]
        );
    }
}
