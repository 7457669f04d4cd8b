//! What a person sees of a plate's line through a microscope that stands beside the table.

use core::f64::consts::TAU;

use units::Radians;

use crate::random::Stream;

use super::Table;
use super::config::MicroscopeConfig;

/// A line as a person reads it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sight {
    /// By how much the table would have to turn on, towards larger angles, for the line to lie under the
    /// cross-hair; `None` when another line is nearer.
    pub to_line: Option<Radians>,
    /// What the encoder's display shows, from the index mark, when somebody has turned the table by hand
    /// until the line lies there. The table is where it was all the same.
    pub angle: Option<Radians>,
}

#[derive(Clone, Debug)]
pub(super) struct Microscope {
    noise: f64,
    stream: Stream,
}

impl Microscope {
    pub(super) fn new(config: &MicroscopeConfig, seed: u64) -> Self {
        Self {
            noise: Radians::from_arcsec(config.noise_arcsec).value(),
            stream: Stream::new(seed, "table microscope"),
        }
    }
}

impl Table {
    /// Somebody looks at a line; of one that cannot be seen he reads nothing.
    pub(super) fn sight(&mut self, line: u32, reading: f64) -> Sight {
        let number = i64::from(line);
        if self.plate.visible(number).is_none() {
            return Sight::default();
        }
        let noise = self.microscope.noise * self.microscope.stream.gaussian();
        let angle = self.plate.angle(number);
        let away = angle - self.true_angle(reading);
        let away = away - TAU * (away / TAU).round();
        let mut shown = reading + away;
        // The error changes slowly: each round is some thousand times nearer.
        for _ in 0..3 {
            let rest = angle - self.true_angle(shown);
            shown += rest - TAU * (rest / TAU).round();
        }
        Sight {
            to_line: (away.abs() < self.plate.spacing() / 2.0).then_some(Radians(away + noise)),
            angle: Some(Radians((shown + noise).rem_euclid(TAU))),
        }
    }
}
