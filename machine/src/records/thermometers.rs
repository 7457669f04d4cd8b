//! What the thermometers of a machine showed while something was measured that none of them corrects.

use serde::{Deserialize, Serialize};

use super::sound::{CELSIUS, Judged, SECONDS, as_many, counted, number, optionals};

/// So many thermometers are on a machine at most.
const THERMOMETERS_MAX: usize = 1000;

/// What all of them showed at one moment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ThermometersEntry {
    /// What they are called: the module and its channel.
    pub names: Vec<String>,
    /// What each of them showed, °C; `None` for one that said nothing.
    pub temperatures_c: Vec<Option<f64>>,
    /// Monotonic time of the machine, seconds.
    pub at_s: f64,
}

impl ThermometersEntry {
    /// Whether it can be so.
    ///
    /// # Errors
    /// Naming the first thing that cannot.
    pub fn judge(&self) -> Judged {
        counted("names", self.names.len(), 1..=THERMOMETERS_MAX)?;
        let count = self.temperatures_c.len();
        as_many("temperatures_c", count, self.names.len(), "the names")?;
        optionals("temperatures_c", &self.temperatures_c, &CELSIUS)?;
        number("at_s", self.at_s, &SECONDS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thermometers_that_cannot_be_so_are_refused_by_what_is_wrong() {
        let sound = ThermometersEntry {
            names: vec!["heat 4".into(), "heat 5".into()],
            temperatures_c: vec![Some(20.8), None],
            at_s: 3.0,
        };
        assert_eq!(sound.judge(), Ok(()));
        let wrong = |change: fn(&mut ThermometersEntry), place: &str| {
            let mut it = sound.clone();
            change(&mut it);
            assert_eq!(it.judge().unwrap_err().place, place);
        };
        wrong(|it| it.names.clear(), "names");
        wrong(|it| it.names.push("heat 6".into()), "temperatures_c");
        wrong(
            |it| it.temperatures_c[0] = Some(-300.0),
            "temperatures_c[0]",
        );
        wrong(|it| it.at_s = f64::NAN, "at_s");
    }
}
