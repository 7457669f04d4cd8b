//! What is known of three axes corrected throughout their volume: their errors
//! (`volumetric_geometry`), what their detectors read then (`beam_references`), and displacements that
//! are to be kept (`state_memory`).

mod agreement;
mod covariance;
mod given;
mod memory;
mod rolls;
mod warmth;

use core::fmt;

use compensator::volumetric::Axis;
use compensator::volumetric::function::{Function, Shape};
use compensator::volumetric::identify::{IdentifiedBend, IdentifiedExpansion};
use compensator::volumetric::model::{AxisErrors, ErrorCovariance, ErrorName, Squareness};
use compensator::volumetric::online::{BeamDrift, BeamReference};
use serde::{Deserialize, Serialize};
use units::{Celsius, Metres, Quantity, Radians};

use crate::store::budget::PlacesBudgetRecord;
use crate::store::{IdentityRecord, StoreError, short};

pub(crate) use agreement::AgreementRecord;
pub(crate) use covariance::CovarianceRecord;
pub(crate) use given::GivenName;
pub use memory::{MemoryName, StateMemoryContent};
pub(crate) use rolls::RollRecord;
pub(crate) use warmth::AXES;
pub use warmth::BendRecord;
pub(crate) use warmth::{ExpansionRecord, UnknownRecord};

/// How a function runs between its nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FunctionShape {
    /// Straight lines.
    #[default]
    Linear,
    /// Cubics without overshoot.
    MonotoneCubic,
    /// The cubic spline with continuous curvature.
    Spline,
}

impl From<Shape> for FunctionShape {
    fn from(shape: Shape) -> Self {
        match shape {
            Shape::Linear => Self::Linear,
            Shape::MonotoneCubic => Self::MonotoneCubic,
            Shape::Spline => Self::Spline,
        }
    }
}

impl From<FunctionShape> for Shape {
    fn from(shape: FunctionShape) -> Self {
        match shape {
            FunctionShape::Linear => Self::Linear,
            FunctionShape::MonotoneCubic => Self::MonotoneCubic,
            FunctionShape::Spline => Self::Spline,
        }
    }
}

/// A function of an axis's position: metres or radians at positions in metres.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FunctionRecord {
    /// Of what: `e_yx`, or which direction of which detector.
    pub name: String,
    /// Between the nodes.
    pub shape: FunctionShape,
    /// Where its nodes are.
    pub positions_m: Vec<f64>,
    /// Metres or radians there.
    pub values_si: Vec<f64>,
    /// Their standard uncertainties, where known.
    pub standard_uncertainties_si: Option<Vec<f64>>,
    /// At a quarter, a half and three quarters of each interval, or in the middle of each in files of earlier programs,
    /// the standard uncertainty of how far the error is from the curve there; `None` where that is not known, and in the
    /// earliest files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub between_standard_uncertainties_si: Option<Vec<f64>>,
}

impl FunctionRecord {
    /// What `function`, called `name`, says.
    pub fn of<Q: Quantity>(name: impl fmt::Display, function: &Function<Q>) -> Self {
        let nodes: Vec<Metres> = function.nodes().collect();
        let u: Option<Vec<f64>> = nodes
            .iter()
            .map(|it| function.standard_uncertainty(*it).map(Quantity::value))
            .collect();
        Self {
            name: name.to_string(),
            shape: function.shape().into(),
            values_si: nodes.iter().map(|it| function.at(*it).value()).collect(),
            positions_m: nodes.iter().map(|it| it.value()).collect(),
            standard_uncertainties_si: u,
            between_standard_uncertainties_si: function
                .between()
                .map(|all| all.into_iter().map(Quantity::value).collect()),
        }
    }

    /// The function, in the calibration `id`.
    ///
    /// # Errors
    /// When its nodes form none.
    pub fn function<Q: Quantity>(&self, id: &str) -> Result<Function<Q>, StoreError> {
        let nodes: Vec<_> = self.positions_m.iter().copied().map(Metres).collect();
        let quantities =
            |values: &[f64]| -> Vec<Q> { values.iter().copied().map(Q::from_value).collect() };
        let shape = self.shape.into();
        let function = Function::new(&nodes, &quantities(&self.values_si), shape);
        let function = function.and_then(|it| match &self.standard_uncertainties_si {
            Some(u) => it.with_uncertainties(&quantities(u)),
            None => Ok(it),
        });
        let between = self.between_standard_uncertainties_si.as_ref();
        let function = function.and_then(|it| match between {
            Some(u) => it.with_between(&quantities(u)),
            None => Ok(it),
        });
        function.map_err(|source| StoreError::Part {
            id: short(id),
            name: self.name.clone(),
            source: source.into(),
        })
    }
}

