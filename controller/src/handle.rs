//! What the handles of all kinds work on.

use core::ops::{Deref, DerefMut};

use drivers::device::Environment;
use machine::records::ThermometersEntry;
use units::Metres;

use crate::config::{ConfigHash, MachineConfig};
use crate::connected::Machine;
use crate::failure::Failure;
use crate::memories::Memories;
use crate::run;
use crate::store::{IdentityRecord, InstrumentRecord, RecordHead};

/// A machine below a handle, and the configuration it was assembled of.
pub(crate) struct Core<'m> {
    pub(crate) machine: &'m mut machine::Machine,
    pub(crate) config: &'m MachineConfig,
    pub(crate) config_hash: &'m ConfigHash,
}

impl<'m> Core<'m> {
    /// What a handle of `machine` works on, and where its kind remembers something.
    pub(crate) const fn of(machine: &'m mut Machine) -> (Self, &'m mut Memories) {
        let core = Self {
            machine: &mut machine.core,
            config: &machine.config,
            config_hash: &machine.config_hash,
        };
        (core, &mut machine.memories)
    }
}

impl Core<'_> {
    /// The head of a record without measurements, which says who this machine is.
    pub(crate) fn this_machine(&self, axis: &str) -> RecordHead {
        run::this_machine(self.machine, (self.config, self.config_hash), axis)
    }

    /// What the records say of the instrument `name`.
    pub(crate) fn instrument_record(&self, name: &str) -> InstrumentRecord {
        let config = &self.config.instrument[name];
        let corrections = config.corrections();
        InstrumentRecord {
            name: name.to_owned(),
            identity: self.devices().identity(name).unwrap_or_default().name,
            air_corrected: corrections.air,
            material_corrected: corrections.material_expansion.is_some(),
            dead_path_corrected: corrections.dead_path.is_some(),
            cosine_corrected: corrections.cosine.is_some(),
            standard_uncertainty_m: config.instrument_standard_uncertainty_nm * 1e-9,
            switched_off: config
                .switched_off()
                .iter()
                .map(|it| it.name.to_owned())
                .collect(),
            certificates: config.certificate_records(),
        }
    }

    /// As the machine's, of an instrument whose certificates hold.
    ///
    /// # Errors
    /// When one of them does not; as the machine's.
    pub(crate) fn use_instrument(&mut self, name: &str) -> Result<(), Failure> {
        run::require_certified(self.config, &format!("instrument.{name}."))?;
        Ok(self.machine.use_instrument(name)?)
    }

    /// What the sensors of the instrument `name` say, with what their certificates correct.
    pub(crate) fn environment_of(&self, name: &str) -> Result<Environment, Failure> {
        let seen = self.devices().instrument(name)?.environment();
        Ok(self.config.instrument[name].certified(&seen))
    }

    /// What the thermometers of the machine's analog modules show now, for a journal; `None` where it has none.
    pub(crate) fn thermometers(&self) -> Option<ThermometersEntry> {
        let modules = self.config.analog.iter();
        let named = modules.flat_map(|(module, it)| {
            let channels = it.temperature_channels().iter();
            channels.map(move |channel| format!("{module} {channel}"))
        });
        let names: Vec<String> = named.collect();
        if names.is_empty() {
            return None;
        }
        let mut shown = vec![None; names.len()];
        self.devices().hear_temperatures(&mut shown);
        let shown = shown.into_iter();
        Some(ThermometersEntry {
            names,
            temperatures_c: shown.map(|it| Some(it?.celsius?.value())).collect(),
            at_s: self.now().seconds(),
        })
    }

    /// Tells what sensors of the instrument `name` read that they were not calibrated at, and of `way`, how far the
    /// axis goes, what its scale was not.
    pub(crate) fn tell_beyond_certified(
        &mut self,
        name: &str,
        way: &[Metres],
    ) -> Result<(), Failure> {
        let seen = self.devices().instrument(name)?.environment();
        let config = &self.config.instrument[name];
        let of_sensors = config.beyond_certified(&seen).into_iter();
        let of_scale = way.iter().find_map(|it| config.scale_beyond(*it));
        for beyond in of_sensors.chain(of_scale) {
            let told = format!("instrument {name}, {beyond}");
            self.machine.observer().warning(&told);
        }
        Ok(())
    }

    /// What the records say of the drive of `axis`.
    pub(crate) fn drive_record(&self, axis: &str) -> IdentityRecord {
        run::drive_record(self.machine, axis)
    }
}

impl Deref for Core<'_> {
    type Target = machine::Machine;

    fn deref(&self) -> &machine::Machine {
        self.machine
    }
}

impl DerefMut for Core<'_> {
    fn deref_mut(&mut self) -> &mut machine::Machine {
        self.machine
    }
}

/// That `axis` is none of the `known` ones.
pub(crate) fn no_such_axis(axis: &str, known: &[String]) -> Failure {
    Failure::Machine(machine::Failure::NoSuchAxis {
        axis: axis.to_owned(),
        known: known.join(", "),
    })
}
