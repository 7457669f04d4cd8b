//! The table that a person reads a line of.

use core::time::Duration;

use units::{Approach, Radians};

use crate::failure::Failure;
use crate::rotary::Way;
use crate::rotary::placement::LOOK_EVERY;
use crate::rotary::table::RotaryTable;

/// How long nothing has to be done where there is no machine.
pub(super) const IDLE: Duration = Duration::from_secs(1);

/// A table that is brought to a line's nominal angle, or that nobody but the person turns.
pub(super) trait Stand {
    /// Whether an answer makes the table turn.
    fn turns(&self) -> bool;

    /// Brings it to `nominal`, in the direction `approach` from a line `spacing` before.
    fn go_to(
        &mut self,
        nominal: Radians,
        approach: Approach,
        spacing: Radians,
    ) -> Result<(), Failure>;

    /// By how much its reading is beyond `nominal`.
    fn beyond(&self, nominal: Radians) -> Result<Radians, Failure>;

    /// Lives on; how long nothing has to be done then.
    fn live(&mut self) -> Result<Duration, Failure>;

    /// Monotonic time of the machine, seconds; 0 without one.
    fn now_s(&self) -> f64;
}

/// A table that a person turns by hand: its drive is off, and what is typed says where it is. The machine lives on,
/// where it is there.
pub(super) struct ByHand<'s, 't>(pub(super) Option<&'s mut RotaryTable<'t>>);

impl Stand for ByHand<'_, '_> {
    fn turns(&self) -> bool {
        false
    }

    fn go_to(&mut self, _: Radians, _: Approach, _: Radians) -> Result<(), Failure> {
        Ok(())
    }

    fn beyond(&self, _: Radians) -> Result<Radians, Failure> {
        Ok(Radians::ZERO)
    }

    fn live(&mut self) -> Result<Duration, Failure> {
        self.0.as_mut().map_or(Ok(IDLE), |it| it.live())
    }

    fn now_s(&self) -> f64 {
        self.0.as_ref().map_or(0.0, |it| it.now_s())
    }
}

impl Stand for RotaryTable<'_> {
    fn turns(&self) -> bool {
        true
    }

    fn go_to(
        &mut self,
        nominal: Radians,
        approach: Approach,
        spacing: Radians,
    ) -> Result<(), Failure> {
        // Always from the same side within a pass, so that lost motion is in all of its lines alike.
        if -self.beyond(nominal)?.value() * approach.sign() < spacing.value() / 4.0 {
            self.turn_to(nominal - spacing * (approach.sign() / 2.0), Way::Shortest)?;
        }
        self.turn_to(nominal, Way::Shortest)?;
        self.rest()
    }

    fn beyond(&self, nominal: Radians) -> Result<Radians, Failure> {
        let beyond = self.reading()? - nominal;
        Ok(beyond - beyond.whole_turns())
    }

    fn live(&mut self) -> Result<Duration, Failure> {
        let look = self.core.now() + LOOK_EVERY;
        self.core.tick(look)?;
        Ok(Duration::ZERO)
    }

    fn now_s(&self) -> f64 {
        self.core.now().seconds()
    }
}
