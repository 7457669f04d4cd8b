//! Native Mode: the ASCII protocol of Cognex In-Sight vision systems, over a serial line.
//!
//! Sources, all of Cognex's In-Sight Explorer Help, Communications Reference:
//! - Native Mode Communications (release 6.1.1): basic commands are two characters, parameters
//!   and a terminator, CR by default on a serial port, upper or lower case; commands that set
//!   answer 1 for success, 0 for an unrecognised command, a negative number for a failure.
//! - Set Online (5.8.1): `SO` and its status codes. Set Integer, Spreadsheet View (6.5.0): a
//!   cell is a letter and a row of three digits. Evaluate (6.1.1): -4 is out of memory, -6 no
//!   full access. Write Job (5.8.1): -3 is a wrong checksum.
//! - Set Event and Wait, Get Value, Get File, Get Info: as the command summaries of the public
//!   package CognexNativePy (FLo-ABB) give these pages: `SW8` acquires an image, runs the
//!   job and answers when that is done, -2 when offline; `GV`, `GF` and `GI` answer a status
//!   and then, only after 1, their text on lines of its own.
//!
//! Not verified on a device: what `GV` answers for a cell that shows `#ERR` (taken for a text),
//! and the names of the lines of `GI` beyond their form `name: value`.
//!
//! Native Mode has no message that carries a whole measurement, and no number that says which
//! answer belongs to which trigger. A job can have both in one cell of text: [`Inspection`] is
//! this program's own convention for that cell.

use core::fmt;

/// Ends every line, unless the system's serial port is set otherwise.
pub const TERMINATOR: u8 = b'\r';
/// The event code that acquires an image and updates the spreadsheet.
pub const ACQUIRE: u8 = 8;
/// The spreadsheet function `Count` begins again from 0 after this, by default.
pub const COUNT_MAX: u32 = 9_999_999;
/// What a cell shows whose function failed.
pub const CELL_ERROR: &str = "#ERR";

/// A cell of the spreadsheet.
///
/// # Example
///
/// ```
/// use wire::in_sight::Cell;
///
/// let cell = Cell::parse("a2").expect("a letter and up to three digits");
/// assert_eq!(cell.to_string(), "A002");
/// assert_eq!(Cell::new('B', 400), None, "rows are 0 to 399");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Cell {
    column: u8,
    row: u16,
}

impl Cell {
    const ROWS: u16 = 400;

    /// From a column letter and a row, 0 to 399.
    pub fn new(column: char, row: u16) -> Option<Self> {
        let column = u8::try_from(column.to_ascii_uppercase()).ok()?;
        (column.is_ascii_uppercase() && row < Self::ROWS).then_some(Self { column, row })
    }

    /// From what a person or a command writes: a letter and one to three digits.
    pub fn parse(text: &str) -> Option<Self> {
        let column = text.chars().next()?;
        let row = text.get(1..)?;
        let digits = (1..=3).contains(&row.len()) && row.bytes().all(|b| b.is_ascii_digit());
        Self::new(column, digits.then(|| row.parse().ok())??)
    }
}

impl fmt::Display for Cell {
    /// As commands have it: three digits.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{:03}", char::from(self.column), self.row)
    }
}

/// What the host says.
///
/// # Example
///
/// ```
/// use wire::in_sight::{ACQUIRE, Command, Status};
///
/// assert_eq!(Command::SetEventAndWait(ACQUIRE).emit(), "SW8");
/// assert_eq!(Command::parse("so1"), Ok(Command::SetOnline(true)));
/// assert_eq!(Command::parse("SO2"), Err(Status::Invalid));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// `SW`: an event; the answer comes when everything that it causes is done.
    SetEventAndWait(u8),
    /// `SO`: go online (`true`) or offline.
    SetOnline(bool),
    /// `GO`: online or not? The answer has no status, only the state.
    GetOnline,
    /// `GF`: the name of the active job.
    GetFile,
    /// `GI`: serial number and versions.
    GetInfo,
    /// `GV`: what a cell shows.
    GetValue(Cell),
}

impl Command {
    /// The line without its terminator.
    pub fn emit(&self) -> String {
        match self {
            Self::SetEventAndWait(event) => format!("SW{event}"),
            Self::SetOnline(online) => format!("SO{}", u8::from(*online)),
            Self::GetOnline => "GO".to_owned(),
            Self::GetFile => "GF".to_owned(),
            Self::GetInfo => "GI".to_owned(),
            Self::GetValue(cell) => format!("GV{cell}"),
        }
    }

