//! `truestage plan screw`: strokes that tell what a screw's errors are; and what `check` says of those in a file.

use clap::Args;
use compensator::screw::FitError;
use compensator::screw::plan::{REPETITIONS, StrokePlan, judge, patent_strokes, spread};
use serde_json::{Value, json};
use units::{Metres, Short};

use crate::Failure;
use crate::config::MachineConfig;
use crate::platform::PlatformCalibrateConfig;
use crate::platform::config::{ActuatorConfig, ScrewMethodName as ScrewMethod};
use crate::program::output::{Ended, Output};

/// What `truestage plan screw` is told.
#[derive(Debug, Args)]
pub(crate) struct PlanArgs {
    /// Travel per turn of the screw.
    #[arg(long, value_name = "MM")]
    lead_mm: f64,
    /// Spread the strokes from here; without it they are the three of the patent.
    #[arg(
        long,
        value_name = "MM",
        requires = "last_mm",
        allow_hyphen_values = true
    )]
    first_mm: Option<f64>,
    /// To here.
    #[arg(
        long,
        value_name = "MM",
        requires = "first_mm",
        allow_hyphen_values = true
    )]
    last_mm: Option<f64>,
    /// The highest harmonic of the lead that they have to show.
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(0..=32))]
    harmonics: u32,
    /// How often each, from both sides.
    #[arg(long, default_value_t = *REPETITIONS.start(), value_parser = clap::value_parser!(u32).range(1..=1000))]
    repetitions: u32,
}

pub(crate) fn run(args: &PlanArgs, output: Output) -> Ended {
    let lead = Metres::from_mm(args.lead_mm);
    let plan = match (args.first_mm, args.last_mm) {
        (Some(first), Some(last)) => {
            let ends = (Metres::from_mm(first), Metres::from_mm(last));
            spread(ends, lead, args.harmonics)
        }
        _ => judge(&patent_strokes(lead), lead, args.harmonics),
    };
    let plan = plan.map_err(|error| Failure::Usage {
        what: error.to_string(),
        help: "give a positive --lead-mm, and --first-mm below --last-mm with room for the strokes"
            .into(),
    })?;
    output.result(&plan_text(&plan, args), &plan_value(&plan, args))
}

fn step(plan: &StrokePlan) -> Metres {
    plan.strokes[1] - plan.strokes[0]
}

fn ends(plan: &StrokePlan) -> (Metres, Metres) {
    (plan.strokes[0], plan.strokes[plan.strokes.len() - 1])
}

fn plan_text(plan: &StrokePlan, args: &PlanArgs) -> String {
    let (first, last) = ends(plan);
    let mut text = format!(
        "{} strokes, each {} times from both sides; for [platform.calibrate]:\n  first_mm = {}\n  \
         last_mm = {}\n  step_mm = {}\n  runs = {}\n{} degree(s) of freedom for the slope; a screw \
         with errors of its own of 1 µm at each stroke leaves it uncertain by {:.4} µm/mm",
        plan.strokes.len(),
        args.repetitions,
        Short(first.mm()),
        Short(last.mm()),
        Short(step(plan).mm()),
        args.repetitions,
        plan.degrees_of_freedom,
        plan.slope_per_stroke_error * 1e-3,
    );
    text += &unobservable_text(plan);
    for it in &plan.leaks {
        text += &format!(
            "\n  1 µm of harmonic {}, left out of the model, shifts the slope by up to {:.4} µm/mm",
            it.number,
            it.slope_per_amplitude * 1e-3
        );
    }
    if args.first_mm.is_none() && !plan.unobservable.is_empty() {
        text += "\nthese are the patent's strokes; with --first-mm and --last-mm they are spread so \
                 that slope and periodic error can be told apart";
    }
    if !REPETITIONS.contains(&args.repetitions) {
        text += &format!("\n{}", repetitions_text(args.repetitions));
    }
    text
}

