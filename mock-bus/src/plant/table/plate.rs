//! A glass plate with radial lines, and how it lies on the table.

use core::f64::consts::TAU;
use std::collections::BTreeSet;

use units::Radians;
use units::portable::sin;

use crate::random::Stream;

use super::config::PlateConfig;

#[derive(Clone, Debug)]
pub(super) struct Plate {
    /// Where each line is on the plate, minus where it should be.
    errors: Vec<f64>,
    /// By how many lines the plate is turned against the table; of a part of a line, half and
    /// more is counted as a whole one.
    placement_lines: i64,
    /// The part of a line that is left, and what the placement is off by.
    placement_error: f64,
    /// By how many lines it was meant to be turned.
    turned: f64,
    placement_error_max: f64,
    hand: Stream,
    smudged: BTreeSet<u32>,
}

impl Plate {
    pub(super) fn new(config: &PlateConfig, seed: u64) -> Self {
        let mut plate = Self {
            errors: errors(config, &mut Stream::new(seed, "plate lines")),
            placement_lines: config.placement_lines,
            placement_error: 0.0,
            turned: config.placement_lines as f64,
            placement_error_max: Radians::from_arcsec(config.placement_error_arcsec).value(),
            hand: Stream::new(seed, "plate placement"),
            smudged: config.smudged_lines.iter().copied().collect(),
        };
        plate.turn(0.0);
        plate
    }

    pub(super) const fn lines(&self) -> usize {
        self.errors.len()
    }

    pub(super) fn spacing(&self) -> f64 {
        TAU / self.errors.len() as f64
    }

    /// Somebody takes it up, turns it by so many lines and fixes it again.
    pub(super) fn turn(&mut self, lines: f64) {
        self.turned += lines;
        let whole = self.turned.round();
        let limit = self.placement_error_max;
        let slip = self.hand.between(-limit, limit);
        self.placement_lines = whole as i64;
        self.placement_error = (self.turned - whole) * self.spacing() + slip;
    }

    pub(super) const fn placement(&self) -> (i64, f64) {
        (self.placement_lines, self.placement_error)
    }

    pub(super) fn smudge(&mut self, line: u32, smudged: bool) {
        if smudged {
            self.smudged.insert(line);
        } else {
            self.smudged.remove(&line);
        }
    }

    /// The error of line `number`, which may be any number of turns on.
    pub(super) fn error(&self, number: i64) -> f64 {
        self.errors[self.index(number)]
    }

    fn index(&self, number: i64) -> usize {
        number.rem_euclid(self.errors.len() as i64) as usize
    }

    /// Which line of the plate it is; `None` when it cannot be seen.
    pub(super) fn visible(&self, number: i64) -> Option<u32> {
        let line = self.index(number) as u32;
        (!self.smudged.contains(&line)).then_some(line)
    }

    /// The true table angle at which line `number` passes the detector.
    pub(super) fn angle(&self, number: i64) -> f64 {
        (number + self.placement_lines) as f64 * self.spacing()
            + self.placement_error
            + self.error(number)
    }

    /// All lines, in ascending order, that may pass while the table turns between these angles.
    pub(super) fn candidates(&self, low: f64, high: f64) -> impl Iterator<Item = i64> {
        let number = |angle: f64| {
            let lines = (angle - self.placement_error) / self.spacing();
            lines.floor() as i64 - self.placement_lines
        };
        // No line is off by a whole spacing.
        number(low) - 1..=number(high) + 2
    }
}

fn errors(config: &PlateConfig, stream: &mut Stream) -> Vec<f64> {
    let phase = stream.between(0.0, TAU);
    let raw: Vec<f64> = (0..config.lines)
        .map(|line| {
            let angle = TAU * f64::from(line) / f64::from(config.lines);
            config.eccentricity_arcsec * sin(angle + phase)
                + config.division_arcsec * stream.gaussian()
        })
        .collect();
    let peak = raw
        .iter()
        .fold(0.0, |peak: f64, error| peak.max(error.abs()));
    let scale = if peak > 0.0 {
        Radians::from_arcsec(config.error_peak_arcsec).value() / peak
    } else {
        0.0
    };
    raw.into_iter().map(|error| error * scale).collect()
}
