//! The hand that turns the plate of an emulated table.

use truestage::Failure;
use truestage::rotary::{Operator, PlateTask};

/// Does what is asked, unless it is told to be mistaken; sees nothing of the machine.
pub struct Hand<'a> {
    turn: Box<dyn FnMut(f64) + 'a>,
    lies_at: f64,
    mistakes: Vec<(usize, f64)>,
    leaves_after: Option<usize>,
    /// What it was asked for.
    pub asked: Vec<PlateTask>,
}

impl<'a> Hand<'a> {
    /// A hand that turns the plate by lines with `turn`.
    pub fn new(turn: impl FnMut(f64) + 'a) -> Self {
        Self {
            turn: Box::new(turn),
            lies_at: 0.0,
            mistakes: Vec::new(),
            leaves_after: None,
            asked: Vec::new(),
        }
    }

    /// It turns the plate by `lines` too many, once, when it is asked for the `ask`-th time (from
    /// 1), and believes to have done right.
    #[must_use]
    pub fn mistaken(mut self, ask: usize, lines: f64) -> Self {
        self.mistakes.push((ask, lines));
        self
    }

    /// It does what it is asked so often, and then goes home.
    #[must_use]
    pub const fn leaves_after(mut self, asks: usize) -> Self {
        self.leaves_after = Some(asks);
        self
    }

    /// It does what it is asked for ever.
    #[must_use]
    pub const fn stays(mut self) -> Self {
        self.leaves_after = None;
        self
    }

    /// The plate lies there to begin with, in lines from where it lay first.
    #[must_use]
    pub const fn lies_at(mut self, lines: f64) -> Self {
        self.lies_at = lines;
        self
    }
}

impl Operator for Hand<'_> {
    fn ask(&mut self, task: &PlateTask) -> Result<(), Failure> {
        self.asked.push(task.clone());
        let ask = self.asked.len();
        if self.leaves_after.is_some_and(|asks| ask > asks) {
            return Err(Failure::Machine(machine::Failure::Interrupted));
        }
        let slips = self.mistakes.iter().filter(|it| it.0 == ask).map(|it| it.1);
        (self.turn)(task.offset - self.lies_at + slips.sum::<f64>());
        self.lies_at = task.offset;
        Ok(())
    }

    fn is_done(&mut self) -> Result<bool, Failure> {
        Ok(true)
    }
}
