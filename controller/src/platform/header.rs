//! What a platform's runs write down before anything is measured.

use units::Metres;

use crate::failure::Failure;
use crate::made_by::made_by;
use crate::platform::ArrangementEntry;
use crate::platform::handle::AlignmentPlatform;
use crate::platform::{PlatformEntry, PlatformLog};
use crate::run::{settle, utc_now};
use crate::store::{
    IdentityRecord, InstrumentRecord, Journal, JournalHeader, SCHEMA_VERSION, Store,
};

impl AlignmentPlatform<'_> {
    /// A journal of the platform with its first two lines; it is on the disk when this returns.
    pub(crate) fn journal_header(
        &mut self,
        store: &Store,
        verb: &str,
        runs: u32,
        calibration: Option<String>,
        tolerance: Option<Metres>,
    ) -> Result<Journal<PlatformLog>, Failure> {
        let header = self.header(verb, runs, calibration)?;
        let mut journal = store.create_journal(&header)?;
        let screws = &self.state.screws;
        journal.write(&PlatformEntry::Arrangement(ArrangementEntry {
            axes: screws.iter().map(|it| it.axis.clone()).collect(),
            edge_m: Metres::from_mm(self.config.edge_mm).value(),
            tolerance_m: tolerance.map(Metres::value),
            camera_u: tolerance.map(|_| self.camera_u().into()),
        }))?;
        settle(&mut self.core, store)?;
        Ok(journal)
    }

    fn header(
        &self,
        verb: &str,
        runs: u32,
        calibration: Option<String>,
    ) -> Result<JournalHeader, Failure> {
        Ok(JournalHeader {
            schema_version: SCHEMA_VERSION,
            verb: verb.to_owned(),
            machine: self.core.config.machine.name.clone(),
            stage_serial: self.core.config.machine.stage_serial.clone(),
            config_hash: self.core.config_hash.as_str().to_owned(),
            axis: "platform".into(),
            drive: IdentityRecord::default(),
            instrument: self.camera_record()?,
            started: utc_now(),
            program: Some(made_by()),
            calibration,
            targets_m: Vec::new(),
            runs,
            approach_m: None,
        })
    }

    /// Writes down what the machine's thermometers show, where it has some.
    pub(super) fn note_thermometers(
        &self,
        journal: &mut Journal<PlatformLog>,
    ) -> Result<(), Failure> {
        if let Some(shown) = self.core.thermometers() {
            journal.write(&PlatformEntry::Thermometers(shown))?;
        }
        Ok(())
    }

    pub(crate) fn camera_record(&self) -> Result<InstrumentRecord, Failure> {
        let name = self.config.camera.clone();
        let identity = self.core.devices().identities().remove(&name);
        Ok(InstrumentRecord {
            identity: identity.unwrap_or_default().name,
            name,
            ..InstrumentRecord::default()
        })
    }

    /// The calibrations in use, as `AXIS=NAME` for each screw that has one.
    pub(crate) fn calibrations_in_use(&self) -> Result<Option<String>, Failure> {
        let screws = self.state.screws.iter();
        let named =
            screws.filter_map(|it| Some(format!("{}={}", it.axis, it.calibration.as_ref()?)));
        let names = named.collect::<Vec<_>>().join(" ");
        Ok(Some(names).filter(|it| !it.is_empty()))
    }
}
