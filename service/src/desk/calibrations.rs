//! Calibrations: which there are, and which one is used.

use machine::records::StoreError;

use super::{Desk, named};
use crate::order::{Choice, Order};
use crate::problem::Problem;
use crate::request::Caller;
use crate::view::CalibrationView;

/// Calibrations.
impl Desk {
    /// Those that are stored, the oldest first; one that cannot be read is left out.
    ///
    /// # Errors
    /// When the folder cannot be read.
    pub fn calibrations(&self) -> Result<Vec<CalibrationView>, Problem> {
        let store = &self.shared.store;
        let unread = |it: StoreError| Problem::from(truestage::Failure::from(it));
        let mut views = Vec::new();
        for id in store.list().map_err(unread)? {
            let Ok(glance) = store.glance(&id) else {
                continue;
            };
            let used = store.active(&glance.head.axis).map_err(unread)?.current;
            views.push(CalibrationView {
                active: used.as_deref() == Some(&id),
                id,
                axis: glance.head.axis,
                kind: glance.kind.to_owned(),
                created: glance.head.created,
                source: glance.head.source,
                summary: glance.summary,
            });
        }
        views.sort_by(|a, b| a.created.cmp(&b.created));
        Ok(views)
    }

    /// Uses the calibration whose name begins with `id` from now on; returns its axis. Nothing moves.
    ///
    /// # Errors
    /// When it is not there, damaged, of another machine, or its axis is in use.
    pub fn activate(&self, caller: &Caller, id: &str) -> Result<String, Problem> {
        self.choose(caller, Choice::Activate(id.to_owned()))
    }

    /// Uses the calibration that `axis` used before; returns the axis. Nothing moves.
    ///
    /// # Errors
    /// When there is none, or the axis is in use.
    pub fn rollback(&self, caller: &Caller, axis: &str) -> Result<String, Problem> {
        self.choose(caller, Choice::Rollback(axis.to_owned()))
    }

    fn choose(&self, caller: &Caller, choice: Choice) -> Result<String, Problem> {
        let answer = self.give(caller, Order::Calibration(choice))?.wait()?;
        named(answer)
    }
}
