//! Quantities as they go in and come out: the unit is never guessed.

use core::fmt;

use serde::de::{self, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use units::{AxisSpeed, Metres, MetresPerSecond, Radians, RadiansPerSecond, text};
use utoipa::ToSchema;

mod form;

pub(crate) use form::{PlaceIn, SpeedIn, TravelSpeedIn, targets};

use crate::coordinate::Coordinate;

/// A value and its unit, as it comes out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Quantity {
    /// How much.
    pub value: f64,
    /// Of what: `mm`, `um`, `deg`, `arcsec`, `mm/s`, `deg/s`.
    pub unit: String,
}

impl Quantity {
    /// A position or a way, in millimetres.
    pub fn mm(length: Metres) -> Self {
        Self {
            value: length.mm(),
            unit: "mm".into(),
        }
    }

    /// A small length, in micrometres.
    pub fn um(length: Metres) -> Self {
        Self {
            value: length.um(),
            unit: "um".into(),
        }
    }

    /// An angle, in degrees.
    pub fn deg(angle: Radians) -> Self {
        Self {
            value: angle.degrees(),
            unit: "deg".into(),
        }
    }

    /// A small angle, in arcseconds.
    pub fn arcsec(angle: Radians) -> Self {
        Self {
            value: angle.arcsec(),
            unit: "arcsec".into(),
        }
    }

    /// A speed along a way, in millimetres per second.
    pub fn mm_per_s(speed: MetresPerSecond) -> Self {
        Self {
            value: speed.value() * 1e3,
            unit: "mm/s".into(),
        }
    }

    /// A speed of what turns, in degrees per second.
    pub fn deg_per_s(speed: RadiansPerSecond) -> Self {
        Self {
            value: speed.value().to_degrees(),
            unit: "deg/s".into(),
        }
    }

    /// The length that it is; `None` when it is none.
    pub fn length(&self) -> Option<Metres> {
        text::length(&self.text())
    }

    /// The angle that it is; `None` when it is none.
    pub fn angle(&self) -> Option<Radians> {
        text::angle(&self.text())
    }

    fn text(&self) -> String {
        format!("{}{}", self.value, self.unit)
    }
}

impl Coordinate {
    /// As it is shown: in millimetres or degrees.
    pub(crate) fn shown(self) -> Quantity {
        match self {
            Self::Length(it) => Quantity::mm(it),
            Self::Angle(it) => Quantity::deg(it),
        }
    }

    /// As something small is shown: in micrometres or arcseconds.
    pub(crate) fn small(self) -> Quantity {
        match self {
            Self::Length(it) => Quantity::um(it),
            Self::Angle(it) => Quantity::arcsec(it),
        }
    }
}

/// A quantity that is written with its unit.
trait Written: Sized {
    /// What is expected, with examples.
    const EXPECTED: &'static str;
    /// The units that it may have.
    const UNITS: &'static [&'static str];
    /// As people type them in a text besides.
    const TYPED: &'static [&'static str];

    fn units_of_text() -> Vec<&'static str> {
        [Self::UNITS, Self::TYPED].concat()
    }

    fn from_text(text: &str) -> Option<Self>;
}

impl Written for Coordinate {
    const EXPECTED: &'static str = "a length with its unit (m, mm, um or nm), or an angle of an axis that turns (deg, \
                                    arcmin, arcsec, mrad or rad): \"12.5mm\" or {\"value\": 12.5, \"unit\": \"mm\"}";
    const UNITS: &'static [&'static str] = &[
        "m", "mm", "um", "nm", "deg", "arcmin", "arcsec", "mrad", "rad",
    ];
    const TYPED: &'static [&'static str] = &["µm"];

    fn from_text(text: &str) -> Option<Self> {
        let length = text::length(text).map(Self::Length);
        length.or_else(|| text::angle(text).map(Self::Angle))
    }
}

/// A speed as it goes in: `"20mm/s"`, `"5deg/s"` or `{"value": 20, "unit": "mm/s"}`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Speed(pub AxisSpeed);

impl<S: Into<AxisSpeed>> From<S> for Speed {
    fn from(speed: S) -> Self {
        Self(speed.into())
    }
}

impl Written for Speed {
    const EXPECTED: &'static str = "a speed with its unit (m/s, mm/s or um/s), or an angular speed of an axis that \
                                    turns (deg/s, arcmin/s, arcsec/s, mrad/s, rad/s or rpm): \"20mm/s\" or \
                                    {\"value\": 20, \"unit\": \"mm/s\"}";
    const UNITS: &'static [&'static str] = &[
        "m/s", "mm/s", "um/s", "deg/s", "arcmin/s", "arcsec/s", "mrad/s", "rad/s", "rpm",
    ];
    const TYPED: &'static [&'static str] = &["µm/s"];

    fn from_text(text: &str) -> Option<Self> {
        text::axis_speed(text).map(Self)
    }
}

struct Reader<W>(core::marker::PhantomData<W>);

