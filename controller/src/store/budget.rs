//! Uncertainty budgets as they are stored: what contributes, and at places of their own what that comes to.

use compensator::budget::{COVERAGE_FACTOR, Contribution, Correlation, Evaluation, PlacesBudget};
use machine::records::sound::{
    Judged, Limits, RATIO, approach, as_many, counted, is, letter, limits, model, number, numbers,
    optional,
};
use serde::{Deserialize, Serialize};
use units::{Approach, Quantity};

/// One line of a budget.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContributionRecord {
    /// Where it comes from.
    pub name: String,
    /// `A` or `B` (GUM 4.2 and 4.3).
    pub evaluation: char,
    /// Standard uncertainty of the input.
    pub value: f64,
    /// Its unit.
    pub unit: String,
    /// SI units of the result per unit, or with `common_scale` metres per unit and metre of distance from
    /// the datum; where places have sensitivities of their own, that at the least certain of them.
    pub sensitivity: f64,
    /// `null` for infinitely many.
    pub degrees_of_freedom: Option<f64>,
    /// What it does at two places.
    pub correlation: CorrelationRecord,
    /// `+` or `-` where it concerns one approach.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub approach: Option<char>,
}

/// What one input does at two places.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CorrelationRecord {
    /// The same share of the distance from the datum.
    CommonScale,
    /// The same length or angle.
    CommonOffset,
    /// Nothing in common.
    Independent,
    /// Nothing at the calibrated positions, most half-way between two.
    BetweenPositions,
    /// What the fit makes of readings that places share.
    SharedReadings,
}

/// The budget of a calibration whose inputs act otherwise at each place.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlacesBudgetRecord {
    /// k: each `expanded_u_si` is so many times its `u_si`.
    pub coverage_factor: f64,
    /// What contributes (GUM clause 8).
    pub contributions: Vec<ContributionRecord>,
    /// What they come to, place by place.
    pub places: Vec<PlaceBudgetRecord>,
}

/// What contributions come to at one place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlaceBudgetRecord {
    /// Where: an angle in radians, or one or three coordinates in metres.
    pub at_si: Vec<f64>,
    /// `+` or `-` where that matters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub approach: Option<char>,
    /// What a unit of each contribution does here, metres or radians.
    pub sensitivities: Vec<f64>,
    /// Combined standard uncertainty, metres or radians.
    pub u_si: f64,
    /// Expanded uncertainty, likewise.
    pub expanded_u_si: f64,
    /// Effective degrees of freedom (Welch and Satterthwaite); `null` for infinitely many.
    pub degrees_of_freedom: Option<f64>,
}

impl PlaceBudgetRecord {
    /// From which side, where that matters.
    pub(crate) fn side(&self) -> Option<Approach> {
        self.approach.map(side)
    }
}

/// The approach of this symbol.
fn side(symbol: char) -> Approach {
    match symbol {
        '-' => Approach::Reverse,
        _ => Approach::Forward,
    }
}

/// Where a place is, and from which side where that matters.
pub(crate) type At = (Vec<f64>, Option<Approach>);

impl PlacesBudgetRecord {
    /// What `budget` says of the places at `places`, in its order.
    pub(crate) fn new<Q: Quantity>(budget: &PlacesBudget<Q>, places: Vec<At>) -> Self {
        let sensitivities = budget.sensitivities().iter().enumerate();
        let places = sensitivities.zip(places);
        let places = places.map(|((number, sensitivities), (at_si, approach))| {
            let combined = budget.at(number);
            PlaceBudgetRecord {
                at_si,
                approach: approach.map(Approach::symbol),
                sensitivities: sensitivities.clone(),
                u_si: combined.standard_uncertainty.value(),
                expanded_u_si: combined.expanded().value(),
                degrees_of_freedom: told_freedom(combined.degrees_of_freedom),
            }
        });
        Self {
            coverage_factor: COVERAGE_FACTOR,
            contributions: budget.contributions().iter().map(Into::into).collect(),
            places: places.collect(),
        }
    }

    /// The least certain place; `None` of a record without any.
    #[cfg(feature = "program")]
    pub(crate) fn least_certain(&self) -> Option<&PlaceBudgetRecord> {
        let places = self.places.iter();
        places.reduce(|most, it| if it.u_si > most.u_si { it } else { most })
    }

