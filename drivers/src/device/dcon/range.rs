//! Input ranges, and the channels of an answer.

use units::Volts;
use wire::dcon::{CHANNEL_CHARACTERS, DconError, parse_volts};

/// The input range of a module (ADAM-4000 manual, input range codes).
///
/// # Example
///
/// ```
/// use drivers::device::dcon::InputRange;
/// use units::Volts;
///
/// assert_eq!(InputRange::ending_at(Volts(5.0)).map(InputRange::code), Some(0x09));
/// assert_eq!(InputRange::ending_at(Volts(7.5)), None);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InputRange {
    /// ±10 V, shown as `±dd.ddd`.
    V10,
    /// ±5 V, shown as `±d.dddd`.
    V5,
    /// ±1 V, shown as `±d.dddd`.
    V1,
    /// ±500 mV, shown in millivolts as `±ddd.dd`.
    Mv500,
    /// ±150 mV, shown in millivolts as `±ddd.dd`.
    Mv150,
}

impl InputRange {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::V10, Self::V5, Self::V1, Self::Mv500, Self::Mv150];

    /// The range that ends at `limit`, where there is one.
    pub fn ending_at(limit: Volts) -> Option<Self> {
        Self::ALL.into_iter().find(|range| range.limit() == limit)
    }

    /// The code in a module's configuration.
    pub const fn code(self) -> u8 {
        match self {
            Self::V10 => 0x08,
            Self::V5 => 0x09,
            Self::V1 => 0x0A,
            Self::Mv500 => 0x0B,
            Self::Mv150 => 0x0C,
        }
    }

    /// The end of the range.
    pub const fn limit(self) -> Volts {
        Volts(match self {
            Self::V10 => 10.0,
            Self::V5 => 5.0,
            Self::V1 => 1.0,
            Self::Mv500 => 0.5,
            Self::Mv150 => 0.15,
        })
    }

    /// Volts for each unit shown.
    const fn volts_per_unit(self) -> f64 {
        match self {
            Self::V10 | Self::V5 | Self::V1 => 1.0,
            Self::Mv500 | Self::Mv150 => 1e-3,
        }
    }
}

/// All channels of an answer `>±n.nnnn…`, each with whether it stands at the range's end.
/// The codec refuses an answer as a whole when one channel is over its range; a Hall sensor
/// whose neighbour's wire is open is still worth reading.
pub(super) fn parse_channels(
    line: &str,
    range: InputRange,
) -> Result<Vec<(Volts, bool)>, DconError> {
    const FORM: DconError = DconError::Syntax {
        expected: ">±n.nnnn for each channel",
    };
    let body = line.strip_prefix('>').ok_or(FORM)?;
    if body.is_empty() || !body.is_ascii() || !body.len().is_multiple_of(CHANNEL_CHARACTERS) {
        return Err(FORM);
    }
    let channels = 0..body.len() / CHANNEL_CHARACTERS;
    channels
        .map(|channel| {
            let start = channel * CHANNEL_CHARACTERS;
            parse_channel(&body[start..start + CHANNEL_CHARACTERS], range).ok_or(FORM)
        })
        .collect()
}

fn parse_channel(text: &str, range: InputRange) -> Option<(Volts, bool)> {
    let limit = range.limit();
    match parse_volts(&format!(">{text}")) {
        Ok(values) => {
            let volts = Volts(values.first()? * range.volts_per_unit());
            Some((volts, volts.abs() >= limit))
        }
        Err(DconError::OutOfRange { .. }) if text.starts_with('-') => Some((-limit, true)),
        Err(DconError::OutOfRange { .. }) => Some((limit, true)),
        Err(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(line: &str, range: InputRange, expected: &[(f64, bool)]) {
        let seen = parse_channels(line, range).expect(line);
        assert_eq!(seen.len(), expected.len());
        for ((volts, saturated), (want, at_end)) in seen.into_iter().zip(expected) {
            assert!((volts.value() - want).abs() < 1e-12, "{line}: {volts}");
            assert_eq!(saturated, *at_end, "{line}");
        }
    }

    #[test]
    fn an_over_range_channel_is_saturated_and_spares_the_others() {
        let line = ">+1.2345+9.9999-9.9999-5.0000";
        let expected = [(1.2345, false), (5.0, true), (-5.0, true), (-5.0, true)];
        check(line, InputRange::V5, &expected);
        check(
            ">+09.999+10.000",
            InputRange::V10,
            &[(9.999, false), (10.0, true)],
        );
    }

    #[test]
    fn millivolt_ranges_are_shown_in_millivolts() {
        check(">+123.45", InputRange::Mv150, &[(0.12345, false)]);
        check(">-500.00", InputRange::Mv500, &[(-0.5, true)]);
    }

    #[test]
    fn one_damaged_channel_spoils_the_line() {
        for line in [
            ">+1.2345+1.2x45",
            ">+1.2345+1.234",
            "+1.2345",
            ">",
            ">+1,2345",
        ] {
            assert!(parse_channels(line, InputRange::V5).is_err(), "{line}");
        }
    }
}