/// The 21 errors of three axes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GeometryContent {
    /// The error functions that are known, by the letters of ISO 230-1; the others are zero.
    pub functions: Vec<FunctionRecord>,
    /// Squareness of y to x, z to x, z to y.
    pub squareness_rad: [f64; 3],
    /// Their standard uncertainties.
    pub squareness_u_rad: [f64; 3],
    /// What the thermometers showed, in the order of the configuration, °C.
    pub temperatures_c: Vec<f64>,
    /// Guides that bend, where that was measured.
    #[serde(default)]
    pub bends: Vec<BendRecord>,
    /// Expansions of the scales, where these were measured.
    #[serde(default)]
    pub expansions: Vec<ExpansionRecord>,
    /// Who the drives of x, y and z were; empty where the errors were measured elsewhere.
    #[serde(default)]
    pub drives: Vec<IdentityRecord>,
    /// What was not found of what there is.
    #[serde(default)]
    pub unknown: UnknownRecord,
    /// How well the readings agree with all this; `None` in files of earlier programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub agreement: Option<AgreementRecord>,
    /// How sure functions and squarenesses are together; `None` in files of earlier programs, and where the errors were
    /// not found from readings.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<CovarianceRecord>,
    /// What makes the tool in use uncertain, at places all over the volume: the length of its deviation; `None` in
    /// files of earlier programs, and where the errors were not found from readings.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub budget: Option<PlacesBudgetRecord>,
}

fn error_names() -> impl Iterator<Item = ErrorName> {
    let pairs = Axis::ALL
        .into_iter()
        .flat_map(|axis| Axis::ALL.into_iter().map(move |it| (axis, it)));
    pairs.flat_map(|(axis, it)| [ErrorName::Along(axis, it), ErrorName::About(axis, it)])
}

/// The error function that a file calls so; `None` for a name that is none.
pub(crate) fn error_name(text: &str) -> Option<ErrorName> {
    error_names().find(|it| it.to_string() == text)
}

impl GeometryContent {
    /// The name of this kind.
    pub const KIND: &'static str = "volumetric_geometry";

    /// What is known of three axes at these temperatures.
    pub fn new(axes: &[AxisErrors; 3], squareness: &Squareness, temperatures: &[Celsius]) -> Self {
        let function = |name: ErrorName| match name {
            ErrorName::Along(axis, it) => {
                let function = axes[axis.index()].along[it.index()].as_ref()?;
                Some(FunctionRecord::of(name, function))
            }
            ErrorName::About(axis, it) => {
                let function = axes[axis.index()].about[it.index()].as_ref()?;
                Some(FunctionRecord::of(name, function))
            }
        };
        let each = [squareness.y_to_x, squareness.z_to_x, squareness.z_to_y];
        Self {
            functions: error_names().filter_map(function).collect(),
            squareness_rad: each.map(Radians::value),
            squareness_u_rad: squareness.u.map(Radians::value),
            temperatures_c: temperatures.iter().map(|it| it.value()).collect(),
            bends: Vec::new(),
            expansions: Vec::new(),
            drives: Vec::new(),
            unknown: UnknownRecord::default(),
            agreement: None,
            covariance: None,
            budget: None,
        }
    }

    /// How sure functions and squarenesses are together, in the calibration `id`.
    ///
    /// # Errors
    /// When the numbers are none.
    pub(crate) fn covariance(&self, id: &str) -> Result<Option<ErrorCovariance>, StoreError> {
        let known = self.covariance.as_ref().map(CovarianceRecord::covariance);
        let known = known.transpose().map_err(|source| StoreError::Part {
            id: short(id),
            name: "covariance".into(),
            source: source.into(),
        })?;
        let freedom = self.agreement.and_then(|it| it.enlarged_with());
        Ok(known.map(|it| it.with_degrees_of_freedom(freedom)))
    }