    /// Whether its sums are those of its lines, and are `stated` where somebody else states them.
    pub(crate) fn judge(&self, stated: &[(usize, f64)]) -> Judged {
        counted("budget.places", self.places.len(), 1..=PLACES_MAX)?;
        judge_lines(&self.contributions, self.coverage_factor)?;
        let lines = self.contributions.iter().map(Contribution::from).collect();
        for (at, it) in self.places.iter().enumerate() {
            let place = |key: &str| format!("budget.places[{at}].{key}");
            counted(&place("at_si"), it.at_si.len(), 1..=3)?;
            numbers(&place("at_si"), &it.at_si, &AT)?;
            it.approach
                .map_or(Ok(()), |it| approach(&place("approach"), it))?;
            let key = place("sensitivities");
            let wanted = self.contributions.len();
            as_many(&key, it.sensitivities.len(), wanted, "the contributions")?;
            numbers(&key, &it.sensitivities, &SENSITIVITY)?;
        }
        let sensitivities = self.places.iter().map(|it| it.sensitivities.clone());
        let budget = PlacesBudget::<units::Metres>::new(lines, sensitivities.collect());
        let Ok(budget) = &budget else {
            return model("budget", budget);
        };
        for (at, it) in self.places.iter().enumerate() {
            let place = |key: &str| format!("budget.places[{at}].{key}");
            let follows = budget.at(at);
            let u = follows.standard_uncertainty.value();
            same(&place("u_si"), it.u_si, u)?;
            same(
                &place("expanded_u_si"),
                it.expanded_u_si,
                COVERAGE_FACTOR * u,
            )?;
            let freedom = (it.degrees_of_freedom, follows.degrees_of_freedom);
            same_freedom(&place("degrees_of_freedom"), freedom)?;
        }
        for (at, u) in stated {
            let seen = self.places.get(*at).map_or(f64::NAN, |it| it.u_si);
            same(&format!("budget.places[{at}].u_si"), seen, *u)?;
        }
        Ok(())
    }
}

/// Contributions of a budget at most.
const CONTRIBUTIONS_MAX: usize = 1000;
/// Places of one at most.
const PLACES_MAX: usize = 2_000_000;
/// Letters of a name at most.
const NAME_MAX: usize = 200;
/// What one unit of an input does.
const SENSITIVITY: Limits = limits(-1e12, 1e12, "SI units per unit");
/// Where a place is.
const AT: Limits = limits(-1e3, 1e3, "m or rad");
/// How well an uncertainty is known. Of what is small beside the rest they may be any number (Welch and Satterthwaite).
pub(crate) const FREEDOM: Limits = limits(f64::MIN_POSITIVE, f64::MAX, "degrees of freedom");
/// So many are as good as infinitely many: no coverage factor tells them apart.
const FREEDOM_MANY: f64 = 1e6;
/// A figure that follows from others may differ by rounding: where an uncertainty is computed once as a whole and once part by
/// part, of equations as badly conditioned as they may be, far more than a digit of it.
pub(crate) const ROUNDING: f64 = 1e-6;

/// Whether the lines of a budget can be so, with its coverage factor.
pub(crate) fn judge_lines(lines: &[ContributionRecord], factor: f64) -> Judged {
    counted("budget.contributions", lines.len(), 1..=CONTRIBUTIONS_MAX)?;
    for (at, line) in lines.iter().enumerate() {
        let place = |key: &str| format!("budget.contributions[{at}].{key}");
        counted(&place("name"), line.name.len(), 1..=NAME_MAX)?;
        counted(&place("unit"), line.unit.len(), 1..=NAME_MAX)?;
        letter(&place("evaluation"), line.evaluation, &['A', 'B'])?;
        line.approach
            .map_or(Ok(()), |it| approach(&place("approach"), it))?;
        number(place("value"), line.value, &RATIO)?;
        number(place("sensitivity"), line.sensitivity, &SENSITIVITY)?;
        let freedom = line.degrees_of_freedom;
        optional(&place("degrees_of_freedom"), freedom, &FREEDOM)?;
    }
    let is_two = factor == COVERAGE_FACTOR;
    is(
        "budget.coverage_factor",
        is_two,
        || COVERAGE_FACTOR.to_string(),
        || factor.to_string(),
    )
}

/// What follows from the contributions, but for rounding.
pub(crate) fn same(place: &str, seen: f64, expected: f64) -> Judged {
    // A comparison with NaN is false.
    let agrees = (seen - expected).abs() <= ROUNDING * expected.abs();
    let follows = || format!("{expected:e}, which follows from the budget's contributions");
    is(place, agrees, follows, || format!("{seen:e}"))
}

/// Effective degrees of freedom as they are stored and told: `None` where they are as good as infinitely many.
pub(crate) fn told_freedom(effective: Option<f64>) -> Option<f64> {
    effective.filter(|it| *it < FREEDOM_MANY)
}

/// Likewise of degrees of freedom: those as good as infinitely many are the same, however they are written.
pub(crate) fn same_freedom(place: &str, (seen, expected): (Option<f64>, Option<f64>)) -> Judged {
    let many = |it: Option<f64>| it.map_or(FREEDOM_MANY, |it| it.min(FREEDOM_MANY));
    same(place, many(seen), many(expected))
}

