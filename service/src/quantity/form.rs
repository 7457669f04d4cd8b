//! How a quantity is written, for the reader and for the description: they must not differ, since clients that were
//! generated from the description trust it.

use std::borrow::Cow;

use serde_json::json;
use utoipa::openapi::schema::{AdditionalProperties, ObjectBuilder, OneOfBuilder, Schema, Type};
use utoipa::openapi::{KnownFormat, Ref, RefOr, SchemaFormat};
use utoipa::{PartialSchema, ToSchema};

use super::{Speed, Written};
use crate::coordinate::Coordinate;

/// So many digits may stand before and behind the point, and in the exponent: enough for any double, and never
/// too much for one.
const WHOLE_MAX: usize = 12;
const FRACTION_MAX: usize = 20;
const EXPONENT_MAX: usize = 2;

/// A number as JSON has it (a plus may lead), a space or none, and one of the units.
pub(super) fn is_written(text: &str, units: &[&str]) -> bool {
    let mut numbers = units.iter().filter_map(|it| text.strip_suffix(it));
    numbers.any(|it| is_number(it.strip_suffix(' ').unwrap_or(it)))
}

fn is_number(text: &str) -> bool {
    let text = text.strip_prefix(['+', '-']).unwrap_or(text);
    let (text, exponent) = match text.split_once(['e', 'E']) {
        Some((text, exponent)) => (text, Some(exponent)),
        None => (text, None),
    };
    let (whole, fraction) = match text.split_once('.') {
        Some((whole, fraction)) => (whole, Some(fraction)),
        None => (text, None),
    };
    let exponent = exponent.map(|it| it.strip_prefix(['+', '-']).unwrap_or(it));
    has_digits(whole, WHOLE_MAX)
        && fraction.is_none_or(|it| has_digits(it, FRACTION_MAX))
        && exponent.is_none_or(|it| has_digits(it, EXPONENT_MAX))
}

fn has_digits(text: &str, most: usize) -> bool {
    (1..=most).contains(&text.len()) && text.bytes().all(|it| it.is_ascii_digit())
}

/// The same as a pattern; `sign_and_digits` has what stands before the exponent.
fn pattern(sign_and_digits: &str, units: &[&str]) -> String {
    let units = units.join("|");
    format!("^{sign_and_digits}([eE][+-]?[0-9]{{1,{EXPONENT_MAX}}})? ?({units})$")
}

fn any_number() -> String {
    format!("[+-]?[0-9]{{1,{WHOLE_MAX}}}(\\.[0-9]{{1,{FRACTION_MAX}}})?")
}

/// A digit that is not 0 stands somewhere.
fn positive_number() -> String {
    let half = WHOLE_MAX / 2;
    let tail = FRACTION_MAX / 2;
    format!(
        "\\+?([0-9]{{0,{half}}}[1-9][0-9]{{0,{}}}(\\.[0-9]{{1,{FRACTION_MAX}}})?|0\\.[0-9]{{0,{tail}}}[1-9][0-9]{{0,{}}})",
        WHOLE_MAX - half - 1,
        FRACTION_MAX - tail - 1,
    )
}

/// What a text or an object with value and unit looks like in the description.
fn described<W: Written>(
    name: &str,
    what: &str,
    sign_and_digits: &str,
    is_positive: bool,
) -> Schema {
    let units = W::UNITS;
    let text = ObjectBuilder::new()
        .schema_type(Type::String)
        .description(Some("A number and its unit"))
        .pattern(Some(pattern(sign_and_digits, &W::units_of_text())))
        .build();
    let value = ObjectBuilder::new()
        .schema_type(Type::Number)
        .format(Some(SchemaFormat::KnownFormat(KnownFormat::Double)))
        .description(Some("How much"))
        .exclusive_minimum(is_positive.then_some(0.0));
    let unit = ObjectBuilder::new()
        .schema_type(Type::String)
        .description(Some("Of what"))
        .enum_values(Some(units.iter().copied()));
    let object = ObjectBuilder::new()
        .schema_type(Type::Object)
        .title(Some(format!("{name}Value")))
        .description(Some("Value and unit"))
        .property("value", value)
        .property("unit", unit)
        .required("value")
        .required("unit")
        .additional_properties(Some(AdditionalProperties::<Schema>::FreeForm(false)))
        .build();
    OneOfBuilder::new()
        .description(Some(format!(
            "{what}: a text with its unit, or value and unit. A bare number is refused"
        )))
        .item(text)
        .item(object)
        .examples([json!(format!("12.5{}", units[1]))])
        .build()
        .into()
}

/// Where each axis goes: at least one does.
pub(crate) fn targets() -> Schema {
    ObjectBuilder::new()
        .schema_type(Type::Object)
        .description(Some(
            "Where each axis goes, in machine coordinates. The axes begin in one tick and end each in its own time; \
             those of a platform (x, y, theta) and of three axes that are corrected together move as one",
        ))
        .additional_properties(Some(Ref::from_schema_name(PlaceIn::name())))
        .min_properties(Some(1))
        .examples([json!({"x": "12.5mm"})])
        .build()
        .into()
}

macro_rules! described {
    ($(#[$said:meta])* $name:ident, $schema:expr) => {
        $(#[$said])*
        #[derive(Debug)]
        pub(crate) struct $name;

        impl PartialSchema for $name {
            fn schema() -> RefOr<Schema> {
                $schema.into()
            }
        }

        impl ToSchema for $name {
            fn name() -> Cow<'static, str> {
                stringify!($name).into()
            }
        }
    };
}

described!(
    /// A [`Coordinate`] in the description.
    PlaceIn,
    described::<Coordinate>("Place", "A length, or an angle of an axis that turns", &any_number(), false)
);
described!(
    /// A [`Speed`] with its direction in the description.
    SpeedIn,
    described::<Speed>("Speed", "A speed, or an angular speed of an axis that turns, with its sign", &any_number(), false)
);
described!(
    /// A [`Speed`] that is positive in the description.
    TravelSpeedIn,
    described::<Speed>("TravelSpeed", "A speed, or an angular speed of axes that turn, that is not 0", &positive_number(), true)
);
