//! A designed shape as first memory, from a file: nothing has to be recorded, and nothing moves.
//!
//! It counts from the references in use, like everything that detectors see. What their machine was built
//! with before these were taken is in the references, and no displacement.

use compensator::volumetric::{StatePoint, StateSeries, StateValue};
use units::{Metres, Radians, Short};

use crate::config::MachineConfig;
use crate::failure::Failure;
use crate::run::{measured_elsewhere, settle, utc_now};
use crate::runs::DataFile;
use crate::store::{CalibrationRecord, RecordHead, Store};
use crate::volumetric::handle::WorkVolume;
use crate::volumetric::memory::foreign_second;
use crate::volumetric::reference::measured_geometry;
use crate::volumetric::{
    AXES, BeamReferencesContent, MemoryName, REFERENCES, Remembered, StateMemoryContent,
    VolumetricConfig, VolumetricFailure, memory_pointer,
};

/// Stores what `text`, the file called `name`, says and activates it.
///
/// # Errors
/// When there are no references of the errors in use to count from, the file is no shape, or the shape is
/// none that this machine can keep: with the row.
pub fn import(
    machine: &MachineConfig,
    store: &Store,
    head: RecordHead,
    (text, name): (&str, &str),
) -> Result<Remembered, Failure> {
    let config = machine.volumetric.as_ref().ok_or(VolumetricFailure::None)?;
    let series = StateSeries::from_csv(text, name)?;
    let references = references(config, store, &series)?;
    for point in series.points() {
        judge(config, name, point)?;
    }
    let (map, covers) = series.map().map_err(VolumetricFailure::from)?;
    let content = StateMemoryContent::new(MemoryName::First, &references, &map);
    let id = store.save(&CalibrationRecord { head, content })?;
    store.activate(memory_pointer(MemoryName::First), &id)?;
    Ok(Remembered {
        id,
        map,
        covers,
        foreign: foreign_second(store)?,
    })
}

impl WorkVolume<'_> {
    /// The same for whoever keeps the machine: its drives were asked who they are.
    ///
    /// # Errors
    /// Those of [`import`].
    pub(crate) fn import_memory(
        &mut self,
        store: &Store,
        file: &DataFile,
    ) -> Result<Remembered, Failure> {
        let head = RecordHead {
            created: utc_now(),
            source: file.name.clone(),
            instrument: measured_elsewhere(),
            ..self.this_volume(memory_pointer(MemoryName::First))?
        };
        let kept = import(self.core.config, store, head, (&file.text, &file.name))?;
        settle(&mut self.core, store)?;
        Ok(kept)
    }
}

/// A second memory is the state that a first part was made in: nobody designs it.
pub(crate) fn no_designed_second() -> Failure {
    Failure::Usage {
        what: "a second memory is the state that a first part was made in".into(),
        help: "record it with `truestage run --first-part` or `truestage memory record`".into(),
    }
}

/// The name of the references in use, which watch every axis of the shape.
fn references(
    config: &VolumetricConfig,
    store: &Store,
    series: &StateSeries,
) -> Result<String, Failure> {
    let geometry = measured_geometry(store)?;
    let axis = series.points()[0].axis;
    let none = || VolumetricFailure::NoReference { axis };
    let id = store.active(REFERENCES)?.current.ok_or_else(none)?;
    let content = store.load::<BeamReferencesContent>(&id)?.content;
    if content.geometry != geometry {
        return Err(none().into());
    }
    let unwatched = series.points().iter().find_map(|it| match it.value {
        StateValue::Displacement(..) => {
            let letter = AXES[it.axis.index()];
            let is_watched = content.beams.iter().any(|beam| beam.axis == letter);
            (!is_watched).then_some(VolumetricFailure::NoReference { axis: it.axis })
        }
        StateValue::Roll(_) => {
            let is_watched = content.roll_record(config, it.axis).is_some();
            (!is_watched).then_some(VolumetricFailure::NoRollReference)
        }
    });
    match unwatched {
        Some(failure) => Err(failure.into()),
        None => Ok(id),
    }
}

/// Whether the machine may be there, and be displaced by so much.
fn judge(config: &VolumetricConfig, name: &str, it: &StatePoint) -> Result<(), Failure> {
    let k = it.axis.index();
    let (low_mm, high_mm) = (config.low_mm[k], config.high_mm[k]);
    let is_inside = it.at >= Metres::from_mm(low_mm) && it.at <= Metres::from_mm(high_mm);
    let refused = |what: String, help: String| {
        let what = format!("{name}:{}: {what}; nothing was stored", it.row);
        Err(Failure::Usage { what, help })
    };
    if !is_inside {
        let (axis, mm) = (it.axis, Short(it.at.mm()));
        return refused(
            format!("{axis} = {mm} mm is outside the work volume, {low_mm} to {high_mm} mm"),
            "are positions millimetres from the machine's zero?".into(),
        );
    }
    match it.value {
        StateValue::Displacement(_, displacement) => {
            let limit_um = config.compensation.displacement_max_um;
            if displacement.abs() <= Metres::from_um(limit_um) {
                return Ok(());
            }
            let um = Short(displacement.um());
            refused(
                format!("a displacement of {um} um is beyond displacement_max_um, {limit_um}"),
                "are displacements micrometres? Otherwise permit more in [volumetric.compensation]"
                    .into(),
            )
        }
        StateValue::Roll(roll) => {
            let Some(own) = config.rolls()[it.axis.index()] else {
                return refused(
                    format!("no detector sees the slide of {} roll", it.axis),
                    "leave its rows out, or describe [volumetric.roll]".into(),
                );
            };
            let limit_arcsec = own.roll_max_arcsec;
            if roll.abs() <= Radians::from_arcsec(limit_arcsec) {
                return Ok(());
            }
            let arcsec = Short(roll.arcsec());
            refused(
                format!("a roll of {arcsec} arcsec is beyond roll_max_arcsec, {limit_arcsec}"),
                "are rolls arcseconds? Otherwise permit more in [volumetric.roll]".into(),
            )
        }
    }
}
