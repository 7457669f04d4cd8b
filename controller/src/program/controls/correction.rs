//! The correction of one axis, linear or rotary, as a function of its place. In SI units: metres or radians.

use core::f64::consts::TAU;

use clap::ValueEnum;
use compensator::error_table::{Compensation, Node};
use compensator::rotary::PeriodicCompensation;
use units::{Approach, Metres, Radians};

use super::format::FormatName;
use crate::Failure;

/// For which approach a table holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Side {
    /// With growing coordinates.
    Forward,
    /// With falling coordinates.
    Reverse,
    /// The mean of both.
    Mean,
}

/// Positions of an axis and how they are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Measure {
    Length,
    Angle,
}

impl Measure {
    /// Of a place: mm or degrees.
    pub(super) const fn place(self, si: f64) -> f64 {
        match self {
            Self::Length => si * 1e3,
            Self::Angle => si.to_degrees(),
        }
    }

    pub(super) const fn place_unit(self) -> &'static str {
        match self {
            Self::Length => "mm",
            Self::Angle => "deg",
        }
    }

    /// A place that somebody has typed.
    pub(super) const fn typed(self, place: f64) -> f64 {
        match self {
            Self::Length => place * 1e-3,
            Self::Angle => place.to_radians(),
        }
    }

    /// Of a deviation, for people: micrometres or arc seconds, in letters that every control shows.
    pub(super) fn small(self, si: f64) -> String {
        match self {
            Self::Length => format!("{:.3} um", Metres(si).um()),
            Self::Angle => format!("{:.3} arcsec", Radians(si).arcsec()),
        }
    }

    /// The same for programs.
    pub(super) fn small_value(self, si: f64) -> f64 {
        match self {
            Self::Length => Metres(si).um(),
            Self::Angle => Radians(si).arcsec(),
        }
    }

    /// What straight lines may be off before there are more of them: less than instruments tell.
    pub(super) const fn harmless(self) -> f64 {
        match self {
            Self::Length => 10e-9,
            Self::Angle => 5e-8,
        }
    }
}

/// What undoes the deviations of an axis.
pub(super) enum Correction {
    Linear(Box<Compensation>),
    Rotary(Box<PeriodicCompensation>),
}

impl Correction {
    pub(super) const fn measure(&self) -> Measure {
        match self {
            Self::Linear(_) => Measure::Length,
            Self::Rotary(_) => Measure::Angle,
        }
    }

    /// A table of a bearing holds for both directions.
    pub(super) fn knows(&self, approach: Approach) -> bool {
        match self {
            Self::Linear(it) => it.table().knows(approach),
            Self::Rotary(_) => true,
        }
    }

    /// Whether the two approaches are apart.
    pub(super) fn has_two_sides(&self) -> bool {
        let all = [Approach::Forward, Approach::Reverse];
        matches!(self, Self::Linear(_)) && all.into_iter().all(|it| self.knows(it))
    }

    /// The deviation (actual − target) at a command.
    pub(super) fn deviation(&self, command: f64, side: Side) -> f64 {
        self.of(side, |approach| match self {
            Self::Linear(it) => it
                .deviation(Metres(command), approach)
                .map(Metres::value)
                .ok(),
            Self::Rotary(it) => it.deviation(Radians(command)).map(Radians::value).ok(),
        })
    }

    /// What is added to a target to get the command that reaches it.
    pub(super) fn compensation(&self, target: f64, side: Side) -> f64 {
        let command = |approach| match self {
            Self::Linear(it) => it
                .set_point(Metres(target), approach)
                .map(Metres::value)
                .ok(),
            Self::Rotary(it) => it.set_point(Radians(target)).map(Radians::value).ok(),
        };
        self.of(side, command) - target
    }

    fn of(&self, side: Side, value: impl Fn(Approach) -> Option<f64>) -> f64 {
        let value = |it| {
            value(it)
                .expect("ends hold, places are finite, and sides that are not known are not asked")
        };
        match side {
            Side::Forward => value(Approach::Forward),
            Side::Reverse => value(Approach::Reverse),
            Side::Mean => f64::midpoint(value(Approach::Forward), value(Approach::Reverse)),
        }
    }

    /// Where it was measured; of a turn both ends.
    pub(super) fn places(&self) -> Vec<f64> {
        match self {
            Self::Linear(it) => it
                .table()
                .nodes()
                .iter()
                .map(|it| it.position.value())
                .collect(),
            Self::Rotary(it) => {
                let lines = it.table().deviations().len();
                (0..=lines)
                    .map(|line| line as f64 / lines as f64 * TAU)
                    .collect()
            }
        }
    }

