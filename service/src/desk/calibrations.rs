//! Calibrations: which there are, and which one is used.

use machine::records::StoreError;
use truestage::runs::Choice;

use super::Desk;
use crate::order::{Answer, Order};
use crate::problem::{Code, Problem};
use crate::request::Caller;
use crate::view::{CalibrationView, ChangeView, ChosenView};

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

    /// Uses the calibration whose name begins with `id` from now on. Nothing moves.
    ///
    /// # Errors
    /// When it is not there, damaged, of another machine, does not go with others in use, or an axis is in use.
    pub fn activate(&self, caller: &Caller, id: &str) -> Result<ChosenView, Problem> {
        self.choose(caller, Choice::Activate(id.to_owned()))
    }

    /// Uses the calibration that `axis` used before: of a platform (`platform`) those of all its screws, of three axes
    /// (`volume`) their errors and what counts from them. Nothing moves.
    ///
    /// # Errors
    /// When there is none, it cannot be used, or an axis is in use.
    pub fn rollback(&self, caller: &Caller, axis: &str) -> Result<ChosenView, Problem> {
        self.choose(caller, Choice::Rollback(axis.to_owned()))
    }

    /// Uses nothing any more of what the store calls `of`: `volume-first-memory` or `volume-second-memory`. What counted from
    /// it stays in use, and nothing is corrected until that is recorded again or cleared, too. Nothing moves.
    ///
    /// # Errors
    /// When a machine does not do without it, or an axis is in use.
    pub fn clear(&self, caller: &Caller, of: &str) -> Result<ChosenView, Problem> {
        self.choose(caller, Choice::Clear(of.to_owned()))
    }

    fn choose(&self, caller: &Caller, choice: Choice) -> Result<ChosenView, Problem> {
        let answer = self.give(caller, Order::Calibration(choice))?.wait()?;
        self.chosen(answer)
    }

    /// What an order for another calibration came to.
    pub(crate) fn chosen(&self, answer: Answer) -> Result<ChosenView, Problem> {
        let Answer::Chosen(changes, axes, warning) = answer else {
            return Err(Problem::new(Code::Ending, "nothing was chosen", ""));
        };
        let axes = axes.iter().map(|it| self.axis(it));
        Ok(ChosenView {
            changes: changes.into_iter().map(ChangeView::from).collect(),
            axes: axes.collect::<Result<_, _>>()?,
            warning,
        })
    }
}