    /// From a line without its terminator.
    ///
    /// # Errors
    /// The status that the system answers instead: unrecognised, or an invalid parameter.
    pub fn parse(line: &str) -> Result<Self, Status> {
        let (name, parameter) = line.split_at_checked(2).ok_or(Status::Unrecognised)?;
        match (name.to_ascii_uppercase().as_str(), parameter) {
            ("SW", event) => match event.parse() {
                Ok(event @ 0..=ACQUIRE) => Ok(Self::SetEventAndWait(event)),
                Ok(_) | Err(_) => Err(Status::Invalid),
            },
            ("SO", "0") => Ok(Self::SetOnline(false)),
            ("SO", "1") => Ok(Self::SetOnline(true)),
            ("SO", _) => Err(Status::Invalid),
            ("GO", "") => Ok(Self::GetOnline),
            ("GF", "") => Ok(Self::GetFile),
            ("GI", "") => Ok(Self::GetInfo),
            ("GV", cell) => Cell::parse(cell).map(Self::GetValue).ok_or(Status::Invalid),
            _ => Err(Status::Unrecognised),
        }
    }
}

/// How a command went.
///
/// # Example
///
/// ```
/// use wire::in_sight::Status;
///
/// assert_eq!(Status::parse("-2"), Some(Status::NotExecuted));
/// assert_eq!(Status::of(-2).to_string(), "status -2 (not executed; offline?)");
/// assert_eq!(Status::parse("1.0"), None);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Status {
    /// 1: executed.
    Done,
    /// 0: unrecognised command.
    Unrecognised,
    /// -1: a parameter is out of range, or a cell is invalid.
    Invalid,
    /// -2: could not be executed; the system may be offline.
    NotExecuted,
    /// -3: a checksum is wrong.
    WrongChecksum,
    /// -4: out of memory.
    OutOfMemory,
    /// -5: did not go online, because it was set offline by hand or by an input.
    HeldOffline,
    /// -6: the user has no full access.
    NoAccess,
    /// A code that the reference does not list.
    Unknown(i32),
}

impl Status {
    /// From the number.
    pub const fn of(code: i32) -> Self {
        match code {
            1 => Self::Done,
            0 => Self::Unrecognised,
            -1 => Self::Invalid,
            -2 => Self::NotExecuted,
            -3 => Self::WrongChecksum,
            -4 => Self::OutOfMemory,
            -5 => Self::HeldOffline,
            -6 => Self::NoAccess,
            other => Self::Unknown(other),
        }
    }

    /// The number.
    pub const fn code(self) -> i32 {
        match self {
            Self::Done => 1,
            Self::Unrecognised => 0,
            Self::Invalid => -1,
            Self::NotExecuted => -2,
            Self::WrongChecksum => -3,
            Self::OutOfMemory => -4,
            Self::HeldOffline => -5,
            Self::NoAccess => -6,
            Self::Unknown(code) => code,
        }
    }

    /// The line without its terminator.
    pub fn emit(self) -> String {
        self.code().to_string()
    }

    /// From a line without its terminator; `None` where it is no whole number.
    pub fn parse(line: &str) -> Option<Self> {
        let digits = line.strip_prefix('-').unwrap_or(line);
        let whole = !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit());
        whole.then(|| line.parse().ok().map(Self::of))?
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let meaning = match self {
            Self::Done => "done",
            Self::Unrecognised => "unrecognised command",
            Self::Invalid => "invalid parameter or cell",
            Self::NotExecuted => "not executed; offline?",
            Self::WrongChecksum => "wrong checksum",
            Self::OutOfMemory => "out of memory",
            Self::HeldOffline => "set offline by hand or by an input",
            Self::NoAccess => "no full access",
            Self::Unknown(_) => "a code that the In-Sight reference does not list",
        };
        write!(f, "status {} ({meaning})", self.code())
    }
}

