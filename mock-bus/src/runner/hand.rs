//! What an operator's hands do at the emulated machine, as commands in words.
//!
//! `mock-bus ctl` and the side channel of a lockstep clock speak them. A hand only does what
//! a person at a machine could do, or a fault that befalls it; looking at the truth is for
//! judges.

use core::fmt::Write as _;

use serde::Deserialize;
use units::{Celsius, Metres, Radians};

use crate::fault::{FaultConfig, FaultId};
use crate::plant::{LineOptics, LineSetUp, Truth};
use crate::simulation::Simulation;

/// All commands, for the refusal of an unknown one.
pub const WORDS: &str = "turn-plate LINES | fix-plate OFFSET | place-plate OFFSET | read-line NUMBER | set-up-line TOML | take-line-away | fault TOML | \
                         end-fault NUMBER | power off | power on | truth";

/// What a hand does.
///
/// # Example
///
/// ```
/// use mock_bus::fault::Fault;
/// use mock_bus::runner::hand::Deed;
///
/// assert_eq!(Deed::parse("turn-plate 73"), Ok(Deed::TurnPlate(73.0)));
/// let deed = Deed::parse("fault from_s = 2.0, fault = { kind = \"beam_blocked\" }")?;
/// assert!(matches!(deed, Deed::Fault(it) if it.from_s == 2.0 && it.fault == Fault::BeamBlocked));
/// assert!(Deed::parse("power up").is_err(), "on or off");
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub enum Deed {
    /// Turns the table's plate by so many lines and fixes it again.
    TurnPlate(f64),
    /// Calls the place where the plate lies now so many lines; it stays where it is.
    FixPlate(f64),
    /// Turns the plate to the place that is called so many lines.
    PlacePlate(f64),
    /// Reads a line of the plate through the microscope; nothing is turned.
    ReadLine(u32),
    /// Sets a laser up along a line.
    SetUpLine(LineSetUp),
    /// Packs it up.
    TakeLineAway,
    /// A fault befalls the machine; its times count from now.
    Fault(Box<FaultConfig>),
    /// A fault is mended.
    EndFault(FaultId),
    /// The mains goes off or comes back.
    Power(bool),
    /// Nothing is done; the truth is looked at.
    Truth,
}

/// A line of the interferometer, as `set-up-line` takes it:
/// `along = [1, 0, 0], optics = "straightness", side = [0, 1, 0], tool_mm = [0, 0, -100]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct LineWords {
    along: [f64; 3],
    optics: OpticsWord,
    #[serde(default)]
    side: Option<[f64; 3]>,
    #[serde(default)]
    tool_mm: [f64; 3],
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
enum OpticsWord {
    Linear,
    Straightness,
    Angular,
}

impl LineWords {
    fn set_up(&self) -> Result<LineSetUp, String> {
        let side = || {
            self.side
                .ok_or("`side` is missing: the direction across the line that is measured")
        };
        let all = self.along.iter().chain(&self.tool_mm);
        if !all
            .chain(self.side.iter().flatten())
            .all(|it| it.is_finite())
        {
            return Err("a number is not finite".to_owned());
        }
        if self.along == [0.0; 3] {
            return Err("`along` has no direction".to_owned());
        }
        Ok(LineSetUp {
            optics: match self.optics {
                OpticsWord::Linear => LineOptics::Linear,
                OpticsWord::Straightness => LineOptics::Straightness { across: side()? },
                OpticsWord::Angular => LineOptics::Angular { about: side()? },
            },
            along: self.along,
            tool_offset: self.tool_mm.map(Metres::from_mm),
        })
    }
}

