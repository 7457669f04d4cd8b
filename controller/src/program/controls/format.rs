//! The formats, and what is missing for those that are not written.

use clap::ValueEnum;

use crate::Failure;

/// Whose table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum FormatName {
    /// Deviations and uncertainties in columns, for people and programs; `cal import` reads it.
    Csv,
    /// Digital Calibration Certificate (PTB, schema 3.3.0) of a linear or rotary axis, a platform's screw or three axes:
    /// in-house, not accredited, not signed.
    Dcc,
    /// LinuxCNC: COMP_FILE with COMP_FILE_TYPE = 1.
    Linuxcnc,
    /// Turbo PMAC: DEFINE COMP and DEFINE BLCOMP.
    Pmac,
    /// SINUMERIK 840D sl, 828D, 808D: $AA_ENC_COMP, leadscrew and encoder errors.
    SinumerikEec,
    /// Aerotech, one axis: refused, the sign of its values is not settled.
    Aerotech,
    /// Aerotech, a plane: refused, the sign of its values is not settled.
    Aerotech2d,
    /// ACS, ErrorMap1D: refused, the sign of its values is not settled.
    Acs,
    /// SINUMERIK, $AN_CEC: refused, the sign of its values is not settled.
    SinumerikCec,
    /// Etalon exchange format: refused, the sign of its values is not settled.
    Etalon,
}

impl FormatName {
    /// How its users call it.
    pub(super) const fn in_words(self) -> &'static str {
        match self {
            Self::Csv => "CSV",
            Self::Dcc => "DCC",
            Self::Linuxcnc => "LinuxCNC",
            Self::Pmac => "Turbo PMAC",
            Self::SinumerikEec => "SINUMERIK $AA_ENC_COMP",
            Self::Aerotech => "Aerotech 1D",
            Self::Aerotech2d => "Aerotech 2D",
            Self::Acs => "ACS ErrorMap1D",
            Self::SinumerikCec => "SINUMERIK $AN_CEC",
            Self::Etalon => "Etalon",
        }
    }

    /// As it is written on the command line.
    pub(super) fn word(self) -> String {
        let value = self.to_possible_value().expect("no format is hidden");
        value.get_name().to_owned()
    }

    /// The options that it has a use for.
    pub(super) const fn takes(self) -> &'static [&'static str] {
        match self {
            Self::Dcc => &["--laboratory", "--country", "--person"],
            Self::Linuxcnc | Self::SinumerikEec => &["--approach", "--step", "--name"],
            Self::Pmac => &["--approach", "--step", "--name", "--counts"],
            // The calibration as it is; the others are not written.
            Self::Csv
            | Self::Aerotech
            | Self::Aerotech2d
            | Self::Acs
            | Self::SinumerikCec
            | Self::Etalon => &[],
        }
    }

    /// # Errors
    /// When nothing public says what a value of it does: a table with the wrong sign doubles the error.
    pub(super) fn require_settled(self) -> Result<(), Failure> {
        let Some((known, settled_by)) = self.unsettled() else {
            return Ok(());
        };
        let name = self.in_words();
        Err(Failure::Usage {
            what: format!(
                "--format {}: whether {name} adds a value to the position or takes it away is nowhere stated that we \
                 could read ({known}), and a table with the wrong sign doubles the error",
                self.word()
            ),
            help: format!(
                "use --format csv and convert it by your control's manual; what would settle it: {settled_by}"
            ),
        })
    }

    /// What is known all the same, and what would settle the rest.
    const fn unsettled(self) -> Option<(&'static str, &'static str)> {
        const AEROTECH: (&str, &str) = (
            "the help of Automation1, `Axis Calibration`, states straight lines between values, ends that hold, one \
             value for both directions, axis numbers from 1 and signs that follow the encoder",
            "a table with one value on a stage with a laser, or a page of the maker that says which way a positive \
             value moves the axis",
        );
        match self {
            Self::Csv | Self::Dcc | Self::Linuxcnc | Self::Pmac | Self::SinumerikEec => None,
            Self::Aerotech | Self::Aerotech2d => Some(AEROTECH),
            Self::Acs => Some((
                "public programs show how ERRORMAP1D is called: axis, zone, base, step, array",
                "the ACSPL+ reference of ERRORMAP1D, or a map with one value on a stage with a laser",
            )),
            Self::SinumerikCec => Some((
                "function manual K3 states the table's places, its ends, directions, and that the value changes the \
                 set-point of the compensation axis; not in which sense",
                "the worked example of sag compensation in K3 with its drawing, or a table with one value on a machine",
            )),
            Self::Etalon => Some((
                "Beckhoff TF5280 shows the layout, the names of ISO 230-1 and the units; its option `negate` shows that \
                 both signs are met",
                "a file of Etalon's own program together with the measured errors it was made from",
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_settled_is_refused_with_what_would_settle_it() {
        for format in FormatName::value_variants() {
            let Err(refused) = format.require_settled() else {
                continue;
            };
            assert_eq!(refused.exit_code(), 2);
            let said = refused.to_string();
            let expected = [
                &format!("--format {}", format.word()),
                "what would settle it",
            ];
            assert!(expected.iter().all(|it| said.contains(*it)), "{said}");
        }
        let settled = FormatName::value_variants().iter();
        assert_eq!(settled.filter(|it| it.require_settled().is_ok()).count(), 5);
    }
}
