//! The machines that can be shown, as words of the command line.

use core::fmt;
use std::sync::LazyLock;

use clap::ValueEnum;
use clap::builder::PossibleValue;

use super::stand::Demo;
use crate::program::kind::KINDS;

/// One of them.
#[derive(Clone, Copy)]
pub(crate) struct Which(pub(crate) &'static Demo);

static EACH: LazyLock<Vec<Which>> = LazyLock::new(|| {
    let demos = KINDS.iter().flat_map(|it| it.demos);
    demos.map(Which).collect()
});

impl Which {
    /// What is shown to whoever does not say.
    pub(crate) fn first() -> Self {
        EACH[0]
    }
}

impl ValueEnum for Which {
    fn value_variants<'a>() -> &'a [Self] {
        &EACH
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(self.0.name).help(self.0.help))
    }
}

impl fmt::Debug for Which {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.0.name)
    }
}
