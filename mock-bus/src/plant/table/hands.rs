//! What hands and faults do to the table of a plant; a machine without one has nothing of it.

use units::Radians;

use super::{Sight, Table};
use crate::plant::Plant;

impl Plant {
    /// Somebody takes up the table's plate, turns it by so many lines and fixes it again.
    pub fn turn_plate(&mut self, lines: f64) {
        if let Some(table) = self.machine.of_mut::<Table>() {
            table.turn_plate(lines);
        }
    }

    /// Somebody reads a line of the table's plate through the microscope; nothing is turned.
    pub fn sight_line(&mut self, line: u32) -> Sight {
        let now = self.now;
        let Some(table) = self.machine.of_mut::<Table>() else {
            return Sight::default();
        };
        let reading = table.train.mass.position_at(now);
        table.sight(line, reading)
    }

    /// Covers a line of the table's plate with dirt, or wipes it.
    pub fn set_line_smudged(&mut self, line: u32, smudged: bool) {
        if let Some(table) = self.machine.of_mut::<Table>() {
            table.set_smudged(line, smudged);
        }
    }

    /// Scratches the plate beside a line, which then gives a second edge, or mends it.
    pub fn set_line_scratched(&mut self, line: u32, scratched: bool) {
        if let Some(table) = self.machine.of_mut::<Table>() {
            table.set_scratched(line, scratched);
        }
    }

    /// Lets the line detector see a line so far beside its place; zero is where it is.
    pub fn shift_line(&mut self, line: u32, shift: Radians) {
        if let Some(table) = self.machine.of_mut::<Table>() {
            table.shift_line(line, shift);
        }
    }

    /// Lets the line detector see nothing, or everything again.
    pub fn set_detector_dead(&mut self, dead: bool) {
        if let Some(table) = self.machine.of_mut::<Table>() {
            table.set_detector_dead(dead);
        }
    }
}
