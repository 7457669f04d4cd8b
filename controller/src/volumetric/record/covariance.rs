//! How sure all errors of three axes together are, as it is stored.

use compensator::volumetric::model::{COVARIANCE_ENTRIES, CovarianceError, ErrorCovariance};
use machine::records::sound::{Judged, PLACE_M, as_many, counted, increasing, model, numbers};
use serde::{Deserialize, Serialize};
use units::Metres;

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
}

impl CovarianceRecord {
    /// What is known.
    pub(crate) fn of(known: &ErrorCovariance) -> Self {
        let values = |it: Vec<Metres>| it.into_iter().map(Metres::value).collect();
        Self {
            positions_m: known.positions().map(values),
            upper_si: known.places().iter().map(|it| it.to_vec()).collect(),
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
        ErrorCovariance::new(
            self.positions_m.each_ref().map(metres),
            places.collect::<Result<_, _>>()?,
        )
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
