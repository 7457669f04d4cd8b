//! `truestage explain CODE`: what a code means that a device, a drive or this program gave, what it mostly comes from,
//! and what to do next.

mod aborts;
mod emergencies;
mod exits;
mod states;

use clap::Args;
use serde_json::{Value, json};
use wire::canopen::emcy::EmergencyCode;
use wire::canopen::sdo::AbortCode;
use wire::cia402::{NamedStatus, PowerState, Statusword};

use crate::Failure;
use crate::program::output::{Ended, Output};

/// What `truestage explain` is told.
#[derive(Debug, Args)]
pub(crate) struct ExplainArgs {
    /// `0x06090030`: an SDO abort code; `0x8611`: the code of an emergency message, or a drive's own (object 0x603F);
    /// `0x0637`: a drive's statusword (object 0x6041); `4`: an exit code of this program.
    #[arg(value_name = "CODE", required = true)]
    codes: Vec<String>,
}

/// What mostly stands behind a code, and what to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Advice {
    cause: &'static str,
    next: &'static str,
}

/// One code explained.
#[derive(Clone, Debug, PartialEq)]
struct Explained {
    /// What kind of code it is.
    kind: &'static str,
    /// The code and what the standard calls it.
    meaning: String,
    advice: Advice,
}

/// Explains each code.
///
/// # Errors
/// When one of them is no code.
pub(crate) fn run(args: &ExplainArgs, output: Output) -> Ended {
    let each = args.codes.iter().map(|code| explained(code));
    let each = each.collect::<Result<Vec<_>, _>>()?.concat();
    let texts: Vec<String> = each.iter().map(text).collect();
    let values: Vec<Value> = each.iter().map(value).collect();
    output.result(&texts.join("\n\n"), &json!({ "codes": values }))
}

fn text(it: &Explained) -> String {
    let Advice { cause, next } = it.advice;
    format!(
        "{}: {}\n  cause  {cause}\n  next   {next}",
        it.kind, it.meaning
    )
}

fn value(it: &Explained) -> Value {
    json!({
        "kind": it.kind,
        "meaning": it.meaning,
        "cause": it.advice.cause,
        "next": it.advice.next,
    })
}

/// By its form: eight digits behind `0x` are an SDO abort code, four an emergency code or a statusword, a decimal number
/// an exit code.
fn explained(word: &str) -> Result<Vec<Explained>, Failure> {
    let unknown = || {
        let exits = exits::CODES.iter().map(u8::to_string);
        let exits: Vec<String> = exits.collect();
        Failure::Usage {
            what: format!("`{word}` is no code"),
            help: format!(
                "write an SDO abort code as 0x06090030, an emergency code or a drive's as 0x8611, a statusword as 0x0637, \
                 an exit code of this program as one of {}",
                exits.join(", ")
            ),
        }
    };
    let Some(digits) = word.strip_prefix("0x").or(word.strip_prefix("0X")) else {
        let exit = word.parse().ok().and_then(exit);
        let known = exit.or_else(|| named(word)).ok_or_else(unknown)?;
        return Ok(vec![known]);
    };
    let digits = digits.replace('_', "");
    let raw = u32::from_str_radix(&digits, 16).map_err(|_| unknown())?;
    match (digits.len(), u16::try_from(raw)) {
        (..=4, Ok(code)) => Ok(of_four_digits(code)),
        (5..=8, _) => Ok(vec![abort(AbortCode::from_raw(raw))]),
        _ => Err(unknown()),
    }
}

/// An emergency code where the standards name that very code; a statusword where they name no such class; else both, as
/// far as it is a state.
fn of_four_digits(code: u16) -> Vec<Explained> {
    let (code, word) = (EmergencyCode(code), Statusword::from_bits_retain(code));
    let state = match word.state() {
        // Many codes of devices look like these.
        PowerState::NotReadyToSwitchOn | PowerState::Unknown(_) => None,
        state => Some(status(word, state)),
    };
    if EmergencyCode::named().any(|named| named == code) {
        return vec![emergency(code)];
    }
    match state {
        Some(status) if !code.has_class() => vec![status],
        state => [emergency(code)].into_iter().chain(state).collect(),
    }
}

fn status(word: Statusword, state: PowerState) -> Explained {
    Explained {
        kind: "statusword",
        meaning: NamedStatus::new(word, None)
            .to_string()
            .replacen("statusword ", "", 1),
        advice: states::of(state),
    }
}

