//! A first part: made with the displacements and rolls that the machine has this hour, which the second
//! memory then keeps, so that all later parts are made alike (system S4).
//!
//! Detectors watch while it is made, but what they see is left as it is; tables and
//! temperatures are corrected as ever. The recorder belongs to the loop meanwhile, takes all its
//! memory beforehand, and comes back when the loop is over.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};

use compensator::volumetric::Point;
use compensator::volumetric::online::{
    Coverage, MemoryError, RecorderSettings, StateMap, StateRecorder,
};
use units::Metres;

use crate::config::MachineConfig;
use crate::failure::Failure;
use crate::store::Store;
use crate::volumetric::MemoryName;
use crate::volumetric::handle::WorkVolume;
use crate::volumetric::path::PathFollowed;
use crate::volumetric::settings::work_volume;
use crate::volumetric::{
    Mover, Remembered, VolumetricCorrection, VolumetricFailure, VolumetricRecords, VolumetricState,
};
use machine::engine::{Corrected, Correction, Observed};

/// So many stretches may lie between two places of an axis that were met.
const GAP_STRETCHES: f64 = 2.0;

/// Corrects all but displacements and rolls, and records these.
#[derive(Debug)]
pub struct FirstPartCorrection {
    inner: VolumetricCorrection,
    /// Until it is handed back.
    recorder: Option<StateRecorder>,
    listens: Arc<AtomicBool>,
    back: Sender<StateRecorder>,
}

/// The host's side of what is recorded.
#[derive(Debug)]
pub struct PartRecorder {
    listens: Arc<AtomicBool>,
    back: Receiver<StateRecorder>,
}

/// What a first part is recorded against.
#[derive(Debug)]
pub struct FirstPart {
    /// To be told when the part begins.
    pub recorder: PartRecorder,
    records: VolumetricRecords,
}

impl FirstPartCorrection {
    /// For the machine of `config`, calibrated as `state`.
    ///
    /// # Errors
    /// As [`VolumetricCorrection::new`]; when the configuration does not say how far apart stops
    /// for references are, as states are kept as far apart.
    pub fn new(
        config: &MachineConfig,
        state: VolumetricState,
    ) -> Result<(Self, PartRecorder), VolumetricFailure> {
        let own = config.volumetric.as_ref().ok_or(VolumetricFailure::None)?;
        let section = "reference";
        let reference = own.reference;
        let reference = reference.ok_or(VolumetricFailure::NotConfigured { section })?;
        let spacing = Metres::from_mm(reference.step_mm);
        let settings = RecorderSettings {
            spacing,
            gap_max: spacing * GAP_STRETCHES,
        };
        let recorder = StateRecorder::new(&work_volume(own)?, settings)?;
        let inner = VolumetricCorrection::new(config, state)?.leaving_the_state();
        let (there, back) = channel();
        let listens = Arc::new(AtomicBool::new(false));
        let host = PartRecorder {
            listens: Arc::clone(&listens),
            back,
        };
        let own = Self {
            inner,
            recorder: Some(recorder),
            listens,
            back: there,
        };
        Ok((own, host))
    }
}

impl Correction for FirstPartCorrection {
    fn correct(&mut self, observed: &Observed<'_>) -> Corrected {
        let corrected = self.inner.correct(observed);
        let recorder = self.recorder.as_mut();
        let recorder = recorder.filter(|_| self.listens.load(Ordering::Relaxed));
        if let (Some(recorder), &[x, y, z]) = (recorder, observed.actual) {
            self.inner.record(Point::new(x, y, z), recorder);
        }
        corrected
    }
}

impl Drop for FirstPartCorrection {
    fn drop(&mut self) {
        if let Some(recorder) = self.recorder.take() {
            // Nobody waits for it: then it is not wanted.
            let _ = self.back.send(recorder);
        }
    }
}

impl PartRecorder {
    /// From now on what is seen belongs to the part.
    pub fn listen(&self) {
        self.listens.store(true, Ordering::Relaxed);
    }

    /// What was recorded, once the loop is over and its correction is gone.
    ///
    /// # Errors
    /// When nothing was recorded, or a stretch of an axis without states is too long.
    pub fn finish(self) -> Result<(StateMap, Coverage), MemoryError> {
        let recorder = self.back.try_recv().map_err(|_| MemoryError::Empty)?;
        recorder.finish()
    }
}

impl WorkVolume<'_> {
    /// Makes ready for a first part: corrected by all that is stored but for displacements and rolls,
    /// which stay as they are. The second memory in use counts for nothing: another is recorded.
    ///
    /// # Errors
    /// When there are no references to count from, or what is stored cannot be applied.
    pub fn first_part(&self, store: &Store) -> Result<(Mover, FirstPart), Failure> {
        let (state, records) = self.state_beneath(store, MemoryName::Second)?;
        let (correction, recorder) = FirstPartCorrection::new(self.core.config, state)?;
        let mover = self.mover(Box::new(correction))?;
        Ok((mover, FirstPart { recorder, records }))
    }

    /// Follows `points` as a first part, by what [`Self::first_part`] gave, and keeps it.
    ///
    /// # Errors
    /// Those of [`Self::follow`] and [`Self::keep_part`].
    pub(crate) fn follow_part(
        &mut self,
        store: &Store,
        (mut mover, part): (Mover, FirstPart),
        points: Vec<Vec<Metres>>,
    ) -> Result<(PathFollowed, Remembered), Failure> {
        let followed = self.follow(&mut mover, points, true, || part.recorder.listen())?;
        let kept = self.keep_part(store, mover, part)?;
        Ok((followed, kept))
    }

    /// The part is made: stores and activates what `mover` was left with as the second memory.
    ///
    /// # Errors
    /// When a stretch that was gone along was not seen by a detector; when the store cannot be
    /// written.
    pub fn keep_part(
        &mut self,
        store: &Store,
        mover: Mover,
        part: FirstPart,
    ) -> Result<Remembered, Failure> {
        drop(mover);
        let recorded = part.recorder.finish().map_err(VolumetricFailure::from)?;
        let (memory, source) = (MemoryName::Second, "run, first part");
        self.keep_memory(store, memory, &part.records, recorded, source)
    }
}
