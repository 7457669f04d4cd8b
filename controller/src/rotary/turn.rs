//! Rotary axes: the zero on the index mark, and moves over any number of turns.

use core::time::Duration;

use drivers::device::AxisCommand;
use units::{Approach, Radians, RadiansPerSecond, RadiansPerSecondSquared};

use crate::connected::{Machine, RotaryMemory};
use crate::failure::Failure;
use crate::rotary::settings;
use crate::rotary::{DirectionName, RotaryConfig};

/// Which way round to an angle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// Less than half a turn, whichever way that is.
    Shortest,
    /// With growing angles, less than a turn.
    Forward,
    /// With falling angles, less than a turn.
    Reverse,
    /// As many turns as the angle says: 0° and 720° are two turns apart.
    Turns,
}

impl Way {
    /// The target that counts on over the turns, from `here` to `angle`. An angle no farther
    /// than `near` from `here` is where the axis is: no way leads round to it.
    pub fn target(self, here: Radians, angle: Radians, near: Radians) -> Radians {
        let turn = Radians::TURN.value();
        let away = angle - here;
        let shortest = (away - away.whole_turns()).value();
        let is_here = shortest.abs() <= near.value();
        match self {
            Self::Turns => angle,
            Self::Forward if shortest < 0.0 && !is_here => here + Radians(shortest + turn),
            Self::Reverse if shortest > 0.0 && !is_here => here + Radians(shortest - turn),
            Self::Shortest | Self::Forward | Self::Reverse => here + Radians(shortest),
        }
    }
}

impl Machine {
    /// The configuration of the rotary axis `axis`.
    ///
    /// # Errors
    /// When there is no such axis.
    pub fn rotary_config(&self, axis: &str) -> Result<&RotaryConfig, Failure> {
        let config = self.config.rotary.get(axis);
        config.ok_or_else(|| self.no_such_rotary(axis))
    }

    /// Turns the rotary axis `axis` to the encoder's index mark and makes that its zero.
    ///
    /// # Errors
    /// Without a `zero` section; when the drive finds no mark.
    pub fn zero_rotary(&mut self, axis: &str) -> Result<(), Failure> {
        let config = self.rotary_config(axis)?;
        let Some(zero) = &config.zero else {
            return Err(Failure::NotConfigured {
                axis: axis.to_owned(),
                section: "zero",
            });
        };
        let command = AxisCommand::HomeNextIndex {
            position: Radians::from_degrees(zero.index_deg),
            speed: RadiansPerSecond(zero.index_speed_deg_per_s.to_radians()),
            approach: match zero.index_direction {
                DirectionName::Forward => Approach::Forward,
                DirectionName::Reverse => Approach::Reverse,
            },
        };
        let limit = settings::index_limit(config).unwrap_or_default() + Duration::from_secs(5);
        self.enable(axis)?;
        self.turn_command(axis, command, "zero", limit)?;
        self.set_zeroed(axis, true)?;
        Ok(())
    }

    /// Turns the rotary axis `axis` to `angle`, uncorrected, and returns the target that
    /// counts on over the turns.
    ///
    /// # Errors
    /// Before anything moves: not zeroed. While moving: whatever stops the machine.
    pub fn turn_to(&mut self, axis: &str, angle: Radians, way: Way) -> Result<Radians, Failure> {
        self.require_zeroed(axis)?;
        let config = self.rotary_config(axis)?;
        let near = Radians::from_arcsec(config.position_window_arcsec);
        let speed = RadiansPerSecond(config.speed_deg_per_s.to_radians());
        let here = self.table_reading(axis)?;
        let target = way.target(here, angle, near);
        let limit = Duration::from_secs_f64(config.move_timeout_s);
        self.turn(axis, target, speed, limit)?;
        Ok(target)
    }

    /// One profile position move, awaited for as long as `limit`.
    pub(crate) fn turn(
        &mut self,
        axis: &str,
        target: Radians,
        speed: RadiansPerSecond,
        limit: Duration,
    ) -> Result<(), Failure> {
        let config = self.rotary_config(axis)?;
        let command = AxisCommand::MoveTo {
            target,
            speed,
            acceleration: RadiansPerSecondSquared(config.acceleration_deg_per_s2.to_radians()),
        };
        Ok(self.turn_command(axis, command, "move", limit)?)
    }

    /// Where the drive says that the zeroed rotary axis `axis` is.
    pub(crate) fn table_reading(&self, axis: &str) -> Result<Radians, Failure> {
        let reading = self.rotary_reading(axis)?;
        let reading = reading.expect("an axis that was zeroed has been read");
        Ok(reading.position)
    }

    /// What is known about the rotary axis `axis`.
    pub(crate) fn remember_table(&mut self, axis: &str) -> &mut RotaryMemory {
        self.rotary_memory.entry(axis.to_owned()).or_default()
    }

    fn no_such_rotary(&self, axis: &str) -> Failure {
        Failure::Machine(machine::Failure::NoSuchAxis {
            axis: axis.to_owned(),
            known: self.rotary_names().join(", "),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(way: Way, here_deg: f64, angle_deg: f64, expected_deg: f64) {
        let here = Radians::from_degrees(here_deg);
        let angle = Radians::from_degrees(angle_deg);
        let seen = way.target(here, angle, Radians::from_arcsec(1.0)).degrees();
        assert!((seen - expected_deg).abs() < 1e-9, "{seen}");
    }

    #[test]
    fn the_shortest_way_crosses_the_seam_and_counts_on() {
        check(Way::Shortest, 350.0, 10.0, 370.0);
        check(Way::Shortest, 1090.0, 350.0, 1070.0);
        check(Way::Shortest, -10.0, 350.0, -10.0);
    }

    #[test]
    fn a_given_direction_leads_round_less_than_a_turn() {
        check(Way::Forward, 350.0, 340.0, 700.0);
        check(Way::Forward, 350.0, 10.0, 370.0);
        check(Way::Reverse, 10.0, 20.0, -340.0);
        check(Way::Reverse, 730.0, 5.0, 725.0);
    }

    #[test]
    fn no_way_leads_round_to_where_the_axis_is() {
        check(Way::Forward, 10.0 + 1e-5, 10.0, 10.0);
        check(Way::Reverse, 370.0 - 1e-5, 10.0, 370.0);
    }

    #[test]
    fn turns_are_counted_where_that_is_asked_for() {
        check(Way::Turns, 5.0, 725.0, 725.0);
        check(Way::Turns, 5.0, -725.0, -725.0);
    }
}
