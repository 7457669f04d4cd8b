//! Lines that a detector shows as a voltage: sampled with the angle while the table turns.

use core::time::Duration;

use compensator::rotary::{
    LineShape, LinesSeen, SAMPLES_MIN, SignalSample, WIDTHS_APART, lines_in, width_seen,
};
use units::{Radians, RadiansPerSecond, Volts};

use crate::config::MachineConfig;
use crate::failure::Failure;
use crate::pairing::Pairing;
use crate::rotary::failure::RotaryFailure;
use crate::rotary::sweep::Turn;
use crate::rotary::table::RotaryTable;
use crate::rotary::{LineSideName, LineSignalConfig, RotaryConfig};
use crate::run::missing;

/// So many samples more than the window of the first and the last line are taken.
const SPARE_SAMPLES: f64 = 4.0;
/// How long the machine lives at most between two looks at the samples; each frame ends a tick.
const TICK_MAX: Duration = Duration::from_millis(100);

impl LineSignalConfig {
    fn shape(&self, sampling: Duration) -> LineShape {
        LineShape {
            sampling,
            level: Volts(self.level_v),
            is_above: self.line == LineSideName::Above,
            width: Radians::from_arcsec(self.width_arcsec),
        }
    }

    /// How often the voltage is read together with the angle.
    fn sampling(&self, config: &MachineConfig, rotary: &RotaryConfig) -> Option<Duration> {
        let sync_s = config.can.get(&rotary.node.bus)?.sync_period_ms * 1e-3;
        let every = config.analog.get(&self.analog)?.every_syncs().unwrap_or(1);
        Some(Duration::from_secs_f64(sync_s * f64::from(every)))
    }

    /// The fastest turn, in degrees a second, at which enough samples fall into a line; `None` without bus or module.
    pub(super) fn speed_max(&self, config: &MachineConfig, rotary: &RotaryConfig) -> Option<f64> {
        let sampling_s = self.sampling(config, rotary)?.as_secs_f64();
        Some(self.width_arcsec / 3600.0 / (SAMPLES_MIN * sampling_s))
    }

    /// How far the table turns at `speed` before the first line may come.
    pub(super) fn run_up(&self, table: &RotaryTable<'_>, speed: RadiansPerSecond) -> Radians {
        let sampling = self.sampling(table.core.config, table.config);
        let spare_s = sampling.unwrap_or_default().as_secs_f64() * SPARE_SAMPLES;
        Radians::from_arcsec(self.width_arcsec * WIDTHS_APART / 2.0)
            + Radians(speed.value() * spare_s)
    }

    /// Which of the module's readings it is.
    pub(super) fn place(&self, config: &MachineConfig) -> Option<usize> {
        let channels = &config.analog.get(&self.analog)?.channels;
        channels.iter().position(|it| *it == self.channel)
    }
}