    /// The largest standard uncertainty of a value, where any is known.
    pub(super) fn uncertainty(&self) -> Option<f64> {
        let largest = |all: &mut dyn Iterator<Item = f64>| all.reduce(f64::max);
        match self {
            Self::Linear(it) => {
                let of = |node: &Node| [node.u_forward, node.u_reverse];
                largest(
                    &mut it
                        .table()
                        .nodes()
                        .iter()
                        .flat_map(of)
                        .flatten()
                        .map(Metres::value),
                )
            }
            Self::Rotary(it) => {
                let all = it.table().uncertainties().unwrap_or_default();
                largest(&mut all.iter().map(|it| it.value()))
            }
        }
    }

    /// Where a table of it can have corners: at the calibrated places, by their targets and by their commands.
    pub(super) fn corners(&self, side: Side) -> Vec<f64> {
        let places = self.places().into_iter();
        places
            .flat_map(|it| [it, it + self.deviation(it, side)])
            .collect()
    }

    /// The largest deviation.
    pub(super) fn largest(&self) -> f64 {
        match self {
            Self::Linear(it) => it.table().largest().value(),
            Self::Rotary(it) => it.largest().value(),
        }
    }

    /// The largest deviation times the largest slope: what it makes to look a deviation up at the target in place of the
    /// command.
    pub(super) fn second_order(&self) -> f64 {
        match self {
            Self::Linear(it) => self.largest() * it.steepest_slope(),
            Self::Rotary(it) => self.largest() * it.steepest_slope(),
        }
    }

    /// How far the approaches are apart at most.
    pub(super) fn apart(&self) -> f64 {
        if !self.has_two_sides() {
            return 0.0;
        }
        let at = |it: f64| self.deviation(it, Side::Reverse) - self.deviation(it, Side::Forward);
        self.places()
            .into_iter()
            .map(|it| at(it).abs())
            .fold(0.0, f64::max)
    }

    /// The side of a table that has one value for both directions, and what is to be told of that.
    ///
    /// # Errors
    /// When the sides differ and nobody has said which is meant, or the one that is meant was not measured.
    pub(super) fn one_side(
        &self,
        format: FormatName,
        asked: Option<Side>,
    ) -> Result<(Side, Option<String>), Failure> {
        let name = format.in_words();
        if let Self::Rotary(_) = self {
            return match asked {
                None => Ok((Side::Forward, None)),
                Some(_) => Err(Failure::Usage {
                    what: "--approach: a rotary table has one deviation for both directions".into(),
                    help: "leave it out".into(),
                }),
            };
        }
        if !self.has_two_sides() {
            let side = self.only_side(asked)?;
            return Ok((side, Some(one_sided(side))));
        }
        let apart = self.apart();
        let Some(side) = asked else {
            return Err(Failure::Usage {
                what: format!(
                    "--format {}: {name} has one value for both directions, and the two approaches of this calibration \
                     are up to {} apart",
                    format.word(),
                    self.measure().small(apart)
                ),
                help: "say which one it shall be with --approach forward, reverse or mean".into(),
            });
        };
        let told = match side {
            Side::Forward => ("in reverse", apart),
            Side::Reverse => ("forward", apart),
            Side::Mean => ("from either side", apart / 2.0),
        };
        let told = format!(
            "one table for both directions: approached {} the axis is up to {} off",
            told.0,
            self.measure().small(told.1)
        );
        Ok((side, Some(told)))
    }

    /// The one approach that was measured.
    ///
    /// # Errors
    /// When another one is asked for.
    pub(super) fn only_side(&self, asked: Option<Side>) -> Result<Side, Failure> {
        let own = match self.knows(Approach::Forward) {
            true => Side::Forward,
            false => Side::Reverse,
        };
        match asked {
            Some(other) if other != own => Err(Failure::Usage {
                what: format!(
                    "--approach: this calibration was measured {} only",
                    in_words(own)
                ),
                help: "leave it out".into(),
            }),
            _ => Ok(own),
        }
    }
}

pub(super) const fn in_words(side: Side) -> &'static str {
    match side {
        Side::Forward => "forward",
        Side::Reverse => "in reverse",
        Side::Mean => "from both sides",
    }
}

/// What is to be told of a table that was measured from one side.
pub(super) fn one_sided(side: Side) -> String {
    format!(
        "measured {} only: what the lost motion does from the other side is not in the table",
        in_words(side)
    )
}
