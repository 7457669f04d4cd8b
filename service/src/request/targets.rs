//! The targets of a motion as JSON has them, each axis once.

use core::fmt;

use serde::Deserializer;
use serde::de::{Error, MapAccess, Visitor};

use super::Target;

/// Reads targets. An axis that is named twice is refused: which place is meant is not known.
pub(super) fn read<'de, D: Deserializer<'de>>(from: D) -> Result<Target, D::Error> {
    from.deserialize_map(Targets)
}

struct Targets;

impl<'de> Visitor<'de> for Targets {
    type Value = Target;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object with a place for each axis: {\"x\": \"12.5mm\"}")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut given: A) -> Result<Target, A::Error> {
        let mut targets = Target::new();
        while let Some(axis) = given.next_key::<String>()? {
            let place = given.next_value()?;
            if targets.contains_key(&axis) {
                let what = format!("`targets`: `{axis}` is named twice; name each axis once");
                return Err(A::Error::custom(what));
            }
            targets.insert(axis, place);
        }
        Ok(targets)
    }
}

#[cfg(test)]
mod tests {
    use crate::request::MoveRequest;

    #[test]
    fn an_axis_that_is_named_twice_is_refused() {
        let read = |text: &str| serde_json::from_str::<MoveRequest>(text);
        let once = read(r#"{"targets": {"x": "1mm", "y": "2mm"}}"#).unwrap();
        assert_eq!(once.targets.len(), 2);
        for places in [r#""1mm", "x": "2mm""#, r#""1mm", "y": "3mm", "x": "1mm""#] {
            let text = format!(r#"{{"targets": {{"x": {places}}}}}"#);
            let said = read(&text).unwrap_err().to_string();
            assert!(said.contains("`x` is named twice"), "{text}: {said}");
        }
    }
}
