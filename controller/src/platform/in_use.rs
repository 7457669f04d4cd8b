//! The calibrations of a platform's screws that are in use.

use compensator::screw::ScrewCompensation;

use crate::failure::Failure;
use crate::handle::no_such_axis;
use crate::platform::handle::AlignmentPlatform;
use crate::platform::record::ScrewContent;
use crate::store::Store;

impl AlignmentPlatform<'_> {
    /// The screws for which `store` has no active calibration. Asks no device.
    ///
    /// # Errors
    /// When the store cannot be read.
    pub fn without_calibration(&self, store: &Store) -> Result<Vec<String>, Failure> {
        let mut without = Vec::new();
        for screw in &self.state.screws {
            if store.active(&screw.axis)?.current.is_none() {
                without.push(screw.axis.clone());
            }
        }
        Ok(without)
    }

    /// Loads the calibrations that `store` says are active for the screws, after checking that
    /// they belong to this machine; returns their names by axis, `None` where there is none.
    ///
    /// # Errors
    /// When one is damaged, of another kind, belongs to another machine or breaks a limit.
    pub fn load_active(&mut self, store: &Store) -> Result<Vec<(String, Option<String>)>, Failure> {
        let axes: Vec<_> = self
            .state
            .screws
            .iter()
            .map(|screw| screw.axis.clone())
            .collect();
        let mut loaded = Vec::new();
        for (at, axis) in axes.into_iter().enumerate() {
            let id = store.active(&axis)?.current;
            if let Some(id) = &id {
                let compensation = self.usable(store, &axis, id)?;
                let state = &mut self.state.screws[at];
                state.compensation = Some(compensation);
                state.calibration = Some(id.clone());
            }
            loaded.push((axis, id));
        }
        Ok(loaded)
    }

    /// What the calibration `id` of the screw `axis` corrects, if it can be used here.
    ///
    /// # Errors
    /// When it is damaged, of another kind, belongs to another machine or breaks a limit.
    pub(super) fn usable(
        &self,
        store: &Store,
        axis: &str,
        id: &str,
    ) -> Result<ScrewCompensation, Failure> {
        let mut screws = self.state.screws.iter();
        let at = screws.position(|screw| screw.axis == axis);
        let known = || self.state.screws.iter().map(|screw| screw.axis.clone());
        let at = at.ok_or_else(|| no_such_axis(axis, &known().collect::<Vec<_>>()))?;
        let record = store.load::<ScrewContent>(id)?;
        record
            .head
            .belongs_to(id, &self.core.this_machine(axis), self.core.config_hash)?;
        self.prepare_screw(at, record.content.model())
    }
}
