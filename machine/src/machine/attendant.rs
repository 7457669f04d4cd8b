//! Who is called at the end of every tick, whatever ticks.

use crate::failure::Failure;
use crate::machine::Machine;

/// Attends to a machine: whoever keeps one for many others, and must answer them while a procedure waits.
///
/// # Example
///
/// ```
/// use machine::{Attendant, Failure, Machine, attend};
/// use std::{cell::Cell, rc::Rc};
///
/// struct Counting(Rc<Cell<u32>>);
///
/// impl Attendant for Counting {
///     fn attend(&mut self, _machine: &mut Machine) -> Result<(), Failure> {
///         self.0.set(self.0.get() + 1);
///         if self.0.get() < 3 { Ok(()) } else { Err(Failure::Interrupted) }
///     }
/// }
///
/// # use drivers::transport::replay::Replay;
/// # use machine::{Parts, Patience};
/// # use units::Time;
/// # let parts = Parts { buses: vec![], lines: Default::default(), axes: vec![], rotaries: vec![], analogs: vec![],
/// #     instruments: vec![], cameras: vec![], patience: Patience::NONE };
/// # let mut machine = Machine::new(parts, Box::new(Replay::parse("", &[])?));
/// let ticks = Rc::new(Cell::new(0));
/// attend(&mut machine, Box::new(Counting(Rc::clone(&ticks))));
/// for _ in 0..2 {
///     machine.tick(machine.now())?;
/// }
/// assert!(machine.tick(machine.now()).is_err(), "the third time it ends what runs");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait Attendant {
    /// Looks after `machine`, briefly and without waiting for anything: it is late for its buses otherwise.
    ///
    /// # Errors
    /// What ends the procedure that ticks, as a stop request does. While the machine is being stopped an
    /// error changes nothing.
    fn attend(&mut self, machine: &mut Machine) -> Result<(), Failure>;
}

/// Lets `attendant` look after `machine` from now on, at the end of every tick; the one before goes.
pub fn attend(machine: &mut Machine, attendant: Box<dyn Attendant>) {
    machine.attendant = Some(attendant);
}

/// Calls the attendant of `machine`, which has none meanwhile.
pub(crate) fn call(machine: &mut Machine) -> Result<(), Failure> {
    let Some(mut attendant) = machine.attendant.take() else {
        return Ok(());
    };
    let result = attendant.attend(machine);
    machine.attendant.get_or_insert(attendant);
    result
}
