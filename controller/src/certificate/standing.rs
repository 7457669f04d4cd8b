//! Whether a certificate holds on a day.

use core::fmt;

use jiff::civil::Date;

use super::table::Certified;

/// How a certificate stands on a day.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Standing {
    /// It holds.
    Holds,
    /// It holds still, for so many days.
    Ends(i32),
    /// It has ended on that day.
    Ended(Date),
    /// It was made after today.
    NotYet(Date),
}

impl Certified {
    /// On the day `today`, for somebody who wants to be warned `remind_days` before it ends.
    pub(crate) fn standing(&self, today: Date, remind_days: u32) -> Standing {
        if self.calibrated > today {
            return Standing::NotYet(self.calibrated);
        }
        if self.valid_until < today {
            return Standing::Ended(self.valid_until);
        }
        let left = today
            .until(self.valid_until)
            .map_or(i32::MAX, |it| it.get_days());
        match u32::try_from(left) {
            Ok(days) if days < remind_days => Standing::Ends(left),
            _ => Standing::Holds,
        }
    }
}

impl Standing {
    /// Whether what it certifies must not be measured with.
    pub(crate) const fn is_refused(self) -> bool {
        matches!(self, Self::Ended(_) | Self::NotYet(_))
    }

    /// What to do about it.
    pub(crate) const fn help(self) -> &'static str {
        match self {
            Self::NotYet(_) => "is the clock of this computer right? Nothing is measured with it",
            Self::Ended(_) => {
                "have it calibrated and name the new certificate; nothing is measured with it until then. Is the clock \
                 of this computer right?"
            }
            Self::Holds | Self::Ends(_) => {
                "have it calibrated in time: nothing is measured with it afterwards"
            }
        }
    }
}

impl fmt::Display for Standing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Holds => f.write_str("it holds"),
            Self::Ends(0) => f.write_str("it ends today"),
            Self::Ends(1) => f.write_str("it ends tomorrow"),
            Self::Ends(days) => write!(f, "it ends in {days} days"),
            Self::Ended(day) => write!(f, "it has ended on {day}"),
            Self::NotYet(day) => write!(f, "its calibration ended on {day}, which is yet to come"),
        }
    }
}
