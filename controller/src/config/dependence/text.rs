//! The text of named values: one line each, `path.key = value`.

use core::fmt::Write;

/// A value as it stands in the text; `None` leaves no line.
pub(crate) trait Value {
    fn written(&self) -> Option<String>;
}

/// A name that the configuration file gives, in quotes: it may have dots in it.
pub(crate) fn quoted(name: &str) -> String {
    let mut text = String::from("\"");
    for letter in name.chars() {
        match letter {
            '"' | '\\' => text.extend(['\\', letter]),
            // A line of the text ends where the value ends, and nowhere else.
            it if it.is_control() => {
                write!(text, "\\u{{{:x}}}", u32::from(it)).expect("a String takes everything");
            }
            it => text.push(it),
        }
    }
    text + "\""
}

impl Value for str {
    fn written(&self) -> Option<String> {
        Some(quoted(self))
    }
}

impl Value for String {
    fn written(&self) -> Option<String> {
        self.as_str().written()
    }
}

macro_rules! by_its_digits {
    ($($number:ty),*) => {$(
        impl Value for $number {
            fn written(&self) -> Option<String> {
                Some(self.to_string())
            }
        }
    )*};
}

by_its_digits!(u8, u32, bool);

impl Value for f64 {
    /// The shortest decimal that reads back as the same double, without an exponent; adding 0 takes
    /// the sign of −0, which is the same place.
    fn written(&self) -> Option<String> {
        Some((self + 0.0).to_string())
    }
}

impl<T: Value> Value for [T] {
    fn written(&self) -> Option<String> {
        let each: Option<Vec<String>> = self.iter().map(Value::written).collect();
        Some(format!("[{}]", each?.join(", ")))
    }
}

impl<T: Value, const N: usize> Value for [T; N] {
    fn written(&self) -> Option<String> {
        self.as_slice().written()
    }
}

impl<T: Value> Value for Option<T> {
    fn written(&self) -> Option<String> {
        self.as_ref()?.written()
    }
}

impl<T: Value + ?Sized> Value for &T {
    fn written(&self) -> Option<String> {
        (**self).written()
    }
}

/// Where lines are added: the text, and the path in front of every key.
pub(crate) struct Place<'a> {
    text: &'a mut String,
    path: String,
}

impl<'a> Place<'a> {
    pub(crate) const fn top(text: &'a mut String) -> Self {
        Self {
            text,
            path: String::new(),
        }
    }

    /// Below `key`.
    pub(crate) fn at(&mut self, key: impl core::fmt::Display) -> Place<'_> {
        Place {
            path: format!("{}{key}.", self.path),
            text: self.text,
        }
    }

    /// One line, unless there is no such value.
    pub(crate) fn say(&mut self, key: &str, value: impl Value) {
        if let Some(value) = value.written() {
            writeln!(self.text, "{}{key} = {value}", self.path).expect("a String takes everything");
        }
    }
}

/// Words of the configuration file. They are written out here: a word that changes there must not
/// change here.
macro_rules! by_its_word {
    ($($name:ty { $($variant:ident: $word:literal),* })*) => {$(
        impl $crate::config::dependence::text::Value for $name {
            fn written(&self) -> Option<String> {
                let word = match self {
                    $(Self::$variant => $word,)*
                };
                $crate::config::dependence::text::Value::written(word)
            }
        }
    )*};
}
pub(crate) use by_its_word;
