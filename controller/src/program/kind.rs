//! What a verb acts upon: a platform, a work volume, linear or rotary axes, as the configuration says.

use super::verbs::Verbs;
use crate::Failure;
use crate::config::{self, MachineConfig};
use crate::program::MachineArgs;
use crate::program::output::Ended;

/// The kinds of things that have a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// An alignment platform on screws.
    Platform,
    /// Linear axes by themselves.
    Linear,
    /// Rotary axes.
    Rotary,
    /// Three axes corrected throughout their volume.
    Volumetric,
}

impl Kind {
    pub(crate) const ALL: [Self; 4] =
        [Self::Linear, Self::Rotary, Self::Platform, Self::Volumetric];

    /// What this kind does for the verbs of the cycle.
    pub(crate) const fn verbs(self) -> &'static Verbs {
        match self {
            Self::Linear => &super::linear::VERBS,
            Self::Rotary => &super::rotary::VERBS,
            Self::Platform => &super::platform::VERBS,
            Self::Volumetric => &super::volumetric::VERBS,
        }
    }
}

/// Runs a verb on what it is for: the axes it names, or the only kind that there is.
pub(crate) fn by_kind<'a>(
    machine: &MachineArgs,
    named: impl Iterator<Item = &'a str>,
    verb: impl FnOnce(Kind) -> Ended,
) -> Ended {
    let named: Vec<&str> = named.collect();
    verb(kind_of(&config::load(&machine.config)?.config, &named)?)
}

fn kind_of(config: &MachineConfig, named: &[&str]) -> Result<Kind, Failure> {
    let rotary = |name: &&&str| config.rotary.contains_key(**name);
    let (turning, all) = (named.iter().filter(rotary).count(), named.len());
    if all > 0 && turning == all {
        return Ok(Kind::Rotary);
    }
    if turning > 0 {
        return Err(Failure::Usage {
            what: format!("{} are axes of different kinds", named.join(", ")),
            help: "use one command for the linear axes and another for the rotary axes".into(),
        });
    }
    if config.volumetric.is_some() {
        return Ok(Kind::Volumetric);
    }
    if config.platform.is_some() {
        return Ok(Kind::Platform);
    }
    match (config.axis.is_empty(), config.rotary.is_empty()) {
        (true, _) => Ok(Kind::Rotary),
        (false, false) if all == 0 => {
            let names: Vec<_> = config.axis.keys().chain(config.rotary.keys()).collect();
            Err(Failure::Usage {
                what: "the machine has linear and rotary axes".into(),
                help: format!("say which with --axis: {names:?}"),
            })
        }
        _ => Ok(Kind::Linear),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Edit;

    const LINEAR: &str = include_str!("../../../configs/machines/linear.toml");
    const ROTARY: &str = include_str!("../../../configs/machines/rotary.toml");
    const VOLUME: &str = include_str!("../../../configs/machines/volumetric.toml");
    const UVW: &str = include_str!("../../../configs/machines/uvw.toml");

    #[track_caller]
    fn check(text: &str, named: &[&str], expected: Option<Kind>) {
        let config = config::parse(text, "m.toml").unwrap().config;
        assert_eq!(kind_of(&config, named).ok(), expected, "{named:?}");
    }

    #[test]
    fn a_verb_acts_on_what_it_names_or_on_the_only_kind_there_is() {
        check(LINEAR, &[], Some(Kind::Linear));
        check(LINEAR, &["x"], Some(Kind::Linear));
        check(ROTARY, &[], Some(Kind::Rotary));
        check(ROTARY, &["c"], Some(Kind::Rotary));
        check(UVW, &[], Some(Kind::Platform));
        check(UVW, &["x", "theta"], Some(Kind::Platform));
        check(VOLUME, &["x", "z"], Some(Kind::Volumetric));
    }

    #[test]
    fn of_several_kinds_one_must_be_named() {
        let rotary = ROTARY.find("[rotary.c]").unwrap();
        let mixed = format!("{LINEAR}\n{}", &ROTARY[rotary..])
            .edit("node_id = 1\ncounts", "node_id = 9\ncounts");
        check(&mixed, &[], None);
        check(&mixed, &["x"], Some(Kind::Linear));
        check(&mixed, &["c"], Some(Kind::Rotary));
        check(&mixed, &["x", "c"], None);
    }
}