impl Deed {
    /// Reads the words.
    ///
    /// # Errors
    /// What is wrong with them.
    pub fn parse(words: &str) -> Result<Self, String> {
        let words = words.trim();
        let (verb, rest) = words.split_once(' ').unwrap_or((words, ""));
        let rest = rest.trim();
        match (verb, rest) {
            ("turn-plate", lines) => finite(lines).map(Self::TurnPlate),
            ("fix-plate", offset) => finite(offset).map(Self::FixPlate),
            ("place-plate", offset) => finite(offset).map(Self::PlacePlate),
            ("read-line", number) => match number.parse() {
                Ok(number) => Ok(Self::ReadLine(number)),
                Err(_) => Err(format!("`{number}` is not the number of a line")),
            },
            ("set-up-line", text) => inline::<LineWords>(text)?.set_up().map(Self::SetUpLine),
            ("take-line-away", "") => Ok(Self::TakeLineAway),
            ("fault", text) => fault(text).map(|it| Self::Fault(Box::new(it))),
            ("end-fault", number) => match number.parse() {
                Ok(number) => Ok(Self::EndFault(FaultId(number))),
                Err(_) => Err(format!("`{number}` is not the number of a fault")),
            },
            ("power", "off") => Ok(Self::Power(false)),
            ("power", "on") => Ok(Self::Power(true)),
            ("truth", "") => Ok(Self::Truth),
            _ => Err(format!(
                "`{words}` is not a known command; the commands are: {WORDS}"
            )),
        }
    }
}

/// The hands of one machine, and what they remember.
///
/// # Example
///
/// ```
/// use mock_bus::config::MachineConfig;
/// use mock_bus::runner::hand::Hands;
/// use mock_bus::simulation::Simulation;
///
/// let config = MachineConfig::parse("name = \"bench\"\nports = []\nnodes = []\n")?;
/// let (mut hands, mut machine) = (Hands::default(), Simulation::new(&config, 1)?);
/// let fault = hands.do_words("fault fault = { kind = \"beam_blocked\" }", &mut machine);
/// assert_eq!(fault, Ok("fault 0".into()));
/// assert!(hands.do_words("turn-plate 1", &mut machine).is_err(), "it has no plate");
/// # Ok::<(), mock_bus::config::ConfigError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Hands {
    /// What the place is called where the plate lies, in lines.
    plate_at: f64,
}

impl Hands {
    /// Does what the words say, and says what came of it.
    ///
    /// # Errors
    /// When they mean nothing, or this machine has no such thing.
    pub fn do_words(&mut self, words: &str, machine: &mut Simulation) -> Result<String, String> {
        match Deed::parse(words)? {
            Deed::TurnPlate(lines) => self.turn_plate(machine, self.plate_at + lines),
            Deed::PlacePlate(offset) => self.turn_plate(machine, offset),
            Deed::FixPlate(offset) => {
                has_plate(machine)?;
                self.plate_at = offset;
                Ok(format!(
                    "the plate is fixed; its offset now counts as {offset}"
                ))
            }
            Deed::ReadLine(line) => read_line(machine, line),
            Deed::SetUpLine(line) => {
                if machine.truth().volumetric().is_none() {
                    return Err("only a machine of three axes has lines to set up".to_owned());
                }
                machine.set_up_line(&line);
                Ok("the line is set up from where the tool stands".to_owned())
            }
            Deed::TakeLineAway => {
                machine.take_line_away();
                Ok("laser and optics are packed up".to_owned())
            }
            Deed::Fault(fault) => match machine.inject(*fault) {
                Ok(id) => Ok(format!("fault {}", id.0)),
                Err(error) => Err(error.to_string()),
            },
            Deed::EndFault(fault) => {
                machine.end_fault(fault);
                let times = machine.fault_deliveries(fault);
                Ok(format!(
                    "fault {} has ended; it took effect {times} times",
                    fault.0
                ))
            }
            Deed::Power(on) => {
                machine.switch_mains(on);
                Ok(format!(
                    "the mains power is {}",
                    if on { "on" } else { "off" }
                ))
            }
            Deed::Truth => Ok(truth(machine.now().seconds(), &machine.truth())),
        }
    }

