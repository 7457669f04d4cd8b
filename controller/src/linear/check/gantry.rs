//! Whether two axes can be the sides of one stage.

use units::Short;

use crate::config::MachineConfig;
use crate::config::judge::{Finding, Judge};
use crate::config::validate::drive::check_axis_name;
use crate::linear::GantryConfig;

/// A limit below so many standard uncertainties is exceeded by a sound stage more often than once in 370 zeros.
#[cfg(feature = "program")]
const LIMIT_PER_UNCERTAINTY: f64 = 3.0;

pub(super) fn check_gantries(config: &MachineConfig, findings: &mut Vec<Finding>) {
    let mut sides: Vec<&str> = Vec::new();
    for (name, gantry) in &config.gantry {
        check_axis_name(findings, "gantry", name);
        let judge = &mut Judge::at(format!("gantry.{name}"), findings);
        if config.axis.contains_key(name) || config.rotary.contains_key(name) {
            judge.say(
                "",
                format!("an axis is also called `{name}`"),
                "give the gantry a name of its own: `--axis` takes either",
            );
        }
        check_sides(judge, config, gantry);
        if let Some(twice) = gantry.axes.iter().find(|it| sides.contains(&it.as_str())) {
            judge.say(
                "axes",
                format!("`{twice}` is a side of another gantry already"),
                "name each axis once",
            );
        }
        sides.extend(gantry.axes.iter().map(String::as_str));
        check_angles(judge, config, gantry);
    }
}

fn check_sides(judge: &mut Judge<'_>, config: &MachineConfig, gantry: &GantryConfig) {
    let [first, second] = &gantry.axes;
    if first == second {
        judge.say(
            "axes",
            format!("`{first}` is named twice"),
            "name the axis of each side",
        );
    }
    let sensors = |axis: &String| Some(&config.axis.get(axis)?.zero.as_ref()?.analog);
    if let (Some(own), Some(other)) = (sensors(first), sensors(second))
        && own == other
        && first != second
    {
        judge.say(
            "axes",
            format!("`{first}` and `{second}` have both their zero by `{own}`, and each side has Hall sensors of its own"),
            format!("look at `analog` of [axis.{first}.zero] and [axis.{second}.zero]"),
        );
    }
    for axis in &gantry.axes {
        if config
            .axis
            .get(axis)
            .is_some_and(|it| it.drive.kept_zero().is_some())
        {
            judge.say(
                "axes",
                format!("`{axis}` has a `kept_zero`, and one side that has its zero may be moved without the other"),
                format!("remove axis.{axis}.kept_zero: both sides are zeroed together, after each start"),
            );
        }
        judge.known("axes", axis, &config.axis, "axis");
        if config.axis.get(axis).is_some_and(|it| it.zero.is_none()) {
            judge.say(
                "axes",
                format!("`{axis}` has no [axis.{axis}.zero]: its side has no zero point"),
                "add the section",
            );
        }
    }
    if !gantry.axes.contains(&gantry.ahead_when_positive) {
        judge.say(
            "ahead_when_positive",
            format!("`{}` is no side of it", gantry.ahead_when_positive),
            format!("name `{first}` or `{second}`"),
        );
    }
}

fn check_angles(judge: &mut Judge<'_>, config: &MachineConfig, gantry: &GantryConfig) {
    let zeros = gantry.axes.iter().filter_map(|axis| config.axis.get(axis));
    let searched_mm = zeros
        .filter_map(|it| it.zero.as_ref())
        .map(|it| it.search_limit_mm)
        .fold(0.0, f64::max);
    let turned_mrad = searched_mm / gantry.distance_mm * 1e3;
    if turned_mrad > gantry.turn_limit_mrad {
        judge.say(
            "turn_limit_mrad",
            format!(
                "a search over {} mm on one side turns the stage by up to {} mrad",
                Short(searched_mm),
                Short(turned_mrad)
            ),
            "shorten `search_limit_mm` of both sides, or raise the limit where the stage bears that",
        );
    }
    if gantry.angle_at_acceptance_urad.is_some() != gantry.angle_limit_urad.is_some() {
        judge.say(
            "angle_limit_urad",
            "`angle_at_acceptance_urad` and `angle_limit_urad` go together",
            "give both or neither",
        );
    }
}

