//! What no device knows about a table: for tests and reports that judge.

use units::{Radians, Time};

use crate::plant::parts::actuator::Actuator;

use super::Table;
use crate::plant::truth::Truth;

/// A look at a rotary table behind all sensors. Angles count on over the turns.
#[derive(Clone, Copy, Debug)]
pub struct TableTruth<'a> {
    table: &'a Table,
    now: Time,
}

impl<'a> Truth<'a> {
    /// The rotary table, where the machine is one.
    pub fn table(&self) -> Option<TableTruth<'a>> {
        let plant = self.plant;
        let table = plant.machine.of::<Table>()?;
        Some(TableTruth::new(table, plant.now))
    }
}

impl<'a> TableTruth<'a> {
    const fn new(table: &'a Table, now: Time) -> Self {
        Self { table, now }
    }

    /// Where the table is.
    pub fn angle(&self) -> Radians {
        Radians(self.table.true_angle(self.reading().value()))
    }

    /// What the encoder reads from its own zero (the index mark), not rounded.
    pub fn reading(&self) -> Radians {
        Radians(self.table.train.mass.position_at(self.now))
    }

    /// What the encoder reads where its present count is 0.
    pub fn count_zero(&self) -> Radians {
        Radians(self.table.train.encoder.count_zero())
    }

    /// Reading minus true angle at a reading from the encoder's own zero: the part that repeats
    /// from turn to turn.
    pub fn encoder_error(&self, reading: Radians) -> Radians {
        Radians(self.table.error.systematic(reading.value()))
    }

    /// How many lines the plate has.
    pub const fn lines(&self) -> usize {
        self.table.plate.lines()
    }

    /// Where a line is on the plate, minus where it should be.
    pub fn line_error(&self, line: usize) -> Radians {
        Radians(self.table.plate.error(line as i64))
    }

    /// By how many lines the plate is turned against the table, to the nearest whole one, and
    /// what that is off by.
    pub const fn placement(&self) -> (i64, Radians) {
        let (lines, error) = self.table.plate.placement();
        (lines, Radians(error))
    }

    /// The true angle, within some turn, at which a line passes the detector.
    pub fn line_angle(&self, line: usize) -> Radians {
        Radians(self.table.plate.angle(line as i64))
    }

    /// How many lines the detector has seen.
    pub const fn passages(&self) -> u64 {
        self.table.detector.passages()
    }

    /// Radians of one count.
    pub fn resolution(&self) -> Radians {
        Radians(self.table.resolution())
    }
}