    /// The error functions, in the calibration `id`.
    ///
    /// # Errors
    /// When a name is none or is there twice, or nodes form no function.
    pub fn errors(&self, id: &str) -> Result<[AxisErrors; 3], StoreError> {
        let mut axes: [AxisErrors; 3] = Default::default();
        for record in &self.functions {
            let name = error_name(&record.name);
            let taken = match name {
                Some(ErrorName::Along(axis, it)) => axes[axis.index()].along[it.index()]
                    .replace(record.function(id)?)
                    .is_some(),
                Some(ErrorName::About(axis, it)) => axes[axis.index()].about[it.index()]
                    .replace(record.function(id)?)
                    .is_some(),
                None => true,
            };
            if taken {
                return Err(no_error(id, &record.name));
            }
        }
        Ok(axes)
    }

    /// The squarenesses.
    pub fn squareness(&self) -> Squareness {
        let [y_to_x, z_to_x, z_to_y] = self.squareness_rad.map(Radians);
        Squareness {
            y_to_x,
            z_to_x,
            z_to_y,
            u: self.squareness_u_rad.map(Radians),
        }
    }

    /// Which guides bend by how much, in the calibration `id`.
    ///
    /// # Errors
    /// When an axis is none.
    pub fn bends(&self, id: &str) -> Result<Vec<IdentifiedBend>, StoreError> {
        self.bends.iter().map(|it| it.found(id)).collect()
    }

    /// How the scales expand, in the calibration `id`.
    ///
    /// # Errors
    /// When an axis is none.
    pub fn expansions(&self, id: &str) -> Result<Vec<IdentifiedExpansion>, StoreError> {
        self.expansions.iter().map(|it| it.found(id)).collect()
    }

    /// What the thermometers showed.
    pub fn temperatures(&self) -> Vec<Celsius> {
        self.temperatures_c.iter().copied().map(Celsius).collect()
    }

    /// One line about it, for lists.
    pub(crate) fn summary(&self) -> String {
        let largest = self.squareness_rad.iter().map(|it| it.abs());
        format!(
            "{} error functions, squareness up to {:.2} arcsec{}",
            self.functions.len(),
            Radians(largest.fold(0.0, f64::max)).arcsec(),
            self.unknown.summary()
        )
    }
}

/// What the detectors of one axis read when its errors were measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BeamRecord {
    /// `x`, `y` or `z`.
    pub axis: char,
    /// The slide's detector, first and second direction.
    pub slider: [FunctionRecord; 2],
    /// The end detector, where there is one.
    pub end_m: Option<[f64; 2]>,
    /// How the beam was taken to move, where its ends are known; `None` in files of earlier programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drift: Option<DriftRecord>,
    /// At each of the slide's positions, how far the end detector saw the beam from where it was on average:
    /// as far as it is taken to move the slide's reading was brought back.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wandered_m: Option<[Vec<f64>; 2]>,
}

/// How a beam moves when it moves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriftRecord {
    /// Where its source is, by the axis's scale.
    pub source_m: f64,
    /// Where its end detector is.
    pub end_m: f64,
    /// The share of the shift at the end that is sideways as a whole.
    pub translation_share: f64,
}

impl BeamRecord {
    /// How far the beam had wandered when the slide was at `position`: that of the nearest stop.
    pub(crate) fn wandered(&self, position: Metres) -> Option<[f64; 2]> {
        let nearest = self.nearest(position)?;
        let [first, second] = self.wandered_m.as_ref()?;
        Some([*first.get(nearest)?, *second.get(nearest)?])
    }

    /// How sure the means of the slide's detector are at the nearest stop, on average over both directions.
    pub(crate) fn u_slide(&self, position: Metres) -> Option<Metres> {
        let nearest = self.nearest(position)?;
        let of = |k: usize| {
            let all = self.slider[k].standard_uncertainties_si.as_ref();
            all.and_then(|it| it.get(nearest)).copied()
        };
        let (first, second) = (of(0)?, of(1)?);
        Some(Metres(((first * first + second * second) / 2.0).sqrt()))
    }

    fn nearest(&self, position: Metres) -> Option<usize> {
        let stops = self.slider[0].positions_m.iter().enumerate();
        let off = |it: &(usize, &f64)| (it.1 - position.value()).abs();
        stops
            .min_by(|a, b| off(a).total_cmp(&off(b)))
            .map(|(at, _)| at)
    }
}

