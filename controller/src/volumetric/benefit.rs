//! Whether a calibration makes three axes better, by what a verification has seen: without it the line would have been
//! off by what was seen and by what was taken away.

use machine::ask_disk;
use units::Metres;

use crate::failure::Failure;
use crate::store::{Store, short};
use crate::volumetric::GEOMETRY;
use crate::volumetric::chosen::{use_geometry, use_nothing};
use crate::volumetric::handle::WorkVolume;
use crate::volumetric::verify::{VolumetricVerified, from_the_first};
use crate::worse::likely_cause;

impl WorkVolume<'_> {
    /// The calibration called `geometry`, with which the line is out of tolerance and worse than without, is taken out
    /// of use, and with it the references that count from it.
    pub(super) fn judge_benefit(
        &mut self,
        store: &Store,
        geometry: Option<&str>,
        verified: &VolumetricVerified,
    ) -> Result<(), Failure> {
        let Some(id) = geometry else {
            return Ok(());
        };
        let both = verified
            .points
            .iter()
            .filter_map(|it| Some((it.known?, it.deviation)));
        let both: Vec<(Metres, Metres)> = both.collect();
        let found: Vec<Metres> = both.iter().map(|(known, left)| *known + *left).collect();
        let (_, before) = from_the_first(&found);
        if verified.is_within_tolerance() || verified.range <= before {
            return Ok(());
        }
        let pairs: Vec<_> = both
            .iter()
            .map(|(known, left)| (known.value(), left.value()))
            .collect();
        let own = id.to_owned();
        let in_use = ask_disk(&mut self.core, store, move |store| fall_back(store, &own))??;
        Err(Failure::MadeWorse {
            axis: "x, y, z".into(),
            calibration: short(id),
            before,
            after: verified.range,
            cause: likely_cause(&pairs),
            in_use: in_use.as_deref().map(short),
        })
    }
}

/// The calibration before `id` is used again, with what counts from it, or none; its name.
pub(super) fn fall_back(store: &Store, id: &str) -> Result<Option<String>, Failure> {
    if store.active(GEOMETRY)?.current.as_deref() != Some(id) {
        return Ok(None);
    }
    let in_use = store.retire(GEOMETRY)?;
    match &in_use {
        Some(earlier) => use_geometry(store, earlier)?,
        None => use_nothing(store)?,
    }
    Ok(in_use)
}
