//! Motions of axes that move as one: procedures between two ticks.

use truestage::Failure;

use super::Kept;
use crate::keeper::cause_of;

impl Kept {
    /// One such motion, from its begin to where its axes come to rest.
    pub(super) fn move_as_one(&mut self, id: &str) {
        let Some((group, asked)) = self.keeper.borrow_mut().begin_procedure_of(id) else {
            return;
        };
        let (machine, teller) = (&mut self.machine, self.teller.as_ref());
        let result = group.move_to(machine, &self.store, &asked, teller);
        let (moved, not_moved) = match result {
            Ok(Ok(moved)) => (Some(moved), None),
            Ok(Err(failure)) => (None, Some((failure, Sent::Perhaps))),
            Err(failure) => (None, Some((failure, Sent::Nothing))),
        };
        let mut keeper = self.keeper.borrow_mut();
        keeper.end_procedure_of(&self.machine, id, moved);
        drop(keeper);
        if let Some((failure, sent)) = not_moved {
            self.not_moved(id, failure, sent);
        }
    }

    fn not_moved(&mut self, id: &str, failure: Failure, sent: Sent) {
        if self.machine.stop_request().is_requested() {
            // The next tick ends the service.
            return;
        }
        if failure.is_stop() {
            let mut keeper = self.keeper.borrow_mut();
            keeper.motion_interrupted(&mut self.machine, id);
        } else if sent == Sent::Perhaps && failure.stops_the_machine() {
            self.failed(failure);
        } else {
            let cause = cause_of(&failure);
            let mut keeper = self.keeper.borrow_mut();
            keeper.motion_refused(&mut self.machine, id, cause);
        }
    }
}

/// What a motion that failed had sent to its axes: where it is nothing, they stand and are supervised, whatever the
/// cause.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Sent {
    Nothing,
    Perhaps,
}