/// What all detectors read when the geometry was measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BeamReferencesContent {
    /// The name of the geometry that was measured with them: displacements are what has changed
    /// since.
    pub geometry: String,
    /// By axis.
    pub beams: Vec<BeamRecord>,
    /// The roll along its axis, where only one slide's is read.
    pub roll: Option<FunctionRecord>,
    /// The rolls, where several are.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rolls: Vec<RollRecord>,
    /// How they were given beforehand, by the file that `source` names; `None` where detectors were read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub given: Option<GivenName>,
}

impl BeamReferencesContent {
    /// The name of this kind.
    pub const KIND: &'static str = "beam_references";

    /// The references of the beam along `axis`, which moves like `drift`, in the record `id`;
    /// `None` where there are none.
    ///
    /// # Errors
    /// When nodes form no function, or the beam has no length.
    pub fn beam(
        &self,
        id: &str,
        axis: Axis,
        drift: BeamDrift,
    ) -> Result<Option<BeamReference>, StoreError> {
        let letter = AXES[axis.index()];
        let Some(record) = self.beams.iter().find(|it| it.axis == letter) else {
            return Ok(None);
        };
        let [first, second] = &record.slider;
        let slider = [first.function(id)?, second.function(id)?];
        let end = record.end_m.unwrap_or_default().map(Metres);
        let reference = BeamReference::new(slider, end, drift);
        reference
            .map(Some)
            .map_err(|source| StoreError::model(&short(id), source))
    }

    /// One line about it, for lists.
    pub(crate) fn summary(&self) -> String {
        let axes: String = self.beams.iter().map(|it| it.axis).collect();
        let roll = self.rolls_text();
        let given = self.given.map_or_else(String::new, |it| {
            format!(", given beforehand as {}", it.words())
        });
        format!(
            "beams of {axes}{roll}, for geometry {}{given}",
            short(&self.geometry)
        )
    }
}

/// The error for a record with a part that three axes do not have, or that it has twice.
fn no_error(id: &str, name: &str) -> StoreError {
    let source = format!("`{name}` is not an error of three axes, or appears twice");
    StoreError::model(&short(id), source)
}

#[cfg(test)]
mod tests {
    use compensator::volumetric::online::StateMap;

    use super::*;
    use crate::store::{CalibrationRecord, Content, RecordHead};
    use crate::stores::store_in;

    fn function(values: [f64; 3]) -> Function<Metres> {
        let nodes = [0.0, 0.1, 0.25].map(Metres);
        let function = Function::new(&nodes, &values.map(Metres), Shape::Spline).unwrap();
        function.with_uncertainties(&[Metres(1e-7); 3]).unwrap()
    }

    fn stored<C: Content + PartialEq + core::fmt::Debug>(content: C) -> (String, C) {
        let folder = tempfile::tempdir().unwrap();
        let store = store_in(folder.path(), "m");
        let head = RecordHead {
            axis: "x".into(),
            ..RecordHead::default()
        };
        let record = CalibrationRecord { head, content };
        let id = store.save(&record).unwrap();
        let loaded = store.load(&id).unwrap();
        assert_eq!(loaded, record);
        (id, loaded.content)
    }

    #[test]
    fn a_geometry_comes_back_with_its_functions_and_uncertainties() {
        let mut axes: [AxisErrors; 3] = Default::default();
        axes[0].along[1] = Some(function([0.0, 2e-6, -1e-6]));
        let squareness = Squareness {
            z_to_x: Radians(3e-5),
            u: [Radians(1e-6); 3],
            ..Squareness::default()
        };
        let content = GeometryContent::new(&axes, &squareness, &[Celsius(20.5)]);
        assert_eq!(content.functions[0].name, "e_yx");
        let (id, content) = stored(content);
        assert_eq!(content.squareness(), squareness);
        assert_eq!(content.temperatures(), [Celsius(20.5)]);
        let back = content.errors(&id).unwrap();
        let (was, is) = (&axes[0].along[1], &back[0].along[1]);
        for at in [0.0, 0.07, 0.2] {
            let value = |it: &Option<Function<Metres>>| it.as_ref().unwrap().at(Metres(at));
            let off = value(was) - value(is);
            assert!(off.abs() < Metres(1e-18), "{at}");
        }
        let u = is.as_ref().unwrap().standard_uncertainty(Metres(0.2));
        assert_eq!(u, Some(Metres(1e-7)));
        assert!(back[1].along[1].is_none());
    }

