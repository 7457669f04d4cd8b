//! The encoder's index mark, met once a turn.

use crate::random::Stream;

use super::encoder::Encoder;
use super::pulse::IndexPulse;

/// One of the marks is where the scale has its zero.
#[derive(Clone, Debug)]
pub(in crate::plant) struct IndexMark {
    /// The travel from one mark to the next.
    turn: f64,
    /// Standard deviation of where the pulse acts.
    repeatability: f64,
    last: Option<IndexPulse>,
    stream: Stream,
}

impl IndexMark {
    /// Both in metres or both in radians.
    pub(in crate::plant) const fn new(turn: f64, repeatability: f64, stream: Stream) -> Self {
        Self {
            turn,
            repeatability,
            last: None,
            stream,
        }
    }

    /// The last pulse since the encoder was powered.
    pub(in crate::plant) const fn last(&self) -> Option<IndexPulse> {
        self.last
    }

    /// The encoder's count is a new one.
    pub(in crate::plant) const fn forget(&mut self) {
        self.last = None;
    }

    /// The scale has gone straight from one place to another.
    pub(in crate::plant) fn watch(&mut self, from: f64, to: f64, encoder: &Encoder) {
        let (before, after) = ((from / self.turn).floor(), (to / self.turn).floor());
        if before == after {
            return;
        }
        let mark = before.max(after) * self.turn;
        let jitter = self.repeatability * self.stream.gaussian();
        self.last = Some(IndexPulse {
            count: encoder.counts(mark + jitter),
            number: self.last.map_or(1, |last| last.number + 1),
        });
    }
}