/// One picture as the job judges it: one cell of text with seven fields, separated by commas,
/// `count,found,judgement,x,y,angle,score`. Numbers are decimal, with a point.
///
/// # Example
///
/// ```
/// use wire::in_sight::{Inspection, InspectionError};
///
/// let line = "17,2,1,1234.567,-0.250,12.500,96.800";
/// let inspection = Inspection::parse(line)?;
/// assert_eq!((inspection.count, inspection.x, inspection.y), (17, 1234.567, -0.25));
/// assert_eq!(inspection.emit(), line);
/// let failed = Inspection::parse("17,2,1,#ERR,0,0,90");
/// assert_eq!(failed, Err(InspectionError::Field { field: "x" }));
/// # Ok::<(), InspectionError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inspection {
    /// How many pictures the job has taken: the function `Count` over the image.
    pub count: u32,
    /// How many of the taught marks were found.
    pub found: u32,
    /// The job's own judgement, 1 for good.
    pub judged_ok: bool,
    /// In the job's unit of length; 0 where nothing was found.
    pub x: f64,
    /// Likewise.
    pub y: f64,
    /// In the job's unit of angle; 0 where nothing was found.
    pub angle: f64,
    /// The similarity of the worst mark to the taught one, 0 to 100.
    pub score: f64,
}

/// Why a line is not an inspection result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InspectionError {
    /// Not seven fields.
    #[error(
        "inspection result has {seen} fields, expected 7: count,found,judgement,x,y,angle,score"
    )]
    Fields {
        /// How many there are.
        seen: usize,
    },
    /// A field is not a number of its kind.
    #[error("inspection result: {field} is not a number in its range")]
    Field {
        /// Which.
        field: &'static str,
    },
}

impl Inspection {
    /// The line without its terminator, with the three decimals that cells show.
    pub fn emit(&self) -> String {
        let Self {
            count,
            found,
            x,
            y,
            angle,
            score,
            ..
        } = self;
        let judged = u8::from(self.judged_ok);
        format!("{count},{found},{judged},{x:.3},{y:.3},{angle:.3},{score:.3}")
    }

    /// From a line without its terminator.
    ///
    /// # Errors
    /// When it has another form; nothing is guessed.
    pub fn parse(line: &str) -> Result<Self, InspectionError> {
        let fields: Vec<&str> = line.split(',').map(str::trim).collect();
        let seen = fields.len();
        let Ok([count, found, judged, x, y, angle, score]) = <[&str; 7]>::try_from(fields) else {
            return Err(InspectionError::Fields { seen });
        };
        let judged_ok = match whole("judgement", judged)? {
            0 => false,
            1 => true,
            _ => return Err(InspectionError::Field { field: "judgement" }),
        };
        Ok(Self {
            count: whole("count", count)?,
            found: whole("found marks", found)?,
            judged_ok,
            x: decimal("x", x)?,
            y: decimal("y", y)?,
            angle: decimal("angle", angle)?,
            score: decimal("score", score)?,
        })
    }
}

/// A number that counts, with or without decimals that are 0.
fn whole(field: &'static str, text: &str) -> Result<u32, InspectionError> {
    let (digits, decimals) = text.split_once('.').unwrap_or((text, ""));
    let all = |text: &str, good: fn(&u8) -> bool| text.as_bytes().iter().all(good);
    if !digits.is_empty() && all(digits, u8::is_ascii_digit) && all(decimals, |b| *b == b'0') {
        digits.parse().ok()
    } else {
        None
    }
    .ok_or(InspectionError::Field { field })
}

