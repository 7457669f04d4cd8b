//! Motions of axes that move as one: procedures between two ticks.

use super::{Kept, is_stop, stops_the_machine};
use crate::keeper::cause_of;

impl Kept {
    /// One such motion, from its begin to where its axes come to rest.
    pub(super) fn move_as_one(&mut self, id: &str) {
        let Some((group, asked)) = self.keeper.borrow_mut().begin_procedure_of(id) else {
            return;
        };
        let (machine, teller) = (&mut self.machine, self.teller.as_ref());
        let result = group.move_to(machine, &self.store, &asked, teller);
        let mut keeper = self.keeper.borrow_mut();
        match result {
            Ok(moved) => keeper.end_procedure_of(&self.machine, id, Some(moved)),
            Err(failure) => {
                keeper.end_procedure_of(&self.machine, id, None);
                drop(keeper);
                self.not_moved(id, failure);
            }
        }
    }

    fn not_moved(&mut self, id: &str, failure: truestage::Failure) {
        match failure {
            // The next tick ends the service.
            _ if self.machine.stop_request().is_requested() => {}
            failure if is_stop(&failure) => {
                let mut keeper = self.keeper.borrow_mut();
                keeper.motion_interrupted(&mut self.machine, id);
            }
            failure if stops_the_machine(&failure) => self.failed(failure),
            failure => {
                let cause = cause_of(&failure);
                let mut keeper = self.keeper.borrow_mut();
                keeper.motion_refused(&mut self.machine, id, cause);
            }
        }
    }
}