fn unobservable_text(plan: &StrokePlan) -> String {
    if plan.unobservable.is_empty() {
        return String::new();
    }
    format!("\nnot observable: harmonics {:?}", plan.unobservable)
}

fn repetitions_text(seen: u32) -> String {
    format!(
        "each stroke {seen} time(s): the patent asks for {} to {}",
        REPETITIONS.start(),
        REPETITIONS.end()
    )
}

fn plan_value(plan: &StrokePlan, args: &PlanArgs) -> Value {
    let (first, last) = ends(plan);
    let strokes: Vec<f64> = plan.strokes.iter().map(|it| it.mm()).collect();
    let leaks = plan.leaks.iter().map(|it| {
        json!({
            "harmonic": it.number,
            "slope_um_per_mm_per_um": it.slope_per_amplitude * 1e-3,
        })
    });
    json!({
        "lead_mm": args.lead_mm,
        "first_mm": first.mm(),
        "last_mm": last.mm(),
        "step_mm": step(plan).mm(),
        "runs": args.repetitions,
        "strokes_mm": strokes,
        "degrees_of_freedom": plan.degrees_of_freedom,
        "slope_um_per_mm_per_um_stroke_error": plan.slope_per_stroke_error * 1e-3,
        "harmonics_observable": plan.observable,
        "harmonics_not_observable": plan.unobservable,
        "harmonics_left_out_shift_slope": leaks.collect::<Vec<_>>(),
    })
}

/// What is doubtful in the strokes that a platform is calibrated with.
pub(crate) fn notes(config: &MachineConfig) -> Vec<String> {
    let platform = config.platform.as_ref();
    let Some((platform, run)) = platform.and_then(|it| Some((it, it.calibrate.as_ref()?))) else {
        return Vec::new();
    };
    let mut notes = Vec::new();
    if run.method == ScrewMethod::Patent && !REPETITIONS.contains(&run.runs) {
        let doubt = repetitions_text(run.runs);
        notes.push(format!("platform.calibrate.runs: warning: {doubt}"));
    }
    let doubts = platform.actuator.iter().filter_map(|it| {
        let doubt = doubt(it, run)?;
        let axis = &it.axis;
        Some(format!("platform.calibrate, axis {axis}: warning: {doubt}"))
    });
    notes.extend(doubts);
    notes
}

fn doubt(actuator: &ActuatorConfig, run: &PlatformCalibrateConfig) -> Option<String> {
    let lead = Metres::from_mm(actuator.lead_mm);
    let strokes = run.strokes_of(actuator).targets();
    let doubt = match run.method {
        ScrewMethod::Patent => doubt_of_means(&strokes, lead),
        ScrewMethod::LeastSquares => doubt_of_least_squares(&strokes, lead, run.harmonics_max),
    };
    doubt.unwrap_or_else(|error| Some(error.to_string()))
}

/// The patent's slope is that of its two ends, and a periodic error that differs between them is part of it.
fn doubt_of_means(strokes: &[Metres], lead: Metres) -> Result<Option<String>, FitError> {
    let [.., last] = strokes else {
        return Err(FitError::OneStroke);
    };
    let own = judge(&[strokes[0], *last], lead, 1)?.leaks[0];
    let wanted = patent_strokes(lead);
    let of_text = judge(&wanted, lead, 1)?.leaks[0];
    let worse = own.slope_per_amplitude > of_text.slope_per_amplitude * (1.0 + 1e-6);
    Ok(worse.then(|| {
        format!(
            "1 µm of periodic error shifts the slope between these strokes by up to {:.3} µm/mm, more \
             than with the patent's for a lead of {} mm, {} (`truestage plan screw`)",
            own.slope_per_amplitude * 1e-3,
            Short(lead.mm()),
            wanted.map(|it| Short(it.mm()).to_string()).join(", "),
        )
    }))
}

