//! What is known of a machine before it is started.

use core::time::Duration;

use machine::Stage;
use truestage::linear::Course;
use truestage::{Failure, Machine};

use super::events::utc_now;
use super::seat::{MovedBy, Plans, Seat, Task};
use crate::quantity::Quantity;
use crate::snapshot::{Fixed, FixedAxis};
use crate::view::{AxisState, RunPlanView};

/// What never changes of `machine`.
pub(crate) fn fixed(machine: &Machine) -> Result<Fixed, Failure> {
    let axes = machine.devices().axis_names().into_iter().map(|name| {
        let (soft_min, soft_max) = machine.soft_limits(&name)?;
        Ok(FixedAxis {
            name,
            soft_min,
            soft_max,
        })
    });
    let section = &machine.config().machine;
    Ok(Fixed {
        name: section.name.clone(),
        stage_serial: section.stage_serial.clone(),
        config_hash: machine.config_hash().as_str().to_owned(),
        started: utc_now(),
        axes: axes.collect::<Result<_, Failure>>()?,
    })
}

/// The linear axes of `machine`, which nobody has yet.
pub(crate) fn seats(machine: &mut Machine) -> Result<Vec<Seat>, Failure> {
    let names = machine.devices().axis_names();
    names.iter().map(|name| seat(machine, name)).collect()
}

fn seat(machine: &mut Machine, name: &str) -> Result<Seat, Failure> {
    let config = machine.config();
    let moved_by = match (&config.platform, &config.volumetric) {
        (Some(_), _) => MovedBy::Platform,
        (None, Some(volume)) if volume.axes.iter().any(|it| it == name) => MovedBy::Volume,
        (None, _) => MovedBy::Itself,
    };
    let motion = &config.axis[name].motion;
    let in_position = Duration::from_millis(motion.position_window_time_ms.into());
    let settings = *machine.axis_settings(name)?;
    Ok(Seat {
        name: name.into(),
        moved_by,
        settings,
        in_position,
        course: Course::default(),
        calibration: None,
        plans: plans(machine, name, moved_by)?,
        task: Task::Free,
        standing_since: None,
        target: None,
        set_point: None,
        standard_uncertainty: None,
        last_cause: None,
        state: AxisState::Disabled,
    })
}

fn plans(machine: &mut Machine, name: &str, moved_by: MovedBy) -> Result<Plans, Failure> {
    let zero = RunPlanView::default();
    let stage = machine.linear(name)?;
    let measured = |of| {
        stage.planned(of).map(|it| RunPlanView {
            points: it.points,
            travel: Some(Quantity::mm(it.travel)),
            seconds_at_least: it.at_least.as_secs_f64(),
            asks: Vec::new(),
        })
    };
    Ok(match moved_by {
        MovedBy::Platform => Plans::default(),
        MovedBy::Volume => Plans {
            zero: Some(zero),
            ..Plans::default()
        },
        MovedBy::Itself => Plans {
            zero: stage.config().zero.as_ref().map(|_| zero),
            calibrate: measured(Stage::Calibrate),
            verify: measured(Stage::Verify),
        },
    })
}