    #[test]
    fn an_error_function_that_does_not_exist_or_is_there_twice_is_refused_by_name() {
        let with = |names: &[&str]| GeometryContent {
            functions: names
                .iter()
                .map(|it| FunctionRecord::of(it, &function([0.0; 3])))
                .collect(),
            ..GeometryContent::default()
        };
        for (names, wrong) in [(["e_yx", "e_wx"], "e_wx"), (["e_ax", "e_ax"], "e_ax")] {
            let refused = with(&names).errors("id").unwrap_err().to_string();
            assert!(
                refused.contains(&format!("`{wrong}` is not an error")),
                "{refused}"
            );
        }
        let mut short = with(&["e_yx"]);
        short.functions[0].values_si.pop();
        let refused = short.errors("id");
        assert!(matches!(refused, Err(StoreError::Part { .. })));
    }

    #[test]
    fn references_and_memories_come_back() {
        let one = || FunctionRecord::of("first", &function([0.0, 1e-6, 0.0]));
        let content = BeamReferencesContent {
            geometry: "abc".into(),
            beams: vec![BeamRecord {
                axis: 'y',
                slider: [one(), one()],
                end_m: Some([1e-5, -2e-5]),
                drift: None,
                wandered_m: None,
            }],
            ..BeamReferencesContent::default()
        };
        let (id, content) = stored(content);
        let drift = BeamDrift::Translating;
        let beam = content.beam(&id, Axis::Y, drift).unwrap().unwrap();
        assert_eq!(beam.end(), [Metres(1e-5), Metres(-2e-5)]);
        assert!(content.beam(&id, Axis::X, drift).unwrap().is_none());
        let mut map = StateMap::default();
        map.of[2] = Some([function([0.0, 5e-6, 0.0]), function([0.0; 3])]);
        let content = StateMemoryContent::new(MemoryName::Second, "r", &map);
        assert!(
            !serde_json::to_string(&content).unwrap().contains("rolls"),
            "as it always was"
        );
        let (id, content) = stored(content);
        let back = content.map(&id).unwrap();
        let [first, second] = back.at(Axis::Z, Metres(0.1));
        assert!((first - Metres(5e-6)).abs() < Metres(1e-18), "{first}");
        assert_eq!(second, Metres::ZERO);
        assert_eq!(content.memory, MemoryName::Second);
    }

    #[test]
    fn a_memory_with_rolls_comes_back_and_one_without_keeps_none() {
        let mut map = StateMap::default();
        let nodes = [Metres(0.0), Metres(0.5)];
        map.roll[0] = Some(Function::new(&nodes, &[Radians(1e-5); 2], Shape::Spline).unwrap());
        let content = StateMemoryContent::new(MemoryName::First, "r", &map);
        assert!(
            content.summary().contains("and the roll of x"),
            "{}",
            content.summary()
        );
        let (id, content) = stored(content);
        let back = content.map(&id).unwrap();
        assert!((back.roll_at(Axis::X, Metres(0.2)).value() - 1e-5).abs() < 1e-18);
        let mut twice = content;
        twice.rolls.push(twice.rolls[0].clone());
        let refused = twice.map(&id).unwrap_err().to_string();
        assert!(refused.contains("roll of x"), "{refused}");
        let old = r#"{"memory":"second","references":"r","axes":[]}"#;
        let old: StateMemoryContent = serde_json::from_str(old).unwrap();
        assert!(old.map("id").unwrap().roll.iter().all(Option::is_none));
    }

    #[test]
    fn a_second_memory_names_its_first_and_one_that_does_not_is_read() {
        let without = StateMemoryContent::new(MemoryName::Second, "r", &StateMap::default());
        let text = serde_json::to_string(&without).unwrap();
        assert!(!text.contains("\"first\":"), "{text}");
        let read: StateMemoryContent = serde_json::from_str(&text).unwrap();
        assert_eq!(read, without);
        let with = StateMemoryContent {
            first: Some("abc".into()),
            ..without
        };
        assert!(with.summary().contains("abc"), "{}", with.summary());
        let (_, content) = stored(with);
        let first = &content.first;
        assert_eq!(first.as_deref(), Some("abc"));
    }
}
