//! `truestage zero` of a gantry.

use serde_json::{Value, json};
use units::{Metres, Radians};

use crate::Failure;
use crate::config::MachineConfig;
use crate::linear::{GantryZeroed, RotationEntry};
use crate::program::json as to_json;
use crate::program::linear::told;
use crate::program::output::{Ended, Output, with_counters};
use crate::program::session::Session;
use crate::runs::Told;

/// The gantry that is meant by `name`, or by none where the machine has nothing else to zero.
pub(super) fn asked_for(config: &MachineConfig, name: Option<&str>) -> Option<String> {
    match name {
        Some(name) => config
            .gantry
            .get_key_value(name)
            .map(|(name, _)| name.clone()),
        None => {
            let is_all = config.gantry.len() == 1 && config.axis.len() == 2;
            config.gantry.keys().next().filter(|_| is_all).cloned()
        }
    }
}

pub(super) fn zero(mut session: Session, gantry: &str, output: Output) -> Ended {
    let store = session.store.clone();
    let side = session.machine.config().gantry[gantry].axes[0].clone();
    let (zeroed, counters) = session.machine.guarded(|machine| {
        machine.start()?;
        let zeroed = machine.linear(&side)?.zero_gantry(&store)?;
        machine.shut_down()?;
        Ok((zeroed, to_json::counters(&machine.devices().counters())))
    })?;
    let told = told_of(&zeroed);
    let entry = &zeroed.entry;
    let Some((change, limit)) = entry.change_rad().zip(entry.angle_limit_rad) else {
        return output.told(told, counters);
    };
    if entry.is_within_limit() {
        return output.told(told, counters);
    }
    let failure = Failure::Turned {
        gantry: zeroed.name.clone(),
        seen: Radians(change),
        limit: Radians(limit),
    };
    output.bad_result(&told.text, with_counters(told.value, counters), failure)
}

/// Microradians, rounded to a hundred-thousandth.
fn urad(radians: f64) -> f64 {
    to_json::rounded(radians * 1e6, 1e5)
}

/// What its angle is compared with.
pub(super) fn compared(it: &RotationEntry) -> String {
    let Some((change, limit)) = it.change_rad().zip(it.angle_limit_rad) else {
        return "nothing says how it stood at acceptance".into();
    };
    format!(
        "at acceptance {:+.2} µrad: changed by {:+.2} µrad, the limit is {:.2} µrad",
        (it.angle_rad - change) * 1e6,
        change * 1e6,
        limit * 1e6
    )
}

fn told_of(zeroed: &GantryZeroed) -> Told {
    Told {
        text: text(zeroed),
        value: value(zeroed),
    }
}

fn text(zeroed: &GantryZeroed) -> String {
    let (name, it) = (&zeroed.name, &zeroed.entry);
    let mut text = format!(
        "gantry {name}: the stage stood turned by {:+.2} µrad where both drives showed the same, standard uncertainty \
         {:.2} µrad (positive: {} ahead)\n{}",
        it.angle_rad * 1e6,
        it.standard_uncertainty_rad * 1e6,
        it.ahead_when_positive,
        compared(it),
    );
    if it.angle_at_acceptance_rad.is_none() {
        text += &format!(
            "; to compare later angles with this one, write `angle_at_acceptance_urad = {:.2}` and an \
             `angle_limit_urad` in [gantry.{name}]",
            it.angle_rad * 1e6
        );
    }
    if let Some(before) = &zeroed.previous {
        let since = it.angle_rad - before.angle_rad;
        text += &format!("\nsince the zero before: {:+.2} µrad", since * 1e6);
    }
    text += &format!(
        "\nboth sides count from their zero points now: where they show the same the stage is not turned, standard \
         uncertainty {:.2} µrad",
        it.zero_u_rad * 1e6
    );
    for (axis, side) in it.axes.iter().zip(&zeroed.sides) {
        text += &format!("\n{}", told::zeroed(axis, side).text);
    }
    text + &format!("\nthe rotation is recorded in {}", zeroed.journal.display())
}