    fn turn_plate(&mut self, machine: &mut Simulation, to: f64) -> Result<String, String> {
        has_plate(machine)?;
        let lines = to - self.plate_at;
        machine.turn_plate(lines);
        self.plate_at = to;
        Ok(format!(
            "the plate was turned by {lines} lines; its offset is now {to}"
        ))
    }
}

/// What is read, as one JSON object; `null` for what cannot be seen.
fn read_line(machine: &mut Simulation, line: u32) -> Result<String, String> {
    has_plate(machine)?;
    let lines = machine.truth().table().map_or(0, |it| it.lines());
    if line as usize >= lines {
        return Err(format!("the plate has {lines} lines, 0 to {}", lines - 1));
    }
    let seen = machine.sight_line(line);
    let number = |it: Option<f64>| it.map_or("null".to_owned(), |it| it.to_string());
    Ok(format!(
        "{{\"to_line_arcsec\":{},\"angle_deg\":{}}}",
        number(seen.to_line.map(Radians::arcsec)),
        number(seen.angle.map(Radians::degrees)),
    ))
}

fn has_plate(machine: &Simulation) -> Result<(), String> {
    match machine.truth().table() {
        Some(_) => Ok(()),
        None => Err("this machine has no plate to turn".to_owned()),
    }
}

fn finite(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(number) if f64::is_finite(number) => Ok(number),
        _ => Err(format!("`{text}` is not a number")),
    }
}

/// What stands in a TOML file between the braces of an inline table.
fn inline<T: serde::de::DeserializeOwned>(text: &str) -> Result<T, String> {
    #[derive(Deserialize)]
    struct Only<T> {
        only: T,
    }
    toml::from_str::<Only<T>>(&format!("only = {{ {text} }}"))
        .map(|it| it.only)
        .map_err(|error| error.message().to_owned())
}

/// A fault in the words of `--fault`: `from_s = 2.0, fault = { kind = "beam_blocked" }`.
///
/// # Errors
/// What is wrong with them.
pub fn fault(text: &str) -> Result<FaultConfig, String> {
    inline(text)
}