/// Neither exponents nor the names of what is no number.
fn decimal(field: &'static str, text: &str) -> Result<f64, InspectionError> {
    let unsigned = text.strip_prefix(['-', '+']).unwrap_or(text);
    let good = unsigned.starts_with(|c: char| c.is_ascii_digit())
        && unsigned.bytes().all(|b| b.is_ascii_digit() || b == b'.');
    let number: Option<f64> = good.then(|| text.parse().ok()).flatten();
    number
        .filter(|number| number.is_finite())
        .ok_or(InspectionError::Field { field })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The examples of the reference: going online and offline, a cell of column A, row 2.
    #[test]
    fn commands_are_those_of_the_reference() {
        let a2 = Cell::parse("A2").unwrap();
        for (line, command) in [
            ("SO1", Command::SetOnline(true)),
            ("SO0", Command::SetOnline(false)),
            ("SW8", Command::SetEventAndWait(ACQUIRE)),
            ("GVA002", Command::GetValue(a2)),
            ("GO", Command::GetOnline),
            ("GF", Command::GetFile),
            ("GI", Command::GetInfo),
        ] {
            assert_eq!(command.emit(), line);
            assert_eq!(Command::parse(line), Ok(command));
            assert_eq!(Command::parse(&line.to_lowercase()), Ok(command));
        }
    }

    #[test]
    fn what_is_no_command_gets_the_status_that_says_so() {
        for (line, status) in [
            ("", Status::Unrecognised),
            ("S", Status::Unrecognised),
            ("XX1", Status::Unrecognised),
            ("GO1", Status::Unrecognised),
            ("SO2", Status::Invalid),
            ("SW9", Status::Invalid),
            ("SW", Status::Invalid),
            ("GVA400", Status::Invalid),
            ("GV1A", Status::Invalid),
            ("µµ", Status::Unrecognised),
        ] {
            assert_eq!(Command::parse(line), Err(status), "{line}");
        }
    }

    #[test]
    fn every_status_of_the_reference_is_named_and_others_are_kept() {
        for (line, status) in [
            ("1", Status::Done),
            ("0", Status::Unrecognised),
            ("-1", Status::Invalid),
            ("-2", Status::NotExecuted),
            ("-3", Status::WrongChecksum),
            ("-4", Status::OutOfMemory),
            ("-5", Status::HeldOffline),
            ("-6", Status::NoAccess),
            ("-7", Status::Unknown(-7)),
            ("42", Status::Unknown(42)),
        ] {
            assert_eq!(Status::parse(line), Some(status));
            assert_eq!(status.emit(), line);
        }
        for line in ["", "-", "+1", "1.0", " 1", "99999999999", "one"] {
            assert_eq!(Status::parse(line), None, "{line}");
        }
    }

    const GOOD: Inspection = Inspection {
        count: 17,
        found: 2,
        judged_ok: true,
        x: 1234.567,
        y: -0.25,
        angle: 12.5,
        score: 96.8,
    };

    #[test]
    fn an_inspection_reads_as_written() {
        let line = "17,2,1,1234.567,-0.250,12.500,96.800";
        assert_eq!(GOOD.emit(), line);
        assert_eq!(Inspection::parse(line), Ok(GOOD));
        let spaced = "17.000, 2.000, 1.000, +1234.567, -.25, 12.5, 96.8";
        let y = InspectionError::Field { field: "y" };
        assert_eq!(Inspection::parse(spaced), Err(y));
        let spaced = spaced.replace("-.25", "-0.25");
        assert_eq!(Inspection::parse(&spaced), Ok(GOOD));
    }

    #[test]
    fn what_is_no_number_is_no_inspection() {
        for (bad, field) in [
            ("NaN", "x"),
            ("inf", "x"),
            ("1e3", "x"),
            ("1e308", "x"),
            ("0x10", "x"),
            ("1.2.3", "x"),
            ("", "x"),
            ("-", "x"),
            (CELL_ERROR, "x"),
        ] {
            let line = format!("17,2,1,{bad},0,0,90");
            let expected = Err(InspectionError::Field { field });
            assert_eq!(Inspection::parse(&line), expected, "{line}");
        }
        for line in ["17.5,2,1,0,0,0,90", "-1,2,1,0,0,0,90", "17,2,2,0,0,0,90"] {
            let seen = Inspection::parse(line);
            assert!(matches!(seen, Err(InspectionError::Field { .. })), "{line}");
        }
        for (line, seen) in [
            ("", 1),
            (CELL_ERROR, 1),
            ("1,2,3", 3),
            ("1,2,3,4,5,6,7,8", 8),
        ] {
            assert_eq!(
                Inspection::parse(line),
                Err(InspectionError::Fields { seen })
            );
        }
        // A comma for a point makes a field too many, never another number.
        assert!(Inspection::parse("17,2,1,1234,567,0,0,90").is_err());
    }

    proptest! {
        #[test]
        fn inspections_survive_to_a_thousandth(
            count in 0..=COUNT_MAX, found in 0..9_u32, judged_ok: bool,
            x in -1e6..1e6, y in -1e6..1e6, angle in -1e4..1e4, score in 0.0..100.0,
        ) {
            let sent = Inspection { count, found, judged_ok, x, y, angle, score };
            let read = Inspection::parse(&sent.emit()).unwrap();
            prop_assert_eq!((read.count, read.found, read.judged_ok), (count, found, judged_ok));
            for (read, sent) in [(read.x, x), (read.y, y), (read.angle, angle), (read.score, score)] {
                prop_assert!((read - sent).abs() <= 0.000_500_1);
            }
        }

        #[test]
        fn no_text_makes_the_codec_panic(text in ".{0,60}") {
            let _ = Command::parse(&text);
            let _ = Status::parse(&text);
            let _ = Inspection::parse(&text);
            let _ = Cell::parse(&text);
        }
    }
}
