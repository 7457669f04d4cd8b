//! Whole numbers as JSON has them: `30` and `30.0` are one number, and some languages write the second.

use serde::{Deserialize, Deserializer, de};

#[derive(Clone, Copy, Debug)]
struct Whole(u32);

impl<'de> Deserialize<'de> for Whole {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let number = f64::deserialize(from)?;
        let is_whole = number.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&number);
        let whole = is_whole.then_some(Self(number as u32));
        whole.ok_or_else(|| {
            let seen = de::Unexpected::Float(number);
            de::Error::invalid_value(seen, &"a whole number that is not negative")
        })
    }
}

pub(super) fn read<'de, D: Deserializer<'de>>(from: D) -> Result<u32, D::Error> {
    Whole::deserialize(from).map(|it| it.0)
}

pub(super) fn maybe<'de, D: Deserializer<'de>>(from: D) -> Result<Option<u32>, D::Error> {
    let read = Option::<Whole>::deserialize(from)?;
    Ok(read.map(|it| it.0))
}

#[cfg(test)]
mod tests {
    use crate::request::LeaseRequest;

    #[test]
    fn a_whole_number_is_one_with_and_without_a_point() {
        let seconds = |text: &str| {
            let body = format!(r#"{{"name": "anna", "seconds": {text}}}"#);
            serde_json::from_str::<LeaseRequest>(&body).map(|it| it.seconds)
        };
        assert_eq!(seconds("30").unwrap(), 30);
        assert_eq!(seconds("30.0").unwrap(), 30);
        for text in ["30.5", "-1", "1e12", "\"30\"", "null", "true"] {
            assert!(seconds(text).is_err(), "{text}");
        }
    }
}
