//! Which table is calibrated or verified, whether or not its machine is there: what is read of a plate
//! by a person needs none.

use compensator::rotary::PeriodicCompensation;
use units::{Radians, RadiansPerSecond};

use crate::config::ConfigHash;
use crate::failure::Failure;
use crate::made_by::made_by;
use crate::rotary::in_use::TableInUse;
use crate::rotary::plate_run::PlateRun;
use crate::rotary::settings;
use crate::rotary::table::RotaryTable;
use crate::rotary::{RotaryCalibrateConfig, RotaryConfig, RotaryContent};
use crate::run::{missing, utc_now};
use crate::store::{
    IdentityRecord, InstrumentRecord, JournalHeader, RecordHead, SCHEMA_VERSION, Store,
};
use machine::Stage;

/// A rotary axis as its procedures know it.
pub(crate) struct Subject<'a> {
    pub(crate) axis: &'a str,
    pub(crate) config: &'a RotaryConfig,
    pub(crate) hash: &'a ConfigHash,
    /// Who it is: a head without measurements.
    pub(crate) here: RecordHead,
    /// Whether the drive was asked who it is; without, it is who the configuration says.
    pub(crate) asked: bool,
}

impl<'m> RotaryTable<'m> {
    pub(super) fn subject(&self) -> Subject<'m> {
        Subject {
            axis: self.axis,
            config: self.config,
            hash: self.core.config_hash,
            here: self.core.this_machine(self.axis),
            asked: true,
        }
    }
}

impl Subject<'_> {
    /// The plate and how it is read, as configured.
    pub(super) fn plate_run(&self) -> Result<(PlateRun, RotaryCalibrateConfig), Failure> {
        let config = self.config;
        let run = config.calibrate.clone();
        let run = run.ok_or_else(|| missing(self.axis, "calibrate"))?;
        let speed = run.speed_deg_per_s.unwrap_or(config.speed_deg_per_s);
        let plate = PlateRun {
            plate: run.plate.clone(),
            lines: run.lines,
            passes: run.passes,
            speed: RadiansPerSecond(speed.to_radians()),
            noise: Radians::from_arcsec(run.reading_noise_arcsec),
            closure_limit: Some(Radians::from_arcsec(run.closure_limit_arcsec)),
            stage: Stage::Calibrate,
            sighting: config.sighting.as_ref().map(Into::into),
        };
        Ok((plate, run))
    }

    pub(super) fn header(
        &self,
        verb: &str,
        run: &PlateRun,
        calibration: Option<String>,
    ) -> JournalHeader {
        let here = &self.here;
        JournalHeader {
            schema_version: SCHEMA_VERSION,
            verb: verb.to_owned(),
            machine: here.machine.clone(),
            stage_serial: here.stage_serial.clone(),
            config_hash: here.config_hash.clone(),
            axis: self.axis.to_owned(),
            drive: here.drive.clone(),
            instrument: plate_record(run),
            started: utc_now(),
            program: Some(made_by()),
            calibration,
            targets_m: Vec::new(),
            runs: run.passes,
            approach_m: None,
        }
    }

    /// Proves that a table error can be undone within the limits of the configuration.
    pub(super) fn prepare(
        &self,
        content: &RotaryContent,
        id: &str,
    ) -> Result<PeriodicCompensation, Failure> {
        let config = self.config.compensation.as_ref();
        let config = config.ok_or_else(|| missing(self.axis, "compensation"))?;
        settings::periodic_compensation(config, self.axis, content.table(id)?)
    }

    /// The drive, by the serial number in `records` where either side could not be asked for one: any drive
    /// of that product will do then, as for a table measured elsewhere.
    pub(super) fn drive_beside(&self, records: &IdentityRecord) -> IdentityRecord {
        let here = &self.here.drive;
        let product = |it: &IdentityRecord| (it.device_type, it.vendor, it.product);
        let unknown = (!self.asked && here.serial == 0) || records.serial == 0;
        if unknown && product(here) == product(records) {
            return records.clone();
        }
        here.clone()
    }

    /// The calibration that `store` says is active, after checking that it belongs to this machine.
    pub(super) fn in_use(&self, store: &Store) -> Result<Option<TableInUse>, Failure> {
        let id = store.active(self.axis)?.current;
        id.map(|id| self.usable(store, &id)).transpose()
    }

    /// The calibration `id`, after the same check.
    pub(super) fn usable(&self, store: &Store, id: &str) -> Result<TableInUse, Failure> {
        let record = store.load::<RotaryContent>(id)?;
        let here = RecordHead {
            drive: self.drive_beside(&record.head.drive),
            ..self.here.clone()
        };
        record.head.belongs_to(id, &here, self.hash)?;
        let compensation = self.prepare(&record.content, id)?;
        Ok(TableInUse::new(id, &record, compensation)?)
    }
}

/// The plate is what measures.
pub(super) fn plate_record(run: &PlateRun) -> InstrumentRecord {
    InstrumentRecord {
        name: run.plate.clone(),
        identity: format!("plate with {} lines", run.lines),
        ..InstrumentRecord::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drive(product: u32, serial: u32) -> IdentityRecord {
        IdentityRecord {
            product,
            serial,
            ..IdentityRecord::default()
        }
    }

    #[test]
    fn a_drive_that_could_not_be_asked_is_the_one_in_the_records_if_it_is_of_that_product() {
        let config = crate::config::parse(
            include_str!("../../../configs/machines/rotary.toml"),
            "m.toml",
        );
        let loaded = config.unwrap();
        let (axis, rotary) = loaded.config.rotary.first_key_value().unwrap();
        let beside = |asked, here, records: &IdentityRecord| {
            let subject = Subject {
                axis,
                config: rotary,
                hash: &loaded.hash,
                here: RecordHead {
                    drive: here,
                    ..RecordHead::default()
                },
                asked,
            };
            subject.drive_beside(records)
        };
        assert_eq!(beside(false, drive(7, 0), &drive(7, 3001)).serial, 3001);
        assert_eq!(beside(true, drive(7, 0), &drive(7, 3001)).serial, 0);
        assert_eq!(beside(true, drive(7, 3001), &drive(7, 0)).serial, 0);
        assert_eq!(beside(false, drive(8, 0), &drive(7, 3001)), drive(8, 0));
        assert_eq!(beside(false, drive(7, 3002), &drive(7, 3001)).serial, 3002);
    }
}
