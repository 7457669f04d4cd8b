//! What is known of a ball screw (`screw_model`).

use compensator::budget::BudgetError;
use compensator::screw::{Harmonic, ScatterParts, ScrewModel, Stroke, StrokeOutlier};
use serde::{Deserialize, Serialize};
use units::{Approach, Metres};

use crate::store::budget::PlacesBudgetRecord;

/// How a screw's model was estimated, and so by which rule it is applied.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ScrewMethodName {
    /// Least squares over all strokes; lost motion by remembered engagement.
    #[default]
    LeastSquares,
    /// The patent's means; all of the lost motion with every reverse move.
    Patent,
}

impl ScrewMethodName {
    /// How a person calls it.
    pub const fn in_words(self) -> &'static str {
        match self {
            Self::LeastSquares => "least squares",
            Self::Patent => "the patent's means",
        }
    }
}

/// A screw's model as it is stored. Deviation = actual − commanded.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScrewContent {
    /// How it was estimated.
    pub method: ScrewMethodName,
    /// How many strokes were measured, repetitions counted.
    pub rows: u32,
    /// Deviation at stroke zero reached forward, periodic terms apart.
    pub offset_m: f64,
    /// Deviation per stroke.
    pub slope_m_per_m: f64,
    /// Deviation reached in reverse − reached forward.
    pub lost_motion_m: f64,
    /// Travel per turn, where it was known.
    pub lead_m: Option<f64>,
    /// The periodic terms.
    pub harmonics: Vec<HarmonicRecord>,
    /// The lowest stroke measured.
    pub first_stroke_m: f64,
    /// The highest stroke measured.
    pub last_stroke_m: f64,
    /// Covariance of offset, slope, lost motion, and sine and cosine of each harmonic, square
    /// row by row, in metres and metres per metre; where anything was repeated.
    pub covariance_si: Option<Vec<f64>>,
    /// Standard uncertainty of a single move about the model; where anything was repeated.
    pub scatter_m: Option<f64>,
    /// Strokes that were left out because they do not fit the others.
    #[serde(default)]
    pub outliers: Vec<StrokeRecord>,
    /// What makes the place of a single stop uncertain, from either side at each stroke and half-way between two;
    /// `None` where that is not known, and in files of earlier programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub budget: Option<PlacesBudgetRecord>,
}

/// A stroke that was measured, metres; `approach` is `+` or `-`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StrokeRecord {
    pub approach: char,
    pub stroke_m: f64,
    pub deviation_m: f64,
}

/// A periodic term, metres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HarmonicRecord {
    pub number: u32,
    pub sine_m: f64,
    pub cosine_m: f64,
}

impl ScrewContent {
    /// The name of this kind.
    pub const KIND: &'static str = "screw_model";

    /// What `model` says, estimated by `method` from `rows` strokes.
    pub fn new(model: &ScrewModel, method: ScrewMethodName, rows: u32) -> Self {
        let harmonics = model.harmonics.iter().map(|it| HarmonicRecord {
            number: it.number,
            sine_m: it.sine.value(),
            cosine_m: it.cosine.value(),
        });
        Self {
            method,
            rows,
            offset_m: model.offset.value(),
            slope_m_per_m: model.slope,
            lost_motion_m: model.lost_motion.value(),
            lead_m: model.lead.map(Metres::value),
            harmonics: harmonics.collect(),
            first_stroke_m: model.first.value(),
            last_stroke_m: model.last.value(),
            covariance_si: model.covariance.clone(),
            scatter_m: model.scatter.map(Metres::value),
            outliers: Vec::new(),
            budget: None,
        }
    }

    /// The same with what its uncertainty is made of, where `parts` say that, at these `strokes` and half-way
    /// between two.
    ///
    /// # Errors
    /// When a figure is no uncertainty.
    pub fn with_budget(
        mut self,
        parts: Option<&ScatterParts>,
        strokes: &[Stroke],
    ) -> Result<Self, BudgetError> {
        let Some(parts) = parts else {
            return Ok(self);
        };
        let mut places: Vec<f64> = strokes.iter().map(|it| it.stroke.value()).collect();
        places.sort_by(f64::total_cmp);
        places.dedup();
        let between: Vec<f64> = places
            .windows(2)
            .map(|it| f64::midpoint(it[0], it[1]))
            .collect();
        places.extend(between);
        places.sort_by(f64::total_cmp);
        let sides = [Approach::Forward, Approach::Reverse];
        let places = places.into_iter();
        let places = places.flat_map(|it| sides.map(|side| (Metres(it), side)));
        let places: Vec<_> = places.collect();
        let budget = parts.budget(&self.model(), &places)?;
        let places = places.into_iter();
        let places = places.map(|(at, side)| (vec![at.value()], Some(side)));
        self.budget = Some(PlacesBudgetRecord::new(&budget, places.collect()));
        Ok(self)
    }

    /// With the strokes that were left out of the estimate.
    #[must_use]
    pub fn without(mut self, outliers: &[StrokeOutlier]) -> Self {
        let records = outliers.iter().map(|it| StrokeRecord {
            approach: it.stroke.approach.symbol(),
            stroke_m: it.stroke.stroke.value(),
            deviation_m: it.stroke.deviation.value(),
        });
        self.outliers = records.collect();
        self
    }

    /// One line about it, for lists.
    pub(crate) fn summary(&self) -> String {
        format!(
            "slope {:+.3} µm/mm, lost motion {:.3} µm, {} harmonics, from {} strokes by {}",
            self.slope_m_per_m * 1e3,
            Metres(self.lost_motion_m).um(),
            self.harmonics.len(),
            self.rows,
            self.method.in_words()
        )
    }

    /// The model; whether it is sound and can be applied is judged where it becomes a
    /// compensation.
    pub fn model(&self) -> ScrewModel {
        let harmonics = self.harmonics.iter().map(|it| Harmonic {
            number: it.number,
            sine: Metres(it.sine_m),
            cosine: Metres(it.cosine_m),
        });
        ScrewModel {
            offset: Metres(self.offset_m),
            slope: self.slope_m_per_m,
            lost_motion: Metres(self.lost_motion_m),
            lead: self.lead_m.map(Metres),
            harmonics: harmonics.collect(),
            first: Metres(self.first_stroke_m),
            last: Metres(self.last_stroke_m),
            covariance: self.covariance_si.clone(),
            scatter: self.scatter_m.map(Metres),
        }
    }
}