fn value(zeroed: &GantryZeroed) -> Value {
    let it = &zeroed.entry;
    let sides = it.axes.iter().zip(&zeroed.sides);
    let sides: Vec<_> = sides
        .map(|(axis, side)| told::zeroed(axis, side).value)
        .collect();
    json!({
        "gantry": zeroed.name,
        "rotation": {
            "angle_urad": urad(it.angle_rad),
            "standard_uncertainty_urad": urad(it.standard_uncertainty_rad),
            "degrees_of_freedom": it.degrees_of_freedom,
            "ahead_when_positive": it.ahead_when_positive,
            "distance_mm": Metres(it.distance_m).mm(),
            "distance_standard_uncertainty_mm": Metres(it.distance_u_m).mm(),
            "scale_standard_uncertainty_ppm": it.scale_u * 1e6,
            "angle_at_acceptance_urad": it.angle_at_acceptance_rad.map(urad),
            "change_since_acceptance_urad": it.change_rad().map(urad),
            "angle_limit_urad": it.angle_limit_rad.map(urad),
            "within_limit": it.is_within_limit(),
            "change_since_last_urad": zeroed.previous.as_ref().map(|it_before| urad(it.angle_rad - it_before.angle_rad)),
            "zero_standard_uncertainty_urad": urad(it.zero_u_rad),
        },
        "sides": sides,
        "journal": zeroed.journal,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Edit;
    use crate::config::parse;

    const GANTRY: &str = include_str!("../../../../configs/machines/gantry.toml");

    #[test]
    fn a_gantry_is_meant_by_its_name_or_where_there_is_nothing_else() {
        let asked = |text: &str, name: Option<&str>| {
            asked_for(&parse(text, "m.toml").unwrap().config, name)
        };
        let beam = || Some("beam".to_owned());
        assert_eq!(asked(GANTRY, Some("beam")), beam());
        assert_eq!(asked(GANTRY, None), beam());
        assert_eq!(asked(GANTRY, Some("x1")), None);
        let begin = GANTRY.find("[axis.x2]").expect("it has one");
        let end = GANTRY.find("[analog.hall_1]").expect("it comes next");
        let third = GANTRY[begin..end]
            .edit("axis.x2]", "axis.y]")
            .edit("axis.x2.", "axis.y.");
        let third = third.edit("node_id = 3\n", "node_id = 9\n");
        let three = format!("{GANTRY}\n{third}");
        assert_eq!(asked(&three, None), None);
        assert_eq!(asked(&three, Some("beam")), beam());
    }

    fn entry(angle_urad: f64, accepted: Option<(f64, f64)>) -> RotationEntry {
        RotationEntry {
            axes: ["x1".into(), "x2".into()],
            zeros: [String::new(), String::new()],
            origins_m: [0.0, 0.0],
            ahead_when_positive: "x2".into(),
            distance_m: 0.4,
            distance_u_m: 1e-4,
            scale_u: 9e-4,
            angle_rad: angle_urad * 1e-6,
            standard_uncertainty_rad: 0.1e-6,
            degrees_of_freedom: Some(8.0),
            angle_at_acceptance_rad: accepted.map(|it| it.0 * 1e-6),
            angle_limit_rad: accepted.map(|it| it.1 * 1e-6),
            zero_u_rad: 0.1e-6,
            at_s: 1.0,
        }
    }

    #[test]
    fn an_angle_is_compared_with_that_at_acceptance() {
        let said = compared(&entry(-30.0, Some((10.0, 50.0))));
        assert_eq!(
            said,
            "at acceptance +10.00 µrad: changed by -40.00 µrad, the limit is 50.00 µrad"
        );
        assert!(entry(-30.0, Some((10.0, 50.0))).is_within_limit());
        assert!(!entry(-41.0, Some((10.0, 50.0))).is_within_limit());
        assert!(entry(5000.0, None).is_within_limit());
        assert!(compared(&entry(5.0, None)).contains("nothing says"));
    }
}