/// One JSON object: where everything is, behind all sensors.
fn truth(time_s: f64, truth: &Truth<'_>) -> String {
    let mut text = format!("{{\"time_s\":{time_s}");
    let mut add = |key: &str, value: f64| {
        // Writing to a text does not fail.
        let _ = write!(text, ",\"{key}\":{value}");
    };
    let warm = |it: Celsius| it.value();
    let air = truth.environment();
    add("air_temperature_c", warm(air.air_temperature));
    add("stage_temperature_c", warm(air.stage_temperature));
    if let Some(platform) = truth.platform() {
        let pose = platform.pose();
        add("x_mm", pose.x.mm());
        add("y_mm", pose.y.mm());
        add("angle_arcsec", pose.angle.arcsec());
    } else if let Some(gantry) = truth.gantry() {
        for (key, at) in ["first_mm", "second_mm"]
            .iter()
            .zip(gantry.scale_positions())
        {
            add(key, at.mm());
        }
        add("angle_urad", gantry.angle().value() * 1e6);
    } else if let Some(table) = truth.table() {
        add("angle_deg", table.angle().degrees());
        add("plate_turned_lines", table.placement().0 as f64);
    } else if let Some(volumetric) = truth.volumetric() {
        for (key, at) in ["x_mm", "y_mm", "z_mm"].iter().zip(volumetric.tool_point()) {
            add(key, at.mm());
        }
    } else {
        add("position_mm", truth.position().mm());
    }
    text + "}"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::MachineConfig;
    use crate::fault::Fault;

    #[test]
    fn words_become_deeds() {
        assert_eq!(Deed::parse("turn-plate 73"), Ok(Deed::TurnPlate(73.0)));
        assert_eq!(Deed::parse(" power  off "), Ok(Deed::Power(false)));
        assert_eq!(Deed::parse("truth"), Ok(Deed::Truth));
        let blocked = Deed::parse("fault from_s = 2.0, fault = { kind = \"beam_blocked\" }");
        let Ok(Deed::Fault(fault)) = blocked else {
            panic!("{blocked:?}")
        };
        assert_eq!((fault.from_s, fault.fault), (2.0, Fault::BeamBlocked));
        let line = Deed::parse(
            "set-up-line along = [1, 0, 0], optics = \"straightness\", side = [0, 1, 0]",
        );
        let Ok(Deed::SetUpLine(line)) = line else {
            panic!("{line:?}")
        };
        let across = [0.0, 1.0, 0.0];
        assert_eq!(line.optics, LineOptics::Straightness { across });
    }

    #[test]
    fn words_that_mean_nothing_are_refused_with_what_there_is() {
        for (words, says) in [
            ("", "turn-plate LINES"),
            ("turn-plate", "not a number"),
            ("turn-plate inf", "not a number"),
            ("power up", "power off"),
            ("fault fault = { kind = \"gremlin\" }", "gremlin"),
            ("end-fault x", "not the number"),
            ("read-line one", "not the number of a line"),
            (
                "set-up-line along = [0, 0, 0], optics = \"linear\"",
                "direction",
            ),
            (
                "set-up-line along = [1, 0, 0], optics = \"angular\"",
                "side",
            ),
        ] {
            let error = Deed::parse(words).unwrap_err();
            assert!(error.contains(says), "{words}: {error}");
        }
    }

    fn machine(text: &str) -> Simulation {
        Simulation::new(&MachineConfig::parse(text).unwrap(), 1).unwrap()
    }

    #[test]
    fn what_a_machine_does_not_have_is_not_done_in_silence() {
        let mut machine = machine(include_str!("../../../configs/emulated/linear.toml"));
        let mut hands = Hands::default();
        let mut words = |words: &str| hands.do_words(words, &mut machine);
        assert!(words("turn-plate 1").unwrap_err().contains("no plate"));
        let truth = words("truth").unwrap();
        assert!(truth.contains("\"position_mm\":"), "{truth}");
        let blocked = words("fault fault = { kind = \"beam_blocked\" }");
        assert_eq!(blocked.unwrap(), "fault 0");
    }

    #[test]
    fn a_line_is_read_where_it_is_and_smudged_ones_are_not() {
        let clean = include_str!("../../../configs/emulated/rotary.toml");
        let smudged = clean.replace("smudged_lines = []", "smudged_lines = [7]");
        assert_ne!(clean, smudged);
        let mut machine = machine(&smudged);
        let mut hands = Hands::default();
        let mut words = |words: &str| hands.do_words(words, &mut machine);
        assert!(words("read-line 360").unwrap_err().contains("0 to 359"));
        let smudged = words("read-line 7").unwrap();
        assert_eq!(smudged, "{\"to_line_arcsec\":null,\"angle_deg\":null}");
        let seen = words("read-line 100").unwrap();
        assert!(
            seen.contains("\"angle_deg\":") && !seen.ends_with("null}"),
            "{seen}"
        );
    }

    #[test]
    fn a_plate_is_turned_by_lines_or_to_a_place_that_was_named() {
        let mut machine = machine(include_str!("../../../configs/emulated/rotary.toml"));
        let mut hands = Hands::default();
        let mut lies = |words: &str| {
            hands.do_words(words, &mut machine).unwrap();
            machine.truth().table().unwrap().placement().0
        };
        let begin = lies("turn-plate 5");
        assert_eq!(lies("turn-plate 73"), begin + 73);
        assert_eq!(lies("fix-plate 0"), begin + 73);
        assert_eq!(lies("place-plate 10"), begin + 83);
        assert_eq!(lies("place-plate 0"), begin + 73);
    }
}
