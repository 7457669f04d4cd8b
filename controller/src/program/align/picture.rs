//! What detectors see, as a picture of a terminal's 80 columns and 24 lines.
//!
//! A line for each reading: how far it is from the middle of its detector, a bar as wide as all that the detector can
//! show, and how far it is from its reference. In a bar `o` is the beam, `|` the middle, `:` the references along the
//! travel; `<` and `>` say at which end a beam left the field.

use std::collections::BTreeMap;

use drivers::device::Signal;
use units::Time;

use super::View;
use super::lines::{in_unit, signal_words, words};
use crate::volumetric::sight::{Sight, SightReading};

/// Inside the brackets of a bar.
const CELLS: usize = 27;
/// A signal older than this was said by an instrument that is gone.
const SIGNAL_AGE_MAX_S: f64 = 1.0;

/// What is remembered from picture to picture.
pub(super) struct Screen {
    machine: String,
    is_first: bool,
    /// By instrument: the strongest signal so far, which its bar is as wide as.
    strongest: BTreeMap<String, i32>,
}

impl Screen {
    pub(super) fn new(machine: &str) -> Self {
        Self {
            machine: machine.to_owned(),
            is_first: true,
            strongest: BTreeMap::new(),
        }
    }

    /// The picture with what puts it in the place of the one before: from the top, each line cut to its end, and
    /// what was below it wiped away.
    pub(super) fn draw(&mut self, view: &View) -> String {
        let clear = if self.is_first { "\x1b[2J" } else { "" };
        self.is_first = false;
        let lines = self.lines(view).into_iter();
        let lines: String = lines.map(|it| it + "\x1b[K\n").collect();
        format!("{clear}\x1b[H{lines}\x1b[J")
    }

    fn lines(&mut self, view: &View) -> Vec<String> {
        let machine: String = self.machine.chars().take(24).collect();
        let mut lines = vec![
            format!(
                "{machine}  {:.1} s   no drive is enabled by this; Ctrl-C ends",
                view.seconds
            ),
            format!(
                "{:8}   {:>9} {:^29} {:>9}",
                "detector", "mid, um", "all that it can show", "ref, um"
            ),
        ];
        let mut before = None;
        for sight in &view.sights {
            let axis = sight.name.chars().next();
            if before.is_some() && axis != before {
                lines.push(String::new());
            }
            before = axis;
            lines.extend(sight_lines(sight));
        }
        if !view.signals.is_empty() {
            lines.push(String::new());
        }
        for (name, signal) in &view.signals {
            lines.push(self.signal_line(name, signal.as_ref(), view.now));
        }
        lines
    }

    fn signal_line(&mut self, name: &str, signal: Option<&Signal>, now: Time) -> String {
        let name: String = name.chars().take(10).collect();
        let Some(signal) = signal else {
            return format!("{name:<10} says nothing of its signal");
        };
        let age_s = now.since(signal.at).as_secs_f64();
        let state = match age_s > SIGNAL_AGE_MAX_S {
            true => format!("{age_s:.0} s old"),
            false => signal_words(signal).0.to_owned(),
        };
        let Some(strength) = signal.strength else {
            return format!("{name:<10} {:>9} [{:CELLS$}] {state}", "-", "");
        };
        let strongest = self.strongest.entry(name.clone()).or_default();
        *strongest = (*strongest).max(strength);
        let share = f64::from(strength.max(0)) / f64::from((*strongest).max(1));
        let filled = (share * CELLS as f64).round() as usize;
        let bar = "#".repeat(filled.min(CELLS));
        let least = signal.least.map(|it| format!(", at least {it}"));
        let best = format!("best {strongest}{}", least.unwrap_or_default());
        format!("{name:<10} {strength:>9} [{bar:<CELLS$}] {state}, {best}")
    }
}

