//! What roll detectors read, of one slide or of several.

use compensator::volumetric::Axis;
use compensator::volumetric::function::Function;
use serde::{Deserialize, Serialize};
use units::Radians;

use super::{AXES, BeamReferencesContent, FunctionRecord};
use crate::store::StoreError;
use crate::volumetric::VolumetricConfig;

/// The roll of one slide of several.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RollRecord {
    /// `x`, `y` or `z`.
    pub axis: char,
    /// Along its travel.
    pub roll: FunctionRecord,
}

impl BeamReferencesContent {
    /// Takes down the rolls of a machine. One alone is written as it always was, without its axis, which is the
    /// configuration's.
    pub(crate) fn set_rolls(&mut self, mut rolls: Vec<(Axis, FunctionRecord)>) {
        if let [_] = &*rolls {
            self.roll = rolls.pop().map(|(_, roll)| roll);
            return;
        }
        let rolls = rolls.into_iter().map(|(axis, roll)| RollRecord {
            axis: AXES[axis.index()],
            roll,
        });
        self.rolls = rolls.collect();
    }

    /// The record of the roll of `axis` of the machine of `config`.
    pub(crate) fn roll_record(
        &self,
        config: &VolumetricConfig,
        axis: Axis,
    ) -> Option<&FunctionRecord> {
        config.rolls()[axis.index()]?;
        let letter = AXES[axis.index()];
        let own = self.rolls.iter().find(|it| it.axis == letter);
        match config.roll.each() {
            [_] => self.roll.as_ref().or(own.map(|it| &it.roll)),
            _ => own.map(|it| &it.roll),
        }
    }

    /// The references of the rolls of x, y and z of the machine of `config`, in the record `id`; `None` where there
    /// is none.
    ///
    /// # Errors
    /// When nodes form no function.
    pub(crate) fn rolls(
        &self,
        id: &str,
        config: &VolumetricConfig,
    ) -> Result<[Option<Function<Radians>>; 3], StoreError> {
        let mut rolls = [None, None, None];
        for axis in Axis::ALL {
            let record = self.roll_record(config, axis);
            rolls[axis.index()] = record.map(|it| it.function(id)).transpose()?;
        }
        Ok(rolls)
    }

    /// ` and roll`, ` and the rolls of xy`, or nothing.
    pub(crate) fn rolls_text(&self) -> String {
        let axes: String = self.rolls.iter().map(|it| it.axis).collect();
        match (&self.roll, &*axes) {
            (Some(_), _) => " and roll".to_owned(),
            (None, "") => String::new(),
            (None, axes) => format!(" and the rolls of {axes}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use compensator::volumetric::function::Shape;
    use units::Metres;

    use super::*;
    use crate::config::parse;
    use crate::volumetric::config::with_three_rolls;

    const ONE: &str = include_str!("../../../../configs/machines/volumetric.toml");

    fn record(radians: f64) -> FunctionRecord {
        let nodes = [Metres(0.0), Metres(0.5)];
        let function = Function::new(&nodes, &[Radians(radians); 2], Shape::Spline).unwrap();
        FunctionRecord::of("roll", &function)
    }

    fn config(text: &str) -> VolumetricConfig {
        parse(text, "m").unwrap().config.volumetric.unwrap()
    }

    fn at(rolls: &[Option<Function<Radians>>; 3]) -> [Option<f64>; 3] {
        [0, 1, 2].map(|k| rolls[k].as_ref().map(|it| it.at(Metres(0.1)).value()))
    }

    /// What earlier programs wrote has no axis: it is that of the only detectors that there were.
    #[test]
    fn the_roll_of_one_slide_is_written_as_ever_and_those_of_several_with_their_axes() {
        let mut content = BeamReferencesContent::default();
        content.set_rolls(vec![(Axis::X, record(1e-6))]);
        let text = serde_json::to_string(&content).unwrap();
        assert!(!text.contains("rolls"), "{text}");
        assert_eq!(content.rolls_text(), " and roll");
        let rolls = content.rolls("id", &config(ONE)).unwrap();
        assert_eq!(at(&rolls), [Some(1e-6), None, None]);

        let several = with_three_rolls();
        let rolls = content.rolls("id", &config(&several)).unwrap();
        assert_eq!(at(&rolls), [None; 3], "whose it is nobody knows any more");
        let mut content = BeamReferencesContent::default();
        content.set_rolls(vec![(Axis::X, record(1e-6)), (Axis::Z, record(3e-6))]);
        assert_eq!(content.rolls_text(), " and the rolls of xz");
        let text = serde_json::to_string(&content).unwrap();
        let read: BeamReferencesContent = serde_json::from_str(&text).unwrap();
        let rolls = read.rolls("id", &config(&several)).unwrap();
        assert_eq!(at(&rolls), [Some(1e-6), None, Some(3e-6)]);
    }
}
