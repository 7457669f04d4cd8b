//! Rotary axes: the zero on the index mark, and moves over any number of turns.

use core::time::Duration;

use drivers::device::AxisCommand;
use units::{Approach, Radians, RadiansPerSecond, RadiansPerSecondSquared};

use crate::failure::Failure;
use crate::rotary::DirectionName;
use crate::rotary::settings;
use crate::rotary::table::RotaryTable;

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

impl RotaryTable<'_> {
    /// Turns the table to the encoder's index mark and makes that its zero.
    ///
    /// # Errors
    /// Without a `zero` section; when the drive finds no mark.
    pub fn zero(&mut self) -> Result<(), Failure> {
        let config = self.config;
        let Some(zero) = &config.zero else {
            return Err(Failure::NotConfigured {
                axis: self.axis.to_owned(),
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
        self.core.set_zeroed(self.axis, false)?;
        self.core.enable(self.axis)?;
        self.core
            .turning(self.axis)?
            .command(command, "zero", limit)?;
        self.core.set_zeroed(self.axis, true)?;
        Ok(())
    }

    /// Turns the table to `angle`, uncorrected, and returns the target that
    /// counts on over the turns.
    ///
    /// # Errors
    /// Before anything moves: not zeroed. While moving: whatever stops the machine.
    pub fn turn_to(&mut self, angle: Radians, way: Way) -> Result<Radians, Failure> {
        self.core.require_zeroed(self.axis)?;
        let config = self.config;
        let near = Radians::from_arcsec(config.position_window_arcsec);
        let speed = RadiansPerSecond(config.speed_deg_per_s.to_radians());
        let here = self.reading()?;
        let target = way.target(here, angle, near);
        let limit = Duration::from_secs_f64(config.move_timeout_s);
        self.turn(target, speed, limit)?;
        Ok(target)
    }

    /// One profile position move, awaited for as long as `limit`.
    pub(crate) fn turn(
        &mut self,
        target: Radians,
        speed: RadiansPerSecond,
        limit: Duration,
    ) -> Result<(), Failure> {
        let command = self.move_command(target, speed);
        Ok(self
            .core
            .turning(self.axis)?
            .command(command, "move", limit)?)
    }

    pub(super) fn move_command(
        &self,
        target: Radians,
        speed: RadiansPerSecond,
    ) -> AxisCommand<Radians> {
        let acceleration = self.config.acceleration_deg_per_s2.to_radians();
        AxisCommand::MoveTo {
            target,
            speed,
            acceleration: RadiansPerSecondSquared(acceleration),
        }
    }

    /// Where the drive says that the zeroed table is.
    pub(crate) fn reading(&self) -> Result<Radians, Failure> {
        let reading = self.core.devices().rotary_reading(self.axis)?;
        let reading = reading.expect("an axis that was zeroed has been read");
        Ok(reading.position)
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
