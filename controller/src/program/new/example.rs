//! The machines that ship, to begin with one of them: those that can be shown, and those that cannot.

use core::fmt;
use std::sync::LazyLock;

use clap::ValueEnum;
use clap::builder::PossibleValue;

use crate::program::kind::KINDS;

/// One of them.
#[derive(Clone, Copy)]
pub(crate) struct Example {
    pub(super) name: &'static str,
    pub(super) help: &'static str,
    /// Its file.
    pub(super) text: &'static str,
}

/// One without a demonstration.
const GANTRY: Example = Example {
    name: "gantry",
    help: "Two linear axes that are the sides of one stage",
    text: include_str!("../../../../configs/machines/gantry.toml"),
};

static EACH: LazyLock<Vec<Example>> = LazyLock::new(|| {
    let demos = KINDS.iter().flat_map(|it| it.demos);
    let shown = demos.map(|it| Example {
        name: it.name,
        help: it.help,
        text: it.files[1],
    });
    shown.chain([GANTRY]).collect()
});

impl ValueEnum for Example {
    fn value_variants<'a>() -> &'a [Self] {
        &EACH
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(self.name).help(self.help))
    }
}

impl fmt::Debug for Example {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}