impl RotaryTable<'_> {
    /// # Errors
    /// When no detector reads lines while the table turns.
    pub(super) fn require_detector(&self) -> Result<(), Failure> {
        match self.config.has_detector() {
            true => Ok(()),
            false => Err(missing(self.axis, "line_detector` or `line_signal")),
        }
    }

    /// What the detector shows in a turn.
    pub(super) fn scan(
        &mut self,
        signal: &LineSignalConfig,
        turn: &Turn,
        lines: u32,
    ) -> Result<LinesSeen, Failure> {
        let sampling = signal.sampling(self.core.config, self.config);
        let shape = signal.shape(sampling.unwrap_or_default());
        let samples = self.sample_turn(signal, turn)?;
        let seen = lines_in(&samples, &shape);
        if seen.lines.is_empty() && !seen.has_gaps() {
            return Err(self.nothing_seen(signal, &samples, lines, &shape));
        }
        Ok(seen)
    }

    fn sample_turn(
        &mut self,
        signal: &LineSignalConfig,
        turn: &Turn,
    ) -> Result<Vec<SignalSample>, Failure> {
        let config = self.core.config;
        let place = signal.place(config).unwrap_or_default();
        // Whatever the module leaves out, both are of one SYNC.
        let sync_s = config.can[&self.config.node.bus].sync_period_ms * 1e-3;
        let mut pairing = Pairing::of(Duration::from_secs_f64(sync_s));
        let mut samples = Vec::new();
        let limit = self.core.patience().of(turn.limit);
        let begun = self.core.now();
        let command = self.move_command(turn.target, turn.speed);
        self.core.turning(self.axis)?.begin(command)?;
        loop {
            let deadline = self.core.now() + TICK_MAX;
            self.core.tick(deadline)?;
            let arrived = self.core.turning(self.axis)?.outcome();
            samples.extend(self.sample(signal, place, &mut pairing)?);
            if let Some(outcome) = arrived {
                outcome?;
                return Ok(samples);
            }
            if self.core.now().since(begun) > limit {
                return Err(Failure::Machine(machine::Failure::Overdue {
                    device: self.axis.to_owned(),
                    step: "move",
                    waited: limit,
                }));
            }
        }
    }

    /// The newest angle and voltage, when they belong together and are new.
    fn sample(
        &self,
        signal: &LineSignalConfig,
        place: usize,
        pairing: &mut Pairing,
    ) -> Result<Option<SignalSample>, Failure> {
        let devices = self.core.devices();
        let angle = devices.rotary_reading(self.axis)?;
        let analog = devices.analog(&signal.analog)?;
        let (Some(angle), Some(voltages)) = (angle, analog.reading()) else {
            return Ok(None);
        };
        if !pairing.is_pair(angle.at, voltages.at) {
            return Ok(None);
        }
        Ok(voltages.volts.get(place).map(|seen| SignalSample {
            position: angle.position,
            signal: *seen,
            at: voltages.at,
        }))
    }

    fn nothing_seen(
        &self,
        signal: &LineSignalConfig,
        samples: &[SignalSample],
        lines: u32,
        shape: &LineShape,
    ) -> Failure {
        let seen = || samples.iter().map(|it| it.signal.value());
        let (from, to) = (seen().reduce(f64::min), seen().reduce(f64::max));
        let level = format!("beyond {:.3} V", signal.level_v);
        let beyond = match width_seen(samples, shape) {
            Some(width) => format!("{level} for {:.1} arcsec", width.arcsec()),
            None => format!("never {level}"),
        };
        RotaryFailure::NoSignal {
            axis: self.axis.to_owned(),
            lines,
            input: format!("input {} of {}", signal.channel, signal.analog),
            showed: from.zip(to).map_or_else(
                || "no voltage that came with an angle".to_owned(),
                |(from, to)| format!("{from:.3} to {to:.3} V, {beyond}"),
            ),
            width: Radians::from_arcsec(signal.width_arcsec),
        }
        .into()
    }
}

#[cfg(test)]
mod tests {
    use crate::config::validate::told;
    use crate::edit::{Edit, with_line_signal};

    const TABLE: &str = include_str!("../../../configs/machines/rotary.toml");

    #[test]
    fn what_cannot_be_read_is_refused_with_what_would_fit() {
        let sound = with_line_signal(TABLE);
        let check = |from: &str, to: &str, key: &str, says: &str| {
            told::check(&sound, from, to, &format!("rotary.c.{key}"), says);
        };
        check(
            "\"photo\"",
            "\"foto\"",
            "line_signal.analog",
            "no analog module `foto`",
        );
        check(
            "channel = 2",
            "channel = 3",
            "line_signal.channel",
            "does not read channel 3",
        );
        check(
            "level_v = 2.2",
            "level_v = 5.0",
            "line_signal.level_v",
            "largest voltage",
        );
        check(
            "arcsec = 1500.0",
            "arcsec = 4501.0",
            "line_signal.width_arcsec",
            "more than a quarter",
        );
        let speed = "placement\nspeed_deg_per_s = 10.0";
        let fast = speed.edit("10.0", "10.5");
        check(
            speed,
            &fast,
            "calibrate.speed_deg_per_s",
            "too fast at 10.5",
        );
        let both = "[rotary.c.line_detector]\n\n[rotary.c.line_signal]";
        check(
            "[rotary.c.line_signal]",
            both,
            "calibrate",
            "`line_detector` and `line_signal`",
        );
    }
}
