//! Cuts the bytes of a serial line into messages.

/// Collects bytes up to a terminator; bounded, and in step again after one message of
/// garbage.
#[derive(Clone, Debug)]
pub struct LineAssembler {
    terminator: u8,
    limit: usize,
    line: Vec<u8>,
    discarding: bool,
}

/// A message, or what should have been one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AssembledLine {
    /// The bytes before the terminator.
    Whole(Vec<u8>),
    /// More bytes than any message has; thrown away up to the terminator.
    Overlong,
}

impl LineAssembler {
    /// For messages of up to `limit` bytes that end with `terminator`.
    pub const fn new(terminator: u8, limit: usize) -> Self {
        Self {
            terminator,
            limit,
            line: Vec::new(),
            discarding: false,
        }
    }

    /// Takes one byte; returns the message that it ends.
    pub fn push(&mut self, byte: u8) -> Option<AssembledLine> {
        if byte == self.terminator {
            // The next message is about as long: room for it is asked for once.
            let next = Vec::with_capacity(self.line.len());
            let line = core::mem::replace(&mut self.line, next);
            return Some(if core::mem::take(&mut self.discarding) {
                AssembledLine::Overlong
            } else {
                AssembledLine::Whole(line)
            });
        }
        if self.line.len() >= self.limit {
            self.line.clear();
            self.discarding = true;
        }
        if !self.discarding {
            self.line.push(byte);
        }
        None
    }

    /// Forgets the message that has begun.
    pub fn clear(&mut self) {
        self.line.clear();
        self.discarding = false;
    }

    /// Forgets everything up to the next terminator: the line was joined mid-message.
    pub fn skip_message(&mut self) {
        self.line.clear();
        self.discarding = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn lines(assembler: &mut LineAssembler, bytes: &[u8]) -> Vec<AssembledLine> {
        bytes.iter().filter_map(|b| assembler.push(*b)).collect()
    }

    fn whole(text: &str) -> AssembledLine {
        AssembledLine::Whole(text.as_bytes().to_vec())
    }

    #[test]
    fn an_overlong_message_costs_only_itself() {
        let mut assembler = LineAssembler::new(b'\n', 4);
        let bytes = b"abcd\nabcdefghijkl\nx\n";
        let expected = [whole("abcd"), AssembledLine::Overlong, whole("x")];
        assert_eq!(lines(&mut assembler, bytes), expected);
    }

    proptest! {
        #[test]
        fn where_the_bytes_are_cut_means_nothing(
            bytes in prop::collection::vec(prop_oneof![Just(b'\n'), any::<u8>()], 0..200),
            cut in 0usize..200,
        ) {
            let (first, second) = bytes.split_at(cut.min(bytes.len()));
            let mut cut_up = LineAssembler::new(b'\n', 16);
            let mut pieces = lines(&mut cut_up, first);
            pieces.extend(lines(&mut cut_up, second));
            let mut at_once = LineAssembler::new(b'\n', 16);
            prop_assert_eq!(pieces, lines(&mut at_once, &bytes));
        }
    }
}
