//! What `move` says of a linear axis: the encoder's place, and plainly what was not corrected.

use machine::records::short;
use serde_json::{Value, json};
use units::{Metres, Short};

use crate::linear::Corrected;
use crate::linear::moved::Moved;
use crate::program::linear::uncertainty;

/// For people: where the encoder stands, then what to know about the correction.
pub(crate) fn text(axis: &str, moved: &Moved, calibration: Option<&str>) -> String {
    let by = calibration.map_or(String::new(), |id| format!(", calibration {}", short(id)));
    let mut text = format!(
        "axis {axis}: encoder at {:.6} mm (target {:.6} mm, set-point {:.6} mm{by})",
        moved.encoder.mm(),
        moved.target.mm(),
        moved.set_point.mm()
    );
    if let Some(place) = moved.place {
        text += &format!(
            "\naxis {axis}: the point stands at {:.6} mm, {}",
            place.mm(),
            uncertainty_of(moved)
        );
    }
    if let Some(warning) = warning(moved) {
        text += &format!("\naxis {axis}: {warning}");
    }
    text
}

/// The same for programs.
pub(crate) fn value(axis: &str, moved: &Moved, calibration: Option<&str>) -> Value {
    let range = match moved.corrected {
        Corrected::No | Corrected::Within => None,
        Corrected::Held { first, last } | Corrected::Fading { first, last, .. } => {
            Some((first, last))
        }
    };
    json!({
        "axis": axis,
        "target_mm": moved.target.mm(),
        "set_point_mm": moved.set_point.mm(),
        "encoder_mm": moved.encoder.mm(),
        "place_mm": moved.place.map(Metres::mm),
        "uncertainty": uncertainty::combined(moved.uncertainty),
        "calibration": calibration,
        "corrected": moved.corrected.word(),
        "beyond_calibrated_mm": range.map(|(first, last)| [first.mm(), last.mm()]),
        "warning": warning(moved),
    })
}

/// How uncertain the place of the point is, or why nobody says it.
pub(super) fn uncertainty_of(moved: &Moved) -> String {
    match (&moved.uncertainty, moved.corrected) {
        (Some(combined), _) => uncertainty::said(combined),
        (None, Corrected::Held { .. } | Corrected::Fading { .. }) => {
            "its uncertainty NOT STATED here: beyond the calibrated range".into()
        }
        (None, Corrected::Within | Corrected::No) => {
            format!("its uncertainty {}", uncertainty::NOT_KNOWN)
        }
    }
}

/// What of the move nobody measured.
fn warning(moved: &Moved) -> Option<String> {
    warning_of(moved.corrected, moved.target)
}

/// The same of a move to `target` that is not made yet.
pub(super) fn warning_of(corrected: Corrected, target: Metres) -> Option<String> {
    let beyond = |first: Metres, last: Metres| {
        format!(
            "{} mm is BEYOND THE CALIBRATED RANGE of {} to {} mm",
            Short(target.mm()),
            Short(first.mm()),
            Short(last.mm())
        )
    };
    match corrected {
        Corrected::Within => None,
        Corrected::No => Some(
            "NOT CORRECTED: the drive went to the target by its encoder alone, and the point is off by the \
             deviation of the stage there"
                .into(),
        ),
        Corrected::Held { first, last } => Some(format!(
            "{}; the correction at its end was held, the deviation of the stage here was never \
             measured, and no uncertainty is stated; calibrate a wider range, or set end_policy = \"refuse\"",
            beyond(first, last)
        )),
        Corrected::Fading {
            first,
            last,
            distance,
        } => Some(format!(
            "{}; the correction at its end fades to zero over {} mm, the deviation of the stage here \
             was never measured, and no uncertainty is stated; calibrate a wider range, or set end_policy = \
             \"refuse\"",
            beyond(first, last),
            Short(distance.mm())
        )),
    }
}

#[cfg(test)]
mod tests {
    use compensator::budget::Combined;
    use units::Approach;

    use super::*;

    fn moved(corrected: Corrected) -> Moved {
        let is_known = corrected == Corrected::Within;
        let combined = Combined {
            standard_uncertainty: Metres::from_um(0.123),
            degrees_of_freedom: None,
        };
        Moved {
            target: Metres::from_mm(61.0),
            set_point: Metres::from_mm(60.997_123),
            encoder: Metres::from_mm(60.997_111),
            approach: Approach::Forward,
            corrected,
            place: (corrected != Corrected::No).then_some(Metres::from_mm(60.999_988)),
            uncertainty: is_known.then_some(combined),
        }
    }

    const ID: &str = "0123456789abcdef";
    const RANGE: (Metres, Metres) = (Metres(0.0), Metres(0.06));

    #[track_caller]
    fn check(corrected: Corrected, id: Option<&str>, word: &str, said: Option<&str>) {
        let moved = moved(corrected);
        let (text, value) = (text("x", &moved, id), value("x", &moved, id));
        let head = "axis x: encoder at 60.997111 mm (target 61.000000 mm, set-point 60.997123 mm";
        assert!(text.starts_with(head), "{text}");
        assert_eq!(value["encoder_mm"], moved.encoder.mm());
        assert_eq!(value["corrected"], word);
        let has_place = corrected != Corrected::No;
        assert_eq!(
            text.contains("the point stands at 60.999988 mm"),
            has_place,
            "{text}"
        );
        assert_eq!(value["place_mm"].is_number(), has_place);
        match said {
            None => {
                assert!(text.ends_with("U = 0.246 µm (k = 2)"), "{text}");
                assert_eq!(value["uncertainty"]["expanded_um"], 0.246);
                assert_eq!(value["warning"], Value::Null);
            }
            Some(said) => {
                assert!(
                    text.lines().last().is_some_and(|it| it.contains(said)),
                    "{text}"
                );
                assert!(!text.contains("U = "), "{text}");
                assert_eq!(text.contains("its uncertainty NOT STATED here"), has_place);
                assert_eq!(value["uncertainty"], Value::Null);
                assert!(
                    value["warning"]
                        .as_str()
                        .is_some_and(|it| it.contains(said))
                );
            }
        }
    }

    #[test]
    fn a_calibration_without_a_budget_states_no_uncertainty_and_says_why() {
        let moved = Moved {
            uncertainty: None,
            ..moved(Corrected::Within)
        };
        let text = text("x", &moved, Some(ID));
        assert!(
            text.ends_with("has no uncertainty budget; calibrate again"),
            "{text}"
        );
    }

    #[test]
    fn what_nobody_measured_is_said_plainly_in_text_and_in_json() {
        let (first, last) = RANGE;
        check(Corrected::Within, Some(ID), "yes", None);
        check(Corrected::No, None, "no", Some("NOT CORRECTED"));
        let said = "61 mm is BEYOND THE CALIBRATED RANGE of 0 to 60 mm; the correction at its end \
                    was held";
        check(
            Corrected::Held { first, last },
            Some(ID),
            "held",
            Some(said),
        );
        let fading = Corrected::Fading {
            first,
            last,
            distance: Metres::from_mm(5.0),
        };
        check(fading, Some(ID), "fading", Some("fades to zero over 5 mm"));
    }
}