/// What an operator should know of gantries that are sound.
#[cfg(feature = "program")]
pub(crate) fn notes(config: &MachineConfig) -> Vec<String> {
    let doubtful = config.gantry.iter().filter_map(|(name, it)| {
        let least = LIMIT_PER_UNCERTAINTY * it.change_by_references_urad();
        let limit = it.angle_limit_urad.filter(|limit| *limit < least)?;
        Some(format!(
            "gantry.{name}.angle_limit_urad: warning: {} µrad is less than {LIMIT_PER_UNCERTAINTY} times what the limit \
             switches alone change ({} µrad from one zero to another): a sound stage is beyond it now and then",
            Short(limit),
            Short((it.change_by_references_urad() * 10.0).round() / 10.0),
        ))
    });
    doubtful.collect()
}

#[cfg(test)]
mod tests {
    use crate::Edit;
    use crate::config::parse;
    use crate::config::validate::told::check;

    const GANTRY: &str = include_str!("../../../../configs/machines/gantry.toml");
    const ACCEPTED: &str =
        "turn_limit_mrad = 10.0\nangle_at_acceptance_urad = 12.5\nangle_limit_urad = 200.0";

    #[test]
    fn the_shipped_gantry_is_sound_with_an_angle_at_acceptance_too() {
        let parsed = |text: &str| {
            parse(text, "m.toml")
                .unwrap_or_else(|it| panic!("{it}"))
                .config
        };
        let plain = parsed(GANTRY);
        let gantry = &plain.gantry["beam"];
        assert_eq!(gantry.axes, ["x1", "x2"]);
        assert!((gantry.change_by_references_urad() - 60.0).abs() < 1e-9);
        let accepted = parsed(&GANTRY.edit("turn_limit_mrad = 10.0", ACCEPTED));
        assert_eq!(accepted.gantry["beam"].angle_limit_urad, Some(200.0));
    }

    #[test]
    fn what_no_gantry_can_be_is_found_where_it_stands() {
        for (from, to, key, says) in [
            ("[\"x1\", \"x2\"]", "[\"x1\", \"x3\"]", "axes", "x3"),
            (
                "[\"x1\", \"x2\"]",
                "[\"x2\", \"x2\"]",
                "axes",
                "named twice",
            ),
            (
                "positive = \"x2\"",
                "positive = \"y\"",
                "ahead_when_positive",
                "no side",
            ),
            (
                "mrad = 10.0",
                "mrad = 4.9",
                "turn_limit_mrad",
                "up to 5 mrad",
            ),
            (
                "mrad = 10.0",
                "mrad = 10.0\nangle_limit_urad = 5.0",
                "angle_limit_urad",
                "go together",
            ),
        ] {
            check(GANTRY, from, to, &format!("gantry.beam.{key}"), says);
        }
        check(
            GANTRY,
            "[gantry.beam]",
            "[gantry.x1]",
            "gantry.x1",
            "also called",
        );
        let begin = GANTRY.find("[axis.x2.zero]").expect("it has a zero");
        let end = GANTRY.find("# Both sides").expect("it comes next");
        let says = "no [axis.x2.zero]";
        check(GANTRY, &GANTRY[begin..end], "", "gantry.beam.axes", says);
    }

    #[cfg(feature = "program")]
    #[test]
    fn a_limit_that_switches_alone_exceed_is_doubted() {
        let notes = |limit: &str| {
            let accepted = ACCEPTED.edit("= 200.0", &format!("= {limit}"));
            let text = GANTRY.edit("turn_limit_mrad = 10.0", &accepted);
            super::notes(&parse(&text, "m.toml").unwrap().config)
        };
        assert_eq!(notes("180.0"), [""; 0]);
        let said = notes("100.0").concat();
        assert!(
            said.contains("100 µrad is less than 3 times") && said.contains("60 µrad"),
            "{said}"
        );
    }
}
