//! Cuts the bytes of a serial line into messages.

/// Collects bytes up to a terminator; bounded, and in step again after one message of
/// garbage.
///
/// # Example
///
/// ```
/// use drivers::device::serial_line::{AssembledLine, LineAssembler};
///
/// let mut lines = LineAssembler::new(b'\n', 4);
/// let seen: Vec<_> = b"abcd\nabcdefgh\n".iter().filter_map(|byte| lines.push(*byte)).collect();
/// assert_eq!(seen, [AssembledLine::Whole(b"abcd".to_vec()), AssembledLine::Overlong]);
/// ```
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

    /// Takes bytes up to and with the next terminator, and leaves the others in `bytes`; returns
    /// the message that ended.
    pub fn take(&mut self, bytes: &mut &[u8]) -> Option<AssembledLine> {
        let all = *bytes;
        let end = all.iter().position(|byte| *byte == self.terminator);
        let (run, left) = all.split_at(end.unwrap_or(all.len()));
        if self.line.len() + run.len() > self.limit {
            self.line.clear();
            self.discarding = true;
        }
        if !self.discarding {
            self.line.extend_from_slice(run);
        }
        *bytes = left;
        let (terminator, left) = left.split_first()?;
        *bytes = left;
        self.push(*terminator)
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

    fn by_runs(assembler: &mut LineAssembler, mut bytes: &[u8]) -> Vec<AssembledLine> {
        let mut lines = Vec::new();
        while !bytes.is_empty() {
            lines.extend(assembler.take(&mut bytes));
        }
        lines
    }

    proptest! {
        #[test]
        fn runs_of_bytes_are_taken_as_their_bytes_one_by_one(
            runs in prop::collection::vec(
                prop::collection::vec(prop_oneof![Just(b'\n'), any::<u8>()], 0..40), 0..10),
        ) {
            let mut one_by_one = LineAssembler::new(b'\n', 16);
            let mut at_once = LineAssembler::new(b'\n', 16);
            for run in runs {
                let expected = lines(&mut one_by_one, &run);
                prop_assert_eq!(by_runs(&mut at_once, &run), expected);
            }
        }

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
