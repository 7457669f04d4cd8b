//! A calibration that is continued.
//!
//! What was read before counts from the references of its journal, and goes on counting from them.
//! Each line has an unknown zero of its own, and a straightedge an unknown angle, so that a line
//! does not care what became of the interferometer, or of the machine's zero by a count, since the
//! line before; half a line does. A detector that was pushed along shows the same everywhere, which
//! zeros of lines take up too. What would spoil the readings that follow is a change that differs
//! along an axis: the references are read once more, and compared.

use std::path::Path;

use compensator::volumetric::Axis;
use compensator::volumetric::function::Function;
use units::{Metres, Radians};

use crate::config::ConfigHash;
use crate::failure::Failure;
use crate::store::{Journal, JournalHeader, Store, StoreError, first_difference, not_resumable};
use crate::volumetric::VolumeEntry;
use crate::volumetric::handle::WorkVolume;
use crate::volumetric::reference::warmth_tolerance_k;
use crate::volumetric::settings::beam_drift;
use crate::volumetric::{AXES, VolumeLog, VolumePlanEntry, VolumeReferencesEntry};
use crate::volumetric::{BeamConfig, VolumetricCalibrateConfig, VolumetricConfig};
use crate::volumetric::{References, VolumetricFailure};

/// A new journal, or one that is continued after its last whole line.
pub(super) fn open(
    store: &Store,
    header: &JournalHeader,
    plan: VolumePlanEntry,
    resume: Option<&Path>,
    hash: &ConfigHash,
) -> Result<(Journal<VolumeLog>, VolumeLog), Failure> {
    let Some(path) = resume else {
        let mut journal = store.create_journal(header)?;
        let read = begin(&mut journal, plan)?;
        return Ok((journal, read));
    };
    let (mut journal, read) = store.resume_journal::<VolumeLog>(path, header, hash)?;
    let read = match read.log.plan {
        // Killed before its second line: nothing was read yet.
        None => begin(&mut journal, plan)?,
        Some(ref before) => {
            same_plan(path, before, &plan)?;
            read.log
        }
    };
    Ok((journal, read))
}

fn same_plan(
    path: &Path,
    before: &VolumePlanEntry,
    now: &VolumePlanEntry,
) -> Result<(), StoreError> {
    // A journal of an earlier program does not say how errors run between their nodes; and it may be warmed up for another
    // time than at first: what that comes to is read.
    let before = &VolumePlanEntry {
        shape: before.shape.or(now.shape),
        warm_up_min: now.warm_up_min,
        ..before.clone()
    };
    // By far the most frequent one, and not to be found in a list of lines.
    let warm = |it: &VolumePlanEntry| it.lines.iter().filter(|it| it.warm).count();
    if let Some(it) = first_difference(&warm(before), &warm(now)) {
        let what = "number of lines read warm (--warm-up-min)";
        return Err(not_resumable(path, what, it));
    }
    let different = first_difference(before, now);
    different.map_or(Ok(()), |it| {
        Err(not_resumable(path, "how errors are found", it))
    })
}

fn begin(journal: &mut Journal<VolumeLog>, plan: VolumePlanEntry) -> Result<VolumeLog, StoreError> {
    journal.write(&VolumeEntry::VolumePlan(plan.clone()))?;
    journal.flush_to_disk()?;
    Ok(VolumeLog {
        plan: Some(plan),
        ..VolumeLog::default()
    })
}

impl From<&VolumeReferencesEntry> for References {
    fn from(entry: &VolumeReferencesEntry) -> Self {
        Self {
            content: entry.content.clone(),
            temperatures: entry
                .temperatures_c
                .iter()
                .copied()
                .map(units::Celsius)
                .collect(),
        }
    }
}

