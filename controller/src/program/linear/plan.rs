//! `truestage plan zero`: Vc and the bands of a search that fit the curves of the Hall sensors.

use std::path::PathBuf;

use clap::Args;
use compensator::hall_zero::{HallSeries, PlannedLevel};
use serde_json::{Value, json};
use units::{Short, Volts};

use crate::linear::ZeroPlanned;
use crate::linear::sweep::planned;
use crate::ports::Use;
use crate::program::AxisArgs;
use crate::program::data_text::{name_of, read};
use crate::program::json as to_json;
use crate::program::output::{Ended, Output, with_counters};
use crate::program::session::{Session, choose_axis};
use crate::{Failure, config};

/// What `truestage plan zero` is told.
#[derive(Debug, Args)]
pub(crate) struct PlanArgs {
    #[command(flatten)]
    axis: AxisArgs,
    /// A sweep over both flanks, columns position_um,peak_v,slope_v; no port is opened then.
    #[arg(long, value_name = "CSV")]
    sweep: Option<PathBuf>,
}

pub(crate) fn run(args: &PlanArgs, output: Output) -> Ended {
    match &args.sweep {
        Some(path) => {
            let loaded = config::load(&args.axis.machine.config)?;
            let names = loaded.config.axis.keys().cloned().collect();
            let axis = choose_axis(names, &args.axis)?;
            let sweep = HallSeries::from_csv(&read(path)?, &name_of(path))?;
            let planned = planned(&loaded.config, &axis, &sweep, path)?;
            output.result(&text(&planned, &loaded.config), &value(&planned))
        }
        None => measure(args, output),
    }
}

fn measure(args: &PlanArgs, output: Output) -> Ended {
    let mut session = Session::open(&args.axis.machine, "plan", Use::Motion, output)?;
    let names = session.machine.config().axis.keys().cloned().collect();
    let axis = choose_axis(names, &args.axis)?;
    let store = session.store.clone();
    let (planned, counters) = session.machine.guarded(|machine| {
        machine.start()?;
        let planned = machine.linear(&axis)?.plan_zero(&store)?;
        machine.shut_down()?;
        Ok::<_, Failure>((planned, to_json::counters(&machine.devices().counters())))
    })?;
    let text = text(&planned, session.machine.config());
    output.result(&text, &with_counters(value(&planned), counters))
}

fn percent(share: f64) -> String {
    format!("{:.0} %", share * 100.0)
}

fn mv(volts: Volts) -> Short {
    Short(volts.value() * 1e3)
}

fn text(it: &ZeroPlanned, config: &config::MachineConfig) -> String {
    let (plan, chosen, set) = (&it.plan, &it.plan.chosen, &it.plan.settings);
    let [left, right] = chosen.flanks;
    let room = plan.depth - set.delta1 - set.vc;
    let mut text = format!(
        "axis {}: from {} passes over {:.2} to {:.2} mm ({}); for [axis.{}.zero]:\n",
        it.axis,
        it.passes,
        it.from.mm(),
        it.to.mm(),
        it.sweep.display(),
        it.axis
    );
    text += &format!(
        "  level_below_peak_v = {}   # G1 and G2 at {:.3} and {:.3} mm: the peak sensor climbs at {} of its steepest \
         ({:.3} V/mm), the slope sensor at {} of its slope at the zero ({:.3} V/mm)\n",
        Short(set.vc.value()),
        left.mm(),
        right.mm(),
        percent(chosen.steepness),
        plan.steepest_v_per_m * 1e-3,
        percent(chosen.linearity),
        plan.centre_slope_v_per_m.abs() * 1e-3
    );
    text += &format!(
        "  turn_below_peak_v = {}   # three tenths of it\n",
        Short(set.vc0.value())
    );
    for (key, volts, why) in [
        (
            "delta1_mv",
            set.delta1,
            "what a stop at search speed is late by, and the noise",
        ),
        (
            "delta2_mv",
            set.delta2,
            "what a stop at a tenth of it is late by, and the noise",
        ),
        ("delta3_mv", set.delta3, "the same, by the slope sensor"),
        (
            "delta4_mv",
            set.delta4,
            "a tenth of the level, and how far the peak lies beside the zero",
        ),
        ("noise_mv", set.noise, "of one sample of the noisier sensor"),
    ] {
        text += &format!("  {key} = {}   # {why}\n", mv(volts));
    }
    text += &format!(
        "the peak sensor falls by {:.3} V in this sweep, {:.3} V more than claim 15 asks for; the nearest rail is \
         {:.3} V away\nby its noise alone the zero of one pass is uncertain by {:.1} nm (standard uncertainty)",
        plan.depth.value(),
        room.value(),
        chosen.rail_margin.value(),
        chosen.standard_uncertainty.nm()
    );
    let own = config.axis[&it.axis]
        .zero
        .as_ref()
        .map(|it| it.level_below_peak_v);
    text += &format!(", {}", compared(own, plan.given.as_ref()));
    text + "\na calibration made with another level belongs to another zero: calibrate after changing it"
}

/// What the level in the configuration comes to.
fn compared(own: Option<f64>, given: Option<&PlannedLevel>) -> String {
    let own = own.map_or(String::new(), |it| Short(it).to_string());
    match given {
        None => format!("with the configured {own} V there is no zero in this sweep"),
        Some(it) => format!(
            "with the configured {own} V by {:.1} nm{}",
            it.standard_uncertainty.nm(),
            match it.fits {
                true => String::new(),
                false => format!(
                    ", which lies on a flat part: {} of the steepest slope, {} of that at the zero",
                    percent(it.steepness),
                    percent(it.linearity)
                ),
            }
        ),
    }
}

fn value(it: &ZeroPlanned) -> Value {
    let set = &it.plan.settings;
    json!({
        "axis": it.axis,
        "sweep": it.sweep,
        "passes": it.passes,
        "zero": {
            "level_below_peak_v": set.vc.value(),
            "turn_below_peak_v": set.vc0.value(),
            "delta1_mv": mv(set.delta1).0,
            "delta2_mv": mv(set.delta2).0,
            "delta3_mv": mv(set.delta3).0,
            "delta4_mv": mv(set.delta4).0,
            "noise_mv": mv(set.noise).0,
        },
        "depth_v": it.plan.depth.value(),
        "steepest_v_per_mm": it.plan.steepest_v_per_m * 1e-3,
        "centre_slope_v_per_mm": it.plan.centre_slope_v_per_m * 1e-3,
        "proposed": level(&it.plan.chosen),
        "configured": it.plan.given.as_ref().map(level),
        "levels": it.plan.levels.iter().map(level).collect::<Vec<_>>(),
    })
}

fn level(it: &PlannedLevel) -> Value {
    json!({
        "level_below_peak_v": it.vc.value(),
        "flanks_mm": it.flanks.map(|it| it.mm()),
        "steepness": it.steepness,
        "linearity": it.linearity,
        "rail_margin_v": it.rail_margin.value(),
        "standard_uncertainty_um": to_json::um(it.standard_uncertainty),
        "fits": it.fits,
    })
}