/// Hexadecimal digits without `0x`, as a drive's display shows them: known only where the standards name that very code,
/// as any number could be read so.
fn named(digits: &str) -> Option<Explained> {
    let raw = u32::from_str_radix(digits, 16).ok()?;
    match digits.len() {
        4 => EmergencyCode::named()
            .find(|it| u32::from(it.0) == raw)
            .map(emergency),
        8 => AbortCode::ALL
            .iter()
            .find(|it| **it == AbortCode::from_raw(raw))
            .map(|it| abort(*it)),
        _ => None,
    }
}

fn exit(code: u8) -> Option<Explained> {
    let (meaning, advice) = exits::of(code)?;
    Some(Explained {
        kind: "exit code",
        meaning: format!("{code} ({meaning})"),
        advice,
    })
}

fn emergency(code: EmergencyCode) -> Explained {
    Explained {
        kind: "emergency or drive fault code",
        meaning: code.to_string(),
        advice: emergencies::of(code),
    }
}

fn abort(code: AbortCode) -> Explained {
    Explained {
        kind: "SDO abort code",
        meaning: code.to_string(),
        advice: aborts::of(code),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_code_is_known_by_its_form() {
        let kind = |word: &str| {
            let first = explained(word)?.swap_remove(0);
            Ok::<_, Failure>((first.kind, first.meaning))
        };
        let (abort, emergency, exit) = (
            "SDO abort code",
            "emergency or drive fault code",
            "exit code",
        );
        for (word, expected, says) in [
            ("0x06090030", abort, "value out of range"),
            ("0x0609_0030", abort, "value out of range"),
            ("0X8611", emergency, "following error"),
            ("8611", emergency, "following error"),
            ("06090030", abort, "value out of range"),
            ("0x2311", emergency, "current"),
            ("0x0637", "statusword", "operation enabled; target reached"),
            ("0x0240", "statusword", "voltage off: mains, STO"),
            ("4", exit, "device or bus"),
            ("130", exit, "Ctrl-C"),
        ] {
            let (seen, meaning) = kind(word).unwrap_or_else(|failure| panic!("{failure}"));
            assert_eq!(seen, expected, "{word}");
            assert!(meaning.contains(says), "{meaning}");
        }
        for word in [
            "",
            "0x",
            "0x123456789",
            "-1",
            "77",
            "1234",
            "face",
            "+611",
            "four",
            "0xzz",
        ] {
            let told = kind(word).expect_err(word).to_string();
            assert!(told.contains("is no code"), "{told}");
        }
    }

    #[test]
    fn a_word_that_may_be_both_is_explained_as_both() {
        let kinds = |word: &str| {
            let each = explained(word).expect("a code");
            each.iter().map(|code| code.kind).collect::<Vec<_>>()
        };
        let emergency = "emergency or drive fault code";
        assert_eq!(kinds("0x1637"), ["statusword"]);
        assert_eq!(kinds("0x2637"), [emergency, "statusword"]);
        assert_eq!(kinds("0x8611"), [emergency]);
        assert_eq!(kinds("0x0250"), ["statusword"]);
    }

    #[test]
    fn every_state_has_advice_of_its_own() {
        for raw in [0x40, 0x21, 0x23, 0x27, 0x07, 0x0F, 0x08] {
            let state = Statusword::from_bits_retain(raw).state();
            check(states::of(state), &state.to_string());
        }
    }

    /// Words for an operator: a sentence each, and no code is sent to another one's advice by mistake.
    fn check(of: Advice, whose: &str) {
        for text in [of.cause, of.next] {
            assert!(text.len() > 20, "{whose}: `{text}`");
            assert!(!text.ends_with('.'), "{whose}: `{text}`");
        }
        assert_ne!(of.cause, of.next, "{whose}");
    }

    #[test]
    fn no_code_that_has_a_name_is_without_advice_of_its_own() {
        for code in AbortCode::ALL {
            let of = aborts::of(*code);
            check(of, &code.to_string());
            assert_ne!(of, aborts::UNNAMED, "{code}");
        }
        for code in EmergencyCode::named() {
            let of = emergencies::of(code);
            check(of, &code.to_string());
            assert_ne!(of, emergencies::UNNAMED, "{code}");
        }
        for code in exits::CODES {
            check(exits::of(*code).expect("it is listed").1, &code.to_string());
        }
    }

    /// What the help of the program lists.
    #[test]
    fn every_exit_code_of_the_help_is_explained() {
        let numbers = crate::program::EXIT_CODES.split(|c: char| !c.is_ascii_digit());
        let listed: Vec<u8> = numbers.filter_map(|it| it.parse().ok()).collect();
        assert!(listed.len() > 5, "{listed:?}");
        for code in listed {
            assert!(exits::CODES.contains(&code), "{code}");
        }
    }
}
