//! Rotary tables on the command line.

mod asked;
mod compare;
pub(crate) mod demo;
pub(crate) mod fit;
mod intended;
mod json;
mod printed;
pub(crate) mod readings;
mod report;
mod residuals;
#[cfg(test)]
mod stored_tests;
mod targets;
pub(crate) mod told;
mod uncertainty;
pub(crate) mod verbs;

use std::path::Path;

use compensator::rotary::Sighted;
use machine::records::{Log, read_journal};
use units::Radians;

use super::jogs::Jogs;
use super::made_from::made_from;
use super::show::Shown;
use super::verbs::Verbs;
use crate::Failure;
use crate::config::MachineConfig;
use crate::ports::Use;
use crate::rotary::placed::closure_noise;
use crate::rotary::{PlateLog, RotaryCalibrateConfig, RotaryContent};

/// From how many standard deviations on a plate has moved that only seems to.
const STILL: f64 = 4.0;

/// What it does for the verbs of the cycle.
pub(crate) const VERBS: Verbs = Verbs {
    has_the_axes: |_| false,
    notes,
    demos: demo::DEMOS,
    refuse: intended::refuse,
    intended: intended::intended,
    zero: verbs::zero,
    calibrate: verbs::calibrate,
    verify: verbs::verify,
    move_to: verbs::move_to,
    jog: Jogs {
        check: verbs::check_jog,
        run: verbs::jog,
        purpose: Use::Motion,
        zeroed: None,
        by: "its encoder",
        end: ("where its drive counts no further", "at_last_count"),
    },
    motion: targets::motion,
    asked: asked::ASKED,
    words: &told::TELLER,
    printed: printed::printed,
    shown: &[Shown::of::<RotaryContent>()],
    opened_by: PlateLog::OPENED_BY,
    page: html,
    compare: compare::compared,
};

/// What a person who reads the plate has before him.
fn notes(config: &MachineConfig) -> Vec<String> {
    let read_by_people = config.rotary.iter().filter_map(|(name, it)| {
        let (sighting, run) = (it.sighting.as_ref()?, it.calibrate.as_ref()?);
        let placements = run.design().ok()?.offsets().len();
        let of_one = (2 * run.passes as usize + 1) * run.lines as usize;
        let first = format!(
            "axis {name}: a person reads plate {}: {of_one} readings in each of {placements} placements; \
             a file of one has the columns {}",
            run.plate,
            Sighted::from(sighting.value).header()
        );
        Some([Some(first), closure_note(name, run)])
    });
    read_by_people.flatten().flatten().collect()
}

/// That sound placements will be refused, where the limit is within the noise of the few lines that a person
/// reads.
fn closure_note(name: &str, run: &RotaryCalibrateConfig) -> Option<String> {
    let noise = Radians::from_arcsec(run.reading_noise_arcsec);
    let still = closure_noise(run.lines as usize, noise).arcsec();
    let times = run.closure_limit_arcsec / still;
    (times < STILL).then(|| {
        format!(
            "axis {name}: closure_limit_arcsec = {} is {times:.1} standard deviations of what the readings' \
             own noise makes of a plate that lies still, and sound placements will be refused now and then; \
             with {:.3} less than one in two thousand are",
            run.closure_limit_arcsec,
            STILL * still
        )
    })
}

/// The page of the journal at `path`, with what was made from it.
fn html(path: &Path) -> Result<String, Failure> {
    let journal = read_journal::<PlateLog>(path)?;
    let made = made_from::<RotaryContent>(path)?;
    Ok(report::render(&journal, &made))
}