/// One line for each reading; the first says which detector it is, and how it is.
fn sight_lines(sight: &Sight) -> Vec<String> {
    let readings = sight.readings.iter().enumerate();
    let line = |(number, reading): (usize, &SightReading)| {
        let (name, state) = match number {
            0 => (&*sight.name, state(sight)),
            _ => ("", String::new()),
        };
        let along = reading.along.map(|it| it.to_string()).unwrap_or_default();
        let off = reading.off_reference();
        let off = off.map_or_else(String::new, |it| format!("{:+.2}", in_unit(reading, it)));
        let line = format!(
            "{name:<8}{along:<2} {:>9} [{}] {off:>9} {state}",
            number_of(reading),
            bar(reading)
        );
        line.trim_end().to_owned()
    };
    readings.map(line).collect()
}

fn state(sight: &Sight) -> String {
    let state = sight.trouble.as_ref();
    let state = state.map_or("good", |trouble| words(trouble).0);
    match sight.light {
        Some(light) => format!("{:.2} V {state}", light.value()),
        None if sight.is_roll() => format!("arcsec {state}"),
        None => state.to_owned(),
    }
}

/// From the middle of the detector; beyond its field, that it is farther than the end.
fn number_of(reading: &SightReading) -> String {
    let middle = reading.middle;
    match (reading.value, reading.nearest) {
        (Some(value), _) => format!("{:+.2}", in_unit(reading, value - middle)),
        (None, Some(end)) => format!("({:+.0})", in_unit(reading, end - middle)),
        (None, None) => "-".to_owned(),
    }
}

fn bar(reading: &SightReading) -> String {
    let (low, high) = reading.field;
    let last = CELLS - 1;
    let cell = |value: f64| {
        let share = (value - low) / (high - low);
        (share * last as f64).round().clamp(0.0, last as f64) as usize
    };
    let mut cells = [' '; CELLS];
    if let Some((from, to)) = reading.reference {
        cells[cell(from)..=cell(to)].fill(':');
    }
    cells[cell(reading.middle)] = '|';
    match (reading.value, reading.nearest) {
        (Some(value), _) => cells[cell(value)] = 'o',
        (None, Some(end)) if end <= low => cells[0] = '<',
        (None, Some(end)) if end >= high => cells[last] = '>',
        // In trouble of another kind, or in the other direction: where the light is.
        (None, Some(end)) => cells[cell(end)] = '?',
        (None, None) => {}
    }
    cells.iter().collect()
}

#[cfg(test)]
mod tests {
    use compensator::volumetric::Axis;
    use compensator::volumetric::online::Trouble;
    use drivers::device::SignalTrouble;
    use units::{Metres, Radians, Volts};

    use super::*;

    fn reading(along: Axis, value_um: Option<f64>, nearest_um: Option<f64>) -> SightReading {
        let metres = |um: f64| Metres::from_um(um).value();
        SightReading {
            along: Some(along),
            field: (metres(-188.0), metres(188.0)),
            middle: 0.0,
            reference: Some((metres(-10.0), metres(40.0))),
            value: value_um.map(metres),
            nearest: nearest_um.map(metres),
        }
    }

    fn sight(name: &str, readings: Vec<SightReading>, trouble: Option<Trouble>) -> Sight {
        Sight {
            name: name.into(),
            light: Some(Volts(8.024)),
            readings,
            trouble,
        }
    }

    fn beside() -> Option<Trouble> {
        let (seen, low, high) = (0.4, -0.3, 0.3);
        Some(Trouble::Beside { seen, low, high })
    }

    fn view(sights: Vec<Sight>) -> View {
        View {
            seconds: 12.4,
            sights,
            signals: vec![(
                "laser".into(),
                Some(Signal {
                    at: Time::from_seconds(3.0),
                    strength: Some(45),
                    least: Some(20),
                    trouble: None,
                }),
            )],
            now: Time::from_seconds(3.2),
        }
    }

    fn lines(view: &View) -> Vec<String> {
        Screen::new("volumetric").lines(view)
    }

