//! Which identifiers a node listens to: every node hears every frame of its bus, and nearly all of
//! them are for others.

/// Identifiers of standard frames, 64 in a word.
const WORDS: usize = 0x800 / 64;

/// A set of identifiers.
#[derive(Clone, Debug)]
pub(super) struct Listening([u64; WORDS]);

impl Default for Listening {
    fn default() -> Self {
        Self([0; WORDS])
    }
}

impl Extend<u16> for Listening {
    fn extend<I: IntoIterator<Item = u16>>(&mut self, cob_ids: I) {
        for cob_id in cob_ids {
            let (word, bit) = place(cob_id);
            self.0[word] |= bit;
        }
    }
}

impl Listening {
    pub(super) const fn contains(&self, cob_id: u16) -> bool {
        let (word, bit) = place(cob_id);
        self.0[word] & bit != 0
    }
}

const fn place(cob_id: u16) -> (usize, u64) {
    let cob_id = cob_id & 0x7FF;
    (cob_id as usize / 64, 1 << (cob_id % 64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_holds_what_it_was_told_and_nothing_else() {
        let told = [0, 0x080, 0x201, 0x601, 0x7FF];
        let mut listening = Listening::default();
        listening.extend(told);
        for cob_id in 0..0x800 {
            assert_eq!(listening.contains(cob_id), told.contains(&cob_id));
        }
    }
}
