//! A machine's file whose values are changed one by one, and what they are drawn by.

use std::fmt::Debug;

use tests::random;

/// What values are drawn by: the same seed draws the same machine.
pub struct Draw(pub u64);

impl Draw {
    /// Any between both alike.
    pub fn even(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * random(&mut self.0)
    }

    /// Any size between both alike, as lengths, speeds and noises of machines are spread.
    pub fn size(&mut self, (low, high): (f64, f64)) -> f64 {
        self.even(low.ln(), high.ln()).exp()
    }

    /// A whole number from `low` to `high`.
    pub fn whole(&mut self, low: u32, high: u32) -> u32 {
        let at = self.even(f64::from(low), f64::from(high) + 1.0);
        (at as u32).min(high)
    }

    pub fn of<T: Copy>(&mut self, among: &[T]) -> T {
        among[self.whole(0, among.len() as u32 - 1) as usize]
    }
}

/// What keys end in whose values somebody may give in another unit.
const UNITS: [&str; 11] = [
    "_nm", "_um", "_mm", "_per_s", "_per_s2", "_ms", "_s", "_mv", "_v", "_arcsec", "_deg",
];

/// The text of a machine's file, line by line.
pub struct Draft(Vec<String>);

impl Draft {
    pub fn of(text: &str) -> Self {
        Self(text.lines().map(Into::into).collect())
    }

    pub fn text(&self) -> String {
        self.0.join("\n")
    }

    /// Gives `key` of every section called `section` another value.
    #[track_caller]
    pub fn set(&mut self, section: &str, key: &str, value: impl Debug) {
        assert!(self.is_set(section, key, value), "no {section}.{key}");
    }

    /// Likewise where such a section has it: amplifiers on a serial line have no heartbeat.
    pub fn set_if_there(&mut self, section: &str, key: &str, value: impl Debug) {
        self.is_set(section, key, value);
    }

    /// Exchanges a whole line: of three sections that have one name, each has its own.
    #[track_caller]
    pub fn exchange(&mut self, from: &str, to: &str) {
        let line = self.0.iter_mut().find(|it| *it == from);
        to.clone_into(line.unwrap_or_else(|| panic!("no `{from}`")));
    }

    /// Makes one number, by chance, a thousand times as large or as small: one of another unit. Says of which key.
    pub fn misread(&mut self, draw: &mut Draw) -> String {
        let numbers = self.0.iter().enumerate().filter_map(|(at, line)| {
            let (key, value) = line.split_once(" = ")?;
            let number: f64 = value.split('#').next()?.trim().parse().ok()?;
            let has_unit = UNITS.iter().any(|it| key.ends_with(it));
            (has_unit && number != 0.0).then(|| (at, key.to_owned(), number))
        });
        let numbers: Vec<_> = numbers.collect();
        let one = draw.whole(0, numbers.len() as u32 - 1) as usize;
        let (at, key, number) = numbers[one].clone();
        // Whole numbers are milliseconds, of which there is no thousandth.
        self.0[at] = match self.0[at].contains('.') {
            true => format!("{key} = {:?}", number * draw.of(&[1e3, 1e-3])),
            false => format!("{key} = {:.0}", number * 1e3),
        };
        key
    }

    fn is_set(&mut self, section: &str, key: &str, value: impl Debug) -> bool {
        let (mut is_inside, mut is_set) = (false, false);
        for line in &mut self.0 {
            if line.starts_with('[') {
                let name = line.split(']').next().unwrap_or_default();
                is_inside = name.trim_start_matches('[') == section;
            } else if is_inside && line.split('=').next().is_some_and(|it| it.trim() == key) {
                *line = format!("{key} = {value:?}");
                is_set = true;
            }
        }
        is_set
    }
}
