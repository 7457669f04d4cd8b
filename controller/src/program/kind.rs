//! What a verb acts upon: a platform, a work volume, linear or rotary axes, as the configuration says.

use super::verbs::Verbs;
use super::{linear, platform, rotary, volumetric};
use crate::Failure;
use crate::config::{self, MachineConfig};
use crate::program::MachineArgs;
use crate::program::output::Ended;
use crate::program::show::Shown;

/// Each kind.
pub(crate) const KINDS: &[&Verbs] = &[
    &linear::VERBS,
    &platform::VERBS,
    &rotary::VERBS,
    &volumetric::VERBS,
];

/// Runs a verb on what it is for: the axes it names, or the only kind that there is.
pub(crate) fn by_kind<'a>(
    machine: &MachineArgs,
    named: impl Iterator<Item = &'a str>,
    verb: impl FnOnce(&Verbs) -> Ended,
) -> Ended {
    verb(kind_of_axes(machine, named)?)
}

/// What the axes `named` are, or the only kind that there is.
///
/// # Errors
/// When the configuration cannot be read, or they are of several kinds.
pub(crate) fn kind_of_axes<'a>(
    machine: &MachineArgs,
    named: impl Iterator<Item = &'a str>,
) -> Result<&'static Verbs, Failure> {
    let named: Vec<&str> = named.collect();
    kind_of(&config::load(&machine.config)?.config, &named)
}

fn kind_of(config: &MachineConfig, named: &[&str]) -> Result<&'static Verbs, Failure> {
    let turns = |name: &&&str| config.rotary.contains_key(**name);
    let (turning, all) = (named.iter().filter(turns).count(), named.len());
    if all > 0 && turning == all {
        return Ok(&rotary::VERBS);
    }
    if turning > 0 {
        return Err(Failure::Usage {
            what: format!("{} are axes of different kinds", named.join(", ")),
            help: "use one command for the linear axes and another for the rotary axes".into(),
        });
    }
    // Three axes that move a platform are first of all three axes.
    let mut kinds = KINDS.iter().copied().rev();
    if let Some(kind) = kinds.find(|it| (it.has_the_axes)(config)) {
        return Ok(kind);
    }
    match (config.axis.is_empty(), config.rotary.is_empty()) {
        (true, _) => Ok(&rotary::VERBS),
        (false, false) if all == 0 => {
            let names: Vec<_> = config.axis.keys().chain(config.rotary.keys()).collect();
            Err(Failure::Usage {
                what: "the machine has linear and rotary axes".into(),
                help: format!("say which with --axis: {names:?}"),
            })
        }
        _ => Ok(&linear::VERBS),
    }
}

/// How a kind of content is shown that the store knows.
pub(crate) fn of_kind(kind: &str) -> Shown {
    let all = KINDS.iter().flat_map(|it| it.shown);
    let own = all.into_iter().find(|it| it.kind == kind);
    *own.expect("a test looks for each kind that is stored")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Edit;

    const LINEAR: &str = include_str!("../../../configs/machines/linear.toml");
    const ROTARY: &str = include_str!("../../../configs/machines/rotary.toml");
    const VOLUME: &str = include_str!("../../../configs/machines/volumetric.toml");
    const UVW: &str = include_str!("../../../configs/machines/uvw.toml");

    /// A kind is known by the first machine that it shows.
    #[track_caller]
    fn check(text: &str, named: &[&str], expected: Option<&str>) {
        let config = config::parse(text, "m.toml").unwrap().config;
        let kind = kind_of(&config, named).ok().map(|it| it.demos[0].name);
        assert_eq!(kind, expected, "{named:?}");
    }

    #[test]
    fn a_verb_acts_on_what_it_names_or_on_the_only_kind_there_is() {
        check(LINEAR, &[], Some("linear"));
        check(LINEAR, &["x"], Some("linear"));
        check(ROTARY, &[], Some("rotary"));
        check(ROTARY, &["c"], Some("rotary"));
        check(UVW, &[], Some("uvw"));
        check(UVW, &["x", "theta"], Some("uvw"));
        check(VOLUME, &["x", "z"], Some("volumetric"));
    }

    #[test]
    fn of_several_kinds_one_must_be_named() {
        let rotary = ROTARY.find("[rotary.c]").unwrap();
        let mixed = format!("{LINEAR}\n{}", &ROTARY[rotary..])
            .edit("node_id = 1\ncounts", "node_id = 9\ncounts");
        check(&mixed, &[], None);
        check(&mixed, &["x"], Some("linear"));
        check(&mixed, &["c"], Some("rotary"));
        check(&mixed, &["x", "c"], None);
    }
}
