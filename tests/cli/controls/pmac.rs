//! A Turbo PMAC with tables of DEFINE COMP and DEFINE BLCOMP.
//!
//! Source: Delta Tau, Turbo PMAC/PMAC2 Software Reference: `DEFINE COMP` (one-dimensional; entries in 1/16 count, the
//! first one spacing from the motor's zero, the last one at {count length} and at the zero; outside the position is
//! rolled over), `DEFINE BLCOMP` (the amount subtracted while moving in the negative direction, added to Ixx86), Ixx86,
//! I51. Turbo PMAC User Manual: "Active Calculation of Corrections" (straight lines, added to the desired position, by
//! the position without correction).

struct Table {
    entries: Vec<i64>,
    length: i64,
}

impl Table {
    /// In counts, at a position in counts.
    fn at(&self, position: f64) -> f64 {
        let count = self.entries.len() as f64;
        let place = position.rem_euclid(self.length as f64) / (self.length as f64 / count);
        let (before, share) = (place.floor(), place.fract());
        // Entry 1 is the first of the list, entry 0 the last.
        let entry = |at: f64| {
            let at = at as usize % self.entries.len();
            self.entries[(at + self.entries.len() - 1) % self.entries.len()] as f64
        };
        (entry(before) * (1.0 - share) + entry(before + 1.0) * share) / 16.0
    }
}

/// A motor whose commands have been read.
#[derive(Default)]
pub(crate) struct Motor {
    comp: Option<Table>,
    backlash: Option<Table>,
    constant: i64,
    is_on: bool,
}

impl Motor {
    /// The commands for motor `number`.
    pub(crate) fn load(commands: &str, number: u32) -> Self {
        let mut motor = Self::default();
        let mut waits: Option<(bool, usize, Table)> = None;
        for line in commands.lines() {
            let line = line.split(';').next().unwrap_or_default().trim();
            if let Some((is_comp, wanted, mut table)) = waits.take() {
                table.entries.extend(
                    line.split_whitespace()
                        .map(|it| it.parse::<i64>().expect("whole numbers")),
                );
                assert!(
                    table.entries.len() <= wanted,
                    "more entries than were defined"
                );
                match table.entries.len() == wanted {
                    false => waits = Some((is_comp, wanted, table)),
                    true if is_comp => motor.comp = Some(table),
                    true => motor.backlash = Some(table),
                }
                continue;
            }
            let words = |start: &str| {
                line.strip_prefix(start)
                    .map(|it| it.split(',').collect::<Vec<_>>())
            };
            if let Some(words) = words("DEFINE COMP ") {
                assert!(motor.backlash.is_none(), "ERR003: a BLCOMP buffer exists");
                assert_eq!(words[1..3], [format!("#{number}D"), format!("#{number}")]);
                waits = Some((true, words[0].parse().expect("entries"), table(words[3])));
            } else if let Some(words) = words("DEFINE BLCOMP ") {
                waits = Some((false, words[0].parse().expect("entries"), table(words[1])));
            } else if let Some(value) = line.strip_prefix(&format!("I{number}86=")) {
                motor.constant = value.parse().expect("a number");
                assert!((0..=8_388_607).contains(&motor.constant));
            } else if line == "I51=1" {
                motor.is_on = true;
            } else {
                assert!(line.is_empty() || line == format!("#{number}"), "{line}");
            }
        }
        assert!(waits.is_none(), "entries are missing");
        motor
    }

    /// Where it is sent for a desired position, both in counts.
    pub(crate) fn commanded(&self, desired: f64, is_growing: bool) -> f64 {
        assert!(self.is_on, "I51 is 0");
        let comp = self.comp.as_ref().map_or(0.0, |it| it.at(desired));
        let backlash =
            self.backlash.as_ref().map_or(0.0, |it| it.at(desired)) + self.constant as f64 / 16.0;
        desired + comp - if is_growing { 0.0 } else { backlash }
    }

    /// Whether the last entries, which also belong to the motor's zero, are 0.
    pub(crate) fn is_zero_at_zero(&self) -> bool {
        let tables = [&self.comp, &self.backlash].into_iter().flatten();
        tables.map(|it| it.entries.last()).all(|it| it == Some(&0))
    }
}

fn table(length: &str) -> Table {
    Table {
        entries: Vec::new(),
        length: length.parse().expect("a whole number of counts"),
    }
}

#[test]
fn entries_count_from_the_first_spacing_and_are_sixteenths() {
    let motor = Motor::load(
        "#1\nDEFINE COMP 8,#1D,#1,4000\n160 80 120 96\n20 56 12 0\nI51=1\n",
        1,
    );
    let near =
        |seen: f64, expected: f64| assert!((seen - expected).abs() < 1e-9, "{seen} {expected}");
    near(motor.commanded(500.0, true), 510.0);
    near(motor.commanded(1000.0, false), 1005.0);
    near(motor.commanded(250.0, true), 255.0);
    near(motor.commanded(-500.0, true), -500.0 + 12.0 / 16.0);
    near(motor.commanded(4500.0, true), 4510.0);
    let motor = Motor::load("#2\nI286=32\nDEFINE BLCOMP 2,100\n16 0\nI51=1\n", 2);
    near(motor.commanded(50.0, true), 50.0);
    near(motor.commanded(50.0, false), 47.0);
    near(motor.commanded(0.0, false), -2.0);
}