impl From<&Contribution> for ContributionRecord {
    fn from(it: &Contribution) -> Self {
        Self {
            name: it.name.clone(),
            evaluation: match it.evaluation {
                Evaluation::A => 'A',
                Evaluation::B => 'B',
            },
            value: it.value,
            unit: it.unit.clone(),
            sensitivity: it.sensitivity,
            degrees_of_freedom: it.degrees_of_freedom,
            correlation: it.correlation.into(),
            approach: it.approach.map(Approach::symbol),
        }
    }
}

impl From<&ContributionRecord> for Contribution {
    fn from(it: &ContributionRecord) -> Self {
        Self {
            name: it.name.clone(),
            evaluation: match it.evaluation {
                'A' => Evaluation::A,
                _ => Evaluation::B,
            },
            value: it.value,
            unit: it.unit.clone(),
            sensitivity: it.sensitivity,
            degrees_of_freedom: it.degrees_of_freedom,
            correlation: it.correlation.into(),
            approach: it.approach.map(side),
        }
    }
}

impl From<Correlation> for CorrelationRecord {
    fn from(it: Correlation) -> Self {
        match it {
            Correlation::CommonScale => Self::CommonScale,
            Correlation::CommonOffset => Self::CommonOffset,
            Correlation::Independent => Self::Independent,
            Correlation::BetweenPositions => Self::BetweenPositions,
            Correlation::SharedReadings => Self::SharedReadings,
        }
    }
}

impl From<CorrelationRecord> for Correlation {
    fn from(it: CorrelationRecord) -> Self {
        match it {
            CorrelationRecord::CommonScale => Self::CommonScale,
            CorrelationRecord::CommonOffset => Self::CommonOffset,
            CorrelationRecord::Independent => Self::Independent,
            CorrelationRecord::BetweenPositions => Self::BetweenPositions,
            CorrelationRecord::SharedReadings => Self::SharedReadings,
        }
    }
}

#[cfg(test)]
mod tests {
    use units::Metres;

    use super::*;

    /// 30 nm and 40 nm at one place, 30 nm alone at the other.
    fn record() -> PlacesBudgetRecord {
        let line = |value: f64, degrees_of_freedom| Contribution {
            name: "input".to_owned(),
            evaluation: Evaluation::A,
            value,
            unit: "m".to_owned(),
            sensitivity: 1.0,
            degrees_of_freedom,
            correlation: Correlation::SharedReadings,
            approach: None,
        };
        let lines = vec![line(30e-9, Some(8.0)), line(20e-9, None)];
        let budget = PlacesBudget::<Metres>::new(lines, vec![vec![1.0, 2.0], vec![1.0, 0.0]]);
        let places = vec![(vec![0.0], Some(Approach::Forward)), (vec![0.1], None)];
        PlacesBudgetRecord::new(&budget.unwrap(), places)
    }

    #[test]
    fn more_degrees_of_freedom_than_matter_are_infinitely_many_however_they_are_written() {
        assert_eq!(told_freedom(Some(1.36e12)), None);
        assert_eq!(told_freedom(Some(17.5)), Some(17.5));
        for written in [None, Some(1e6), Some(1.36e12), Some(1e300)] {
            same_freedom("it", (written, Some(1.4e12))).unwrap();
            assert!(same_freedom("it", (written, Some(8.0))).is_err());
        }
    }

    #[test]
    fn a_budget_is_judged_by_its_lines_and_by_what_is_stated_elsewhere() {
        let stated = [(0, 50e-9), (1, 30e-9)];
        record().judge(&stated).unwrap();
        assert_eq!(record().least_certain(), Some(&record().places[0]));
        let check = |changed: fn(&mut PlacesBudgetRecord), place: &str| {
            let mut record = record();
            changed(&mut record);
            assert_eq!(record.judge(&stated).unwrap_err().place, place);
        };
        check(|it| it.places[1].u_si *= 1.001, "budget.places[1].u_si");
        check(
            |it| it.places[0].expanded_u_si = 50e-9,
            "budget.places[0].expanded_u_si",
        );
        let freedom = "budget.places[0].degrees_of_freedom";
        check(|it| it.places[0].degrees_of_freedom = None, freedom);
        let few = "budget.places[1].sensitivities";
        check(|it| it.places[1].sensitivities.truncate(1), few);
        check(|it| it.coverage_factor = 3.0, "budget.coverage_factor");
        check(
            |it| it.contributions[0].value = 31e-9,
            "budget.places[0].u_si",
        );
        check(|it| it.places.clear(), "budget.places");
        let wrong = record().judge(&[(1, 31e-9)]).unwrap_err();
        assert_eq!(wrong.place, "budget.places[1].u_si");
    }

    #[test]
    fn a_budget_comes_back_as_it_was_kept() {
        let text = serde_json::to_string(&record()).unwrap();
        assert_eq!(
            serde_json::from_str::<PlacesBudgetRecord>(&text).unwrap(),
            record()
        );
        assert!(
            text.contains("\"shared_readings\"") && text.contains("\"degrees_of_freedom\":null")
        );
    }
}