impl<'de, W: Written> Visitor<'de> for Reader<W> {
    type Value = W;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(W::EXPECTED)
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<W, E> {
        let read = Some(text).filter(|it| form::is_written(it, &W::units_of_text()));
        let read = read.and_then(W::from_text);
        read.ok_or_else(|| E::invalid_value(de::Unexpected::Str(text), &self))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<W, A::Error> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Object {
            value: f64,
            unit: String,
        }
        let object = Object::deserialize(de::value::MapAccessDeserializer::new(map))?;
        let text = format!("{}{}", object.value, object.unit);
        let read = Some(&text).filter(|_| W::UNITS.contains(&&*object.unit));
        let read = read.and_then(|it| W::from_text(it));
        read.ok_or_else(|| de::Error::invalid_value(de::Unexpected::Str(&text), &self))
    }
}

macro_rules! written {
    ($name:ident, $show:expr) => {
        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
                from.deserialize_any(Reader(core::marker::PhantomData))
            }
        }

        impl Serialize for $name {
            fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
                $show(self).serialize(to)
            }
        }
    };
}

written!(Coordinate, |it: &Coordinate| match it {
    Coordinate::Length(it) => Quantity::mm(*it),
    // Read again, it is the same to the last bit: the same request is one motion, also after a restart.
    Coordinate::Angle(it) => Quantity {
        value: it.value(),
        unit: "rad".into(),
    },
});
written!(Speed, |it: &Speed| match it.0 {
    AxisSpeed::Linear(it) => Quantity {
        value: it.value() * 1e3,
        unit: "mm/s".into(),
    },
    // As with angles.
    AxisSpeed::Angular(it) => Quantity {
        value: it.value(),
        unit: "rad/s".into(),
    },
});

#[cfg(test)]
mod tests {
    use units::{MetresPerSecond, RadiansPerSecond};

    use super::*;

    #[test]
    fn a_quantity_has_a_unit_or_is_refused_with_an_example() {
        let read = |text: &str| {
            let place = serde_json::from_str::<Coordinate>(text);
            place.map(|it| it.shown().value)
        };
        assert_eq!(read("\"12.5mm\"").unwrap(), 12.5);
        assert_eq!(read("\"250 µm\"").unwrap(), 0.25);
        assert_eq!(read(r#"{"value": 3, "unit": "mm"}"#).unwrap(), 3.0);
        assert!((read("\"-30arcmin\"").unwrap() + 0.5).abs() < 1e-12);
        for text in [
            "12.5",
            "3",
            "\"12.5\"",
            "\"nanmm\"",
            "\"1mm/s\"",
            "null",
            r#"{"value": 3, "unit": "turns"}"#,
            "\"90 °\"",
            r#"{"value": 3}"#,
            r#"{"value": 3, "unit": "mm", "more": 1}"#,
            r#"{"value": 3, "unit": "0mm"}"#,
            "\" 1mm\"",
            "\"1  mm\"",
            "\".5mm\"",
            "\"infmm\"",
            "\"1e999mm\"",
        ] {
            assert!(read(text).is_err(), "{text}");
        }
        let said = read("12.5").unwrap_err().to_string();
        assert!(said.contains("\"12.5mm\""), "{said}");
    }

    #[test]
    fn what_is_written_is_read_again() {
        for place in [
            Coordinate::Length(Metres::from_mm(-0.25)),
            Coordinate::Angle(Radians::from_degrees(12.3)),
        ] {
            let text = serde_json::to_string(&place).unwrap();
            assert_eq!(serde_json::from_str::<Coordinate>(&text).unwrap(), place);
        }
        for speed in ["\"20mm/s\"", "\"-12.3arcsec/s\"", "\"0.7rpm\""] {
            let speed: Speed = serde_json::from_str(speed).unwrap();
            let text = serde_json::to_string(&speed).unwrap();
            assert_eq!(serde_json::from_str::<Speed>(&text).unwrap(), speed);
        }
    }

    #[test]
    fn a_speed_is_along_a_way_or_round_a_turn_and_says_which() {
        let read = |text: &str| serde_json::from_str::<Speed>(text).map(|it| it.0);
        let linear = AxisSpeed::from(MetresPerSecond(-0.5 * 1e-3));
        assert_eq!(read("\"-0.5 mm/s\"").unwrap(), linear);
        let angular = AxisSpeed::from(RadiansPerSecond(core::f64::consts::PI));
        for text in [
            "\"180deg/s\"",
            "\"30 rpm\"",
            r#"{"value": 180, "unit": "deg/s"}"#,
        ] {
            assert_eq!(read(text).unwrap(), angular, "{text}");
        }
        for text in [
            "5",
            "\"5deg\"",
            "\"5rad\"",
            "\"5turns/s\"",
            "\"5 °/s\"",
            "\"nandeg/s\"",
        ] {
            let said = read(text).unwrap_err().to_string();
            assert!(
                said.contains("deg/s") && said.contains("\"20mm/s\""),
                "{said}"
            );
        }
    }
}