    #[test]
    fn a_picture_says_where_the_beam_is_and_which_way_to_go() {
        let good = vec![
            reading(Axis::Y, Some(-62.666), None),
            reading(Axis::Z, Some(20.0), None),
        ];
        let left = vec![
            reading(Axis::Y, None, Some(188.0)),
            reading(Axis::Z, None, Some(94.0)),
        ];
        let seen = lines(&view(vec![
            sight("x slide", good, None),
            sight("x end", left, beside()),
        ]));
        let expected = [
            "volumetric  12.4 s   no drive is enabled by this; Ctrl-C ends",
            "detector     mid, um     all that it can show        ref, um",
            "x slide y     -62.67 [         o  :|:::          ]    -52.67 8.02 V good",
            "        z     +20.00 [            :|o::          ]     +0.00",
            "x end   y     (+188) [            :|:::         >]           8.02 V BESIDE",
            "        z      (+94) [            :|:::   ?      ]",
            "",
            "laser             45 [###########################] good, best 45, at least 20",
        ];
        assert_eq!(seen.len(), expected.len());
        for (seen, expected) in seen.iter().zip(expected) {
            assert_eq!(seen.trim_end(), expected);
        }
    }

    /// Three axes with both detectors, three rolls and an instrument, all in the trouble with the longest words.
    #[test]
    fn the_largest_picture_fits_a_terminal() {
        let bright = || {
            let (seen, limit) = (Volts(16.0), Volts(11.0));
            Some(Trouble::Saturated { seen, limit })
        };
        let mut sights = Vec::new();
        for axis in Axis::ALL {
            for whose in ["slide", "end"] {
                let [first, second] = axis.others();
                let both = vec![
                    reading(first, Some(-187.99), None),
                    reading(second, None, Some(-188.0)),
                ];
                let mut one = sight(&format!("{axis} {whose}"), both, bright());
                one.light = Some(Volts(16.0));
                sights.push(one);
            }
            let largest = Radians::from_arcsec(600.0).value();
            let roll = SightReading {
                along: None,
                field: (-largest, largest),
                middle: 0.0,
                reference: Some((0.0, 0.0)),
                value: Some(-largest),
                nearest: Some(-largest),
            };
            sights.push(Sight {
                light: None,
                ..sight(&format!("{axis} roll"), vec![roll], bright())
            });
        }
        let lines = lines(&view(sights));
        assert!(lines.len() < 24, "{} lines: {lines:#?}", lines.len());
        for line in lines {
            assert!(line.chars().count() < 80, "{line}");
        }
    }

    #[test]
    fn a_signal_that_stays_away_is_told_and_the_best_one_is_kept() {
        let mut screen = Screen::new("m");
        let mut view = view(Vec::new());
        screen.lines(&view);
        if let Some((_, Some(signal))) = view.signals.first_mut() {
            signal.strength = Some(15);
            signal.trouble = Some(SignalTrouble::Weak);
        }
        let seen = screen.lines(&view).pop().unwrap();
        assert!(
            seen.contains("[#########   ") && seen.contains("WEAK, best 45"),
            "{seen}"
        );
        view.now = Time::from_seconds(9.0);
        let seen = screen.lines(&view).pop().unwrap();
        assert!(seen.contains("6 s old"), "{seen}");
        view.signals[0].1 = None;
        let seen = screen.lines(&view).pop().unwrap();
        assert!(seen.contains("says nothing of its signal"), "{seen}");
    }

    /// Only the first picture wipes the terminal: it does not flicker.
    #[test]
    fn a_picture_is_drawn_over_the_one_before() {
        let mut screen = Screen::new("m");
        let view = view(Vec::new());
        assert!(screen.draw(&view).starts_with("\x1b[2J\x1b[H"));
        let again = screen.draw(&view);
        assert!(
            again.starts_with("\x1b[H") && again.ends_with("\x1b[J"),
            "{again:?}"
        );
    }
}
