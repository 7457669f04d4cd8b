//! How sure all errors of three axes together are, as it is stored.

use compensator::volumetric::Axis;
use compensator::volumetric::model::{
    COVARIANCE_ENTRIES, Coefficient, CoefficientCovariance, CovarianceError, ErrorCovariance,
};
use machine::records::sound::{Judged, PLACE_M, as_many, counted, increasing, model, numbers};
use serde::{Deserialize, Serialize};
use units::Metres;

use crate::volumetric::AXES;

/// Places along one axis at most.
const PLACES_MAX: usize = 50;

/// The covariance of the tool's deviation and turn at places of the volume.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CovarianceRecord {
    /// Where the places are along x, y and z.
    pub positions_m: [Vec<f64>; 3],
    /// For each place, in the order of x, then y, then z, z the fastest: the upper triangle, row by row, for displacements
    /// along x, y, z in metres and turns about x, y, z in radians, of a tool at the point that the errors are of.
    pub upper_si: Vec<Vec<f64>>,
    /// What these have in common with thermal coefficients that were found with them; `None` in files of earlier programs,
    /// and where no warmth was looked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coefficients: Option<CoefficientsRecord>,
}

/// Thermal coefficients, each in units of its own standard uncertainty.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CoefficientsRecord {
    /// Which: `x` for the expansion of its scale, `xz` for a bend of its guide towards z.
    pub names: Vec<String>,
    /// Their correlations, row by row.
    pub correlations: Vec<f64>,
    /// For each place, in the order of `upper_si`, and for each coefficient: its covariance with displacements along x, y,
    /// z in metres and turns about x, y, z in radians.
    pub with_errors_si: Vec<Vec<[f64; 6]>>,
}

impl CoefficientsRecord {
    fn of(known: &CoefficientCovariance) -> Option<Self> {
        let name = |it: &Coefficient| match it {
            Coefficient::Expansion(axis) => AXES[axis.index()].to_string(),
            Coefficient::Bend(axis, towards) => {
                [axis, towards].map(|it| AXES[it.index()]).iter().collect()
            }
        };
        (!known.coefficients.is_empty()).then(|| Self {
            names: known.coefficients.iter().map(name).collect(),
            correlations: known.correlations.clone(),
            with_errors_si: known.with_errors.clone(),
        })
    }

    /// The same to compute with; a name that is none is refused as what does not fit.
    fn covariance(&self) -> Result<CoefficientCovariance, CovarianceError> {
        let named = self.names.iter().map(|it| coefficient(it));
        let coefficients: Option<Vec<_>> = named.collect();
        Ok(CoefficientCovariance {
            coefficients: coefficients.ok_or(CovarianceError::Coefficients)?,
            correlations: self.correlations.clone(),
            with_errors: self.with_errors_si.clone(),
        })
    }
}

fn coefficient(name: &str) -> Option<Coefficient> {
    let axes: Option<Vec<Axis>> = name.chars().map(Axis::of_letter).collect();
    match axes?[..] {
        [axis] => Some(Coefficient::Expansion(axis)),
        [axis, towards] if axis != towards => Some(Coefficient::Bend(axis, towards)),
        _ => None,
    }
}

impl CovarianceRecord {
    /// What is known.
    pub(crate) fn of(known: &ErrorCovariance) -> Self {
        let values = |it: Vec<Metres>| it.into_iter().map(Metres::value).collect();
        Self {
            positions_m: known.positions().map(values),
            upper_si: known.places().iter().map(|it| it.to_vec()).collect(),
            coefficients: CoefficientsRecord::of(known.warmth()),
        }
    }

    /// The same to compute with.
    ///
    /// # Errors
    /// When the numbers are none.
    pub(crate) fn covariance(&self) -> Result<ErrorCovariance, CovarianceError> {
        let metres = |it: &Vec<f64>| it.iter().copied().map(Metres).collect();
        let places = self.upper_si.iter().enumerate();
        let places = places.map(|(place, it)| {
            <[f64; COVARIANCE_ENTRIES]>::try_from(&it[..])
                .map_err(|_| CovarianceError::Value { place })
        });
        let errors = ErrorCovariance::new(
            self.positions_m.each_ref().map(metres),
            places.collect::<Result<_, _>>()?,
        )?;
        match &self.coefficients {
            Some(own) => errors.with_coefficients(own.covariance()?),
            None => Ok(errors),
        }
    }

    /// Whether it can be so.
    pub(crate) fn judge(&self) -> Judged {
        for (axis, own) in ["x", "y", "z"].into_iter().zip(&self.positions_m) {
            let place = format!("covariance.positions_m.{axis}");
            counted(&place, own.len(), 2..=PLACES_MAX)?;
            numbers(&place, own, &PLACE_M)?;
            increasing(&place, own)?;
        }
        let wanted = self.positions_m.iter().map(Vec::len).product();
        let place = "covariance.upper_si";
        as_many(place, self.upper_si.len(), wanted, "the places")?;
        for (at, own) in self.upper_si.iter().enumerate() {
            let place = format!("{place}[{at}]");
            as_many(&place, own.len(), COVARIANCE_ENTRIES, "an upper triangle")?;
        }
        model("covariance", self.covariance())
    }
}
