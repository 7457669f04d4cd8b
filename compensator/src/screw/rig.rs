//! A screw of the tests' own: noise that repeats, and a nut pushed by two flanks.

use units::{Approach, Metres};

use super::FitOptions;
pub(super) use crate::noise::Noise;
use crate::screw::Stroke;

pub(super) const UM: f64 = 1e-6;

/// Micrometres and millimetres, so that a mistake of units shows.
#[derive(Clone, Debug)]
pub(super) struct Screw {
    pub(super) offset_um: f64,
    pub(super) slope_um_per_mm: f64,
    pub(super) play_um: f64,
    pub(super) lead_mm: f64,
    /// Number, amplitude and phase: amplitude · sin(2π number s/lead + phase).
    pub(super) waves: Vec<(u32, f64, f64)>,
}

impl Screw {
    pub(super) const PLAIN: Self = Self {
        offset_um: 0.3,
        slope_um_per_mm: 0.6,
        play_um: 2.3,
        lead_mm: 2.0,
        waves: Vec::new(),
    };

    pub(super) fn with_waves(waves: &[(u32, f64, f64)]) -> Self {
        Self {
            waves: waves.to_vec(),
            ..Self::PLAIN
        }
    }

    /// Where the forward flank is, mm.
    pub(super) fn flank_mm(&self, stroke_mm: f64) -> f64 {
        let wave = |&(number, amplitude, phase): &(u32, f64, f64)| {
            let angle = core::f64::consts::TAU * f64::from(number) * stroke_mm / self.lead_mm;
            amplitude * (angle + phase).sin()
        };
        let waves: f64 = self.waves.iter().map(wave).sum();
        stroke_mm + 1e-3 * (self.offset_um + self.slope_um_per_mm * stroke_mm + waves)
    }

    pub(super) fn deviation_um(&self, stroke_mm: f64, approach: Approach) -> f64 {
        let play = if approach == Approach::Reverse {
            self.play_um
        } else {
            0.0
        };
        1e3 * (self.flank_mm(stroke_mm) - stroke_mm) + play
    }

    /// Every stroke from both sides, `repeats` times, with noise of this standard deviation.
    pub(super) fn measured(
        &self,
        strokes_mm: &[f64],
        repeats: usize,
        noise_um: f64,
        noise: &mut Noise,
    ) -> Vec<Stroke> {
        let mut rows = Vec::new();
        for _ in 0..repeats {
            for approach in [Approach::Forward, Approach::Reverse] {
                for &mm in strokes_mm {
                    let um = self.deviation_um(mm, approach) + noise_um * noise.normal();
                    rows.push(row(approach, mm * 1e3, um));
                }
            }
        }
        rows
    }
}

pub(super) fn row(approach: Approach, stroke_um: f64, deviation_um: f64) -> Stroke {
    Stroke {
        approach,
        stroke: Metres::from_um(stroke_um),
        deviation: Metres::from_um(deviation_um),
    }
}

/// `count` strokes from `first` on, `step` apart, millimetres.
pub(super) fn every(first: f64, step: f64, count: u32) -> Vec<f64> {
    (0..count).map(|i| first + f64::from(i) * step).collect()
}

/// A nut between two flanks of a real screw: pushed by whichever flank reaches it.
#[derive(Clone, Debug)]
pub(super) struct Nut {
    pub(super) screw: Screw,
    pub(super) nut_mm: f64,
}

impl Nut {
    /// The screw turns to `set_point_mm` in small steps.
    pub(super) fn turn(&mut self, from_mm: f64, set_point_mm: f64) {
        for k in 1..=50 {
            let at = from_mm + (set_point_mm - from_mm) * f64::from(k) / 50.0;
            let flank = self.screw.flank_mm(at);
            if flank > self.nut_mm {
                self.nut_mm = flank;
            }
            if flank + 1e-3 * self.screw.play_um < self.nut_mm {
                self.nut_mm = flank + 1e-3 * self.screw.play_um;
            }
        }
    }
}

/// A lead of 2 mm, and the usual.
pub(super) fn with_lead() -> FitOptions {
    FitOptions {
        lead: Some(Metres::from_mm(2.0)),
        ..FitOptions::default()
    }
}

/// 24 strokes over six turns, at twelve places of the turn.
pub(super) fn dense() -> Vec<f64> {
    every(-6.0, 0.5 + 1.0 / 12.0, 24)
}