impl WorkVolume<'_> {
    /// Whether what the detectors read now (`taken`) leaves `kept`, the references of the run that
    /// is continued, what they were.
    pub(super) fn still_holds(
        &self,
        config: &VolumetricConfig,
        own: &VolumetricCalibrateConfig,
        read: &VolumeLog,
        kept: &VolumeReferencesEntry,
        taken: &References,
    ) -> Result<(), Failure> {
        same_warmth(config, read, kept, taken)?;
        let limit = Metres::from_um(own.resume_limit_um);
        let within = |axis, what, seen: Metres| {
            if seen > limit {
                return Err(VolumetricFailure::Moved {
                    axis,
                    what,
                    seen,
                    limit,
                });
            }
            Ok(())
        };
        for (axis, beam) in Axis::ALL.into_iter().zip(config.beam.each()) {
            let Some(beam) = beam else { continue };
            within(axis, "beam", change_of_beam(axis, beam, kept, taken)?)?;
        }
        // As it would show at the end of the longest tool.
        let reach = Metres::from_mm(config.tool_max_mm);
        let before = kept.content.rolls("the journal", config)?;
        let now = taken.content.rolls("just taken", config)?;
        for axis in Axis::ALL {
            let k = axis.index();
            if config.rolls()[k].is_some() {
                let change = change_of_roll(before[k].as_ref(), now[k].as_ref())?;
                within(axis, "roll", reach * change.value())?;
            }
        }
        Ok(())
    }
}

/// Where lines are read warm too, warmth is found with the errors. Where they are not, all lines
/// count as read at one warmth, and the machine must be as warm as where it was interrupted.
fn same_warmth(
    config: &VolumetricConfig,
    read: &VolumeLog,
    kept: &VolumeReferencesEntry,
    taken: &References,
) -> Result<(), VolumetricFailure> {
    let plan = read.plan.as_ref();
    if plan.is_some_and(|it| it.lines.iter().any(|it| it.warm)) {
        return Ok(());
    }
    let last = read.whole.last().map(|it| &it.temperatures_c);
    let before = last.unwrap_or(&kept.temperatures_c);
    let limit = warmth_tolerance_k(config);
    for (at, (before, seen)) in before.iter().zip(&taken.temperatures).enumerate() {
        let difference = (seen.value() - before).abs();
        // A comparison with NaN is false, so that it is refused too.
        let is_alike = difference <= limit;
        if !is_alike {
            return Err(VolumetricFailure::WarmthSince {
                index: at,
                before: *before,
                seen: seen.value(),
                limit,
            });
        }
    }
    Ok(())
}

/// By how much the change since the references differs along the beam, in the worse direction.
fn change_of_beam(
    axis: Axis,
    beam: &BeamConfig,
    kept: &VolumeReferencesEntry,
    taken: &References,
) -> Result<Metres, Failure> {
    let section = "beam";
    let drift = beam_drift(beam).ok_or(VolumetricFailure::NotConfigured { section })?;
    let before = kept.content.beam("the journal", axis, drift)?;
    let now = taken.content.beam("just taken", axis, drift)?;
    let letter = AXES[axis.index()];
    let record = taken.content.beams.iter().find(|it| it.axis == letter);
    let (Some(before), Some(now), Some(record)) = (before, now, record) else {
        return Err(VolumetricFailure::NoReference { axis }.into());
    };
    let shift = before.beam_shift(now.end());
    let nodes = record.slider[0].positions_m.iter().copied().map(Metres);
    let seen = nodes.map(|it| before.displacement(it, now.slider(it), shift));
    let seen: Vec<_> = seen.collect();
    let range = |k: usize| range(seen.iter().map(|it| it[k].value()));
    Ok(Metres(range(0).max(range(1))))
}

/// Likewise of the roll.
fn change_of_roll(
    before: Option<&Function<Radians>>,
    now: Option<&Function<Radians>>,
) -> Result<Radians, VolumetricFailure> {
    let (Some(before), Some(now)) = (before, now) else {
        return Err(VolumetricFailure::NoRollReference);
    };
    let change = now.nodes().map(|it| (now.at(it) - before.at(it)).value());
    Ok(Radians(range(change)))
}

fn range(values: impl Iterator<Item = f64>) -> f64 {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), it| {
        (low.min(it), high.max(it))
    });
    (high - low).max(0.0)
}
