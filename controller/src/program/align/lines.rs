//! What detectors see, as a line for people or an object for programs.

use compensator::volumetric::online::Trouble;
use drivers::device::{Signal, SignalTrouble};
use serde_json::{Value, json};
use units::{Metres, Radians, Volts};

use super::View;
use crate::volumetric::sight::{Sight, SightReading};

/// What is wrong with a detector, in two words and in one for programs.
pub(super) const fn words(trouble: &Trouble) -> (&'static str, &'static str) {
    match trouble {
        Trouble::Blocked { .. } => ("BLOCKED", "blocked"),
        Trouble::Saturated { .. } | Trouble::AtEnd { .. } => ("TOO BRIGHT", "too_bright"),
        Trouble::Beside { .. } | Trouble::BesideField { .. } => ("BESIDE", "beside"),
        Trouble::Unseen => ("NO SPOT", "no_spot"),
        Trouble::Several { .. } => ("REFLECTED", "several_spots"),
        Trouble::Stale { .. } => ("NO SAMPLES", "stale"),
        Trouble::Roll(_) => ("NO ROLL", "no_roll"),
        Trouble::Stuck { .. } => ("STUCK", "stuck"),
        Trouble::Jumped { .. } => ("JUMPED", "jumped"),
        Trouble::Implausible { .. } => ("NO NUMBER", "implausible"),
    }
}

/// How an instrument's signal is, in two words and in one for programs.
pub(super) const fn signal_words(signal: &Signal) -> (&'static str, &'static str) {
    match signal.trouble {
        None => ("good", "good"),
        Some(SignalTrouble::NoReference) => ("NO LASER", "no_reference"),
        Some(SignalTrouble::NoBeam) => ("NO BEAM", "no_beam"),
        Some(SignalTrouble::Beat) => ("TOO FAST", "beat"),
        Some(SignalTrouble::NoPhase) => ("TOO DIM", "no_phase"),
        Some(SignalTrouble::Weak) => ("WEAK", "weak"),
    }
}

fn signal_line(name: &str, signal: &Signal) -> String {
    let strength = signal.strength.map_or("-".to_owned(), |it| it.to_string());
    format!("{name} signal {strength}, {}", signal_words(signal).0)
}

/// A value of a reading in micrometres, of a roll in arcseconds.
pub(super) const fn in_unit(reading: &SightReading, si: f64) -> f64 {
    match reading.along {
        Some(_) => Metres(si).um(),
        None => Radians(si).arcsec(),
    }
}

/// `x slide y +12.31 z -3.02 um, 8.02 V, good`.
fn sight_line(it: &Sight) -> String {
    let mut text = it.name.clone();
    for reading in &it.readings {
        if let Some(along) = reading.along {
            text += &format!(" {along}");
        }
        match reading.value {
            Some(value) => text += &format!(" {:+.2}", in_unit(reading, value - reading.middle)),
            None => text += " -",
        }
        if let Some(off) = reading.off_reference() {
            text += &format!(" (ref {:+.2})", in_unit(reading, off));
        }
    }
    text += if it.is_roll() { " arcsec" } else { " um" };
    if let Some(light) = it.light {
        text += &format!(", {:.2} V", light.value());
    }
    let state = it.trouble.as_ref();
    text + ", " + state.map_or("good", |trouble| words(trouble).0)
}

/// All of it in one line: from the middle of each detector, and from its nearest reference.
pub(super) fn line(view: &View) -> String {
    let sights = view.sights.iter().map(sight_line);
    let signals = view.signals.iter().map(|(name, signal)| match signal {
        Some(signal) => signal_line(name, signal),
        None => format!("{name} says nothing of its signal"),
    });
    let all: Vec<String> = sights.chain(signals).collect();
    format!("{:.1} s: {}", view.seconds, all.join("; "))
}

fn reading_value(it: &SightReading) -> Value {
    let unit = |si: f64| in_unit(it, si);
    json!({
        "along": it.along.map(|along| along.to_string()),
        "unit": if it.along.is_some() { "um" } else { "arcsec" },
        "place": it.value.map(unit),
        "from_middle": it.value.map(|value| unit(value - it.middle)),
        "reference": it.reference.map(|(low, high)| [unit(low), unit(high)]),
        "from_reference": it.off_reference().map(unit),
        "field": [unit(it.field.0), unit(it.field.1)],
    })
}

fn sight_value(it: &Sight) -> Value {
    let trouble = it.trouble.as_ref();
    json!({
        "detector": it.name,
        "state": trouble.map_or("good", |trouble| words(trouble).1),
        "trouble": trouble.map(ToString::to_string),
        "sum_v": it.light.map(Volts::value),
        "readings": it.readings.iter().map(reading_value).collect::<Vec<_>>(),
    })
}

/// All of it for programs.
pub(super) fn value(view: &View) -> Value {
    let signals = view.signals.iter().map(|(name, signal)| {
        let age = signal.map(|it| view.now.since(it.at).as_secs_f64());
        json!({
            "instrument": name,
            "state": signal.as_ref().map(|it| signal_words(it).1),
            "strength": signal.and_then(|it| it.strength),
            "least": signal.and_then(|it| it.least),
            "age_s": age,
        })
    });
    json!({
        "at_s": view.seconds,
        "detectors": view.sights.iter().map(sight_value).collect::<Vec<_>>(),
        "signals": signals.collect::<Vec<_>>(),
    })
}