fn doubt_of_least_squares(
    strokes: &[Metres],
    lead: Metres,
    harmonics_max: u32,
) -> Result<Option<String>, FitError> {
    let plan = judge(strokes, lead, harmonics_max)?;
    let few = plan.degrees_of_freedom < FEW;
    if plan.unobservable.is_empty() && !few {
        return Ok(None);
    }
    let mut doubt = format!(
        "{} strokes at a lead of {} mm",
        plan.strokes.len(),
        Short(lead.mm())
    );
    if !plan.unobservable.is_empty() {
        doubt += &format!(" cannot show the harmonics {:?}", plan.unobservable);
    }
    if few {
        doubt += &format!(
            "{} leave {} degree(s) of freedom for the slope",
            if plan.unobservable.is_empty() {
                ""
            } else {
                ", and"
            },
            plan.degrees_of_freedom
        );
    }
    Ok(Some(
        doubt + "; `truestage plan screw` proposes strokes that do",
    ))
}

/// With fewer degrees of freedom no harmonic of a real screw stands out, and the slope's uncertainty is widened
/// by two fifths and more.
const FEW: usize = 4;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config;

    const UVW: &str = include_str!("../../../../configs/machines/uvw.toml");

    #[track_caller]
    fn check(edits: &[(&str, &str)], expected: &[&str]) {
        let mut text = UVW.to_owned();
        for (from, to) in edits {
            assert!(text.contains(from), "{from}");
            text = text.replace(from, to);
        }
        let notes = notes(&config::parse(&text, "m.toml").unwrap().config);
        assert_eq!(notes.is_empty(), expected.is_empty(), "{notes:?}");
        for part in expected {
            assert!(
                notes.iter().any(|it| it.contains(part)),
                "{part}: {notes:?}"
            );
        }
    }

    #[test]
    fn strokes_of_its_own_are_judged_for_the_screw_that_has_them() {
        let w = "point_mm = [0.0, -80.0]\ndirection = [0.0, 1.0]\nlead_mm = 2.0\nindex_mm = -4.0\n";
        let own = |step: &str| {
            let ends = "first_mm = -2.0\nlast_mm = 2.0";
            format!("{w}[platform.actuator.strokes]\n{ends}\nstep_mm = {step}\n")
        };
        check(&[(w, &own("0.23"))], &[]);
        check(
            &[(w, &own("0.5"))],
            &["axis w: warning: 9 strokes at a lead of 2 mm cannot show the harmonics [2, 3]"],
        );
    }

    #[test]
    fn strokes_are_judged_against_lead_and_method_and_good_ones_are_not_blamed() {
        let patent = ("method = \"least_squares\"", "method = \"patent\"");
        let ends = [
            ("first_mm = -2.5", "first_mm = 0.5"),
            ("last_mm = 2.5", "last_mm = 1.5"),
            ("step_mm = 0.25", "step_mm = 0.5"),
        ];
        check(&[], &[]);
        check(
            &[
                ("step_mm = 0.25", "step_mm = 0.23"),
                ("harmonics_max = 3", "harmonics_max = 4"),
            ],
            &[],
        );
        check(
            &[("harmonics_max = 3", "harmonics_max = 4")],
            &["axis u: warning: 21 strokes at a lead of 2 mm cannot show the harmonics [4]"],
        );
        check(&[("step_mm = 0.25", "step_mm = 0.8")], &["leave"]);
        check(&[patent, ("runs = 2", "runs = 10")], &[]);
        check(
            &[patent],
            &["runs: warning: each stroke 2 time(s): the patent asks for 10 to 30"],
        );
        check(&[patent, ("runs = 2", "runs = 31")], &["31 time(s)"]);
        check(
            &[patent, ("runs = 2", "runs = 20"), ends[0], ends[1], ends[2]],
            &[],
        );
        check(
            &[
                patent,
                ("runs = 2", "runs = 20"),
                ends[0],
                ("last_mm = 2.5", "last_mm = 1.25"),
                ends[2],
            ],
            &["than with the patent's for a lead of 2 mm, 0.5, 1, 1.5"],
        );
    }
}
