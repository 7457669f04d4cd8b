//! A corrected move that was made, with what makes its correction uncertain.

use machine::engine::Live;

use crate::store::budget::PlacesBudgetRecord;
use crate::volumetric::{Mover, VolumetricCorrection};

/// A corrected move that was made.
#[derive(Clone, Debug)]
pub struct VolumetricMoved {
    /// Its last period.
    pub live: Live,
    /// What makes the correction uncertain then: along x, y and z, its places in this order.
    pub budget: Option<PlacesBudgetRecord>,
}

impl VolumetricMoved {
    /// What `mover` has done with its last period, and otherwise with `live`.
    pub(super) fn of(mover: &mut Mover, live: Live) -> Self {
        // Nobody looks at the period that ends a motion.
        let live = mover.newest().unwrap_or(live);
        let correction = mover.engine().correction();
        let correction = correction.and_then(|it| it.downcast_ref::<VolumetricCorrection>());
        let budget = correction.and_then(VolumetricCorrection::budget);
        let at_si: Vec<f64> = live.nominal.iter().take(3).map(|it| it.value()).collect();
        let places = vec![(at_si, None); 3];
        let budget = budget.map(|it| PlacesBudgetRecord::new(&it, places));
        Self { live, budget }
    }
}
