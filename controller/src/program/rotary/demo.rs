//! The rotary table: index mark, a plate in planned placements, one table error, moves.

use std::path::PathBuf;

use compensator::rotary::Design;
use machine::records::read_journal;
use serde_json::json;
use units::Radians;

use crate::Failure;
use crate::emulated::HallDrift;
use crate::program::demo::emulation::Emulation;
use crate::program::demo::stand::{
    Demo, DemoArgs, Show, Shown, Stand, power_cycle, shipped, took, write_page,
};
use crate::program::made_from::made_from;
use crate::program::output::Output;
use crate::program::rotary::report as page;
use crate::program::rotary::told::moved;
use crate::program::rotary::told::{
    calibrated_text, calibrated_value, verified_text, verified_value,
};
use crate::rotary::RotaryMoved;
use crate::rotary::Way;
use crate::rotary::{Operator, PlateTask, RotaryCalibrated, RotaryVerified};
use crate::run::CalibrateOptions;
use machine::records::Store;

const AXIS: &str = "c";
/// Two turns on and a little.
const SOMEWHERE_DEG: f64 = 770.123;

/// Everything the demonstration found.
struct Story {
    plan: Design,
    calibrated: RotaryCalibrated,
    left: RotaryVerified,
    after: RotaryVerified,
    moved: RotaryMoved,
}

/// The person who turns the plate, here the emulator's own hand.
struct Hand<'a> {
    emulated: &'a Emulation,
    lies_at: f64,
    output: Output,
}

impl Operator for Hand<'_> {
    fn ask(&mut self, task: &PlateTask) -> Result<(), Failure> {
        self.output.note(&format!("  > {}", task.text()));
        self.emulated.turn_plate(task.offset - self.lies_at)?;
        self.lies_at = task.offset;
        Ok(())
    }

    fn is_done(&mut self) -> Result<bool, Failure> {
        Ok(true)
    }
}

/// What can be shown.
pub(crate) const DEMOS: &[Demo] = &[Demo {
    name: "rotary",
    help: "A rotary table and a plate of lines, turned from placement to placement",
    files: shipped!("rotary"),
    show: Show::OnStand(show),
}];

fn show(stand: &mut Stand, _: &DemoArgs, output: Output) -> Result<Shown, Failure> {
    let story = tell(stand, output)?;
    let report = write_report(&stand.store, &story)?;
    let wall = stand.started.elapsed();
    let bad = [&story.left, &story.after];
    let bad = bad.into_iter().find_map(|it| it.out_of_tolerance(AXIS));
    let id = Some(story.calibrated.id.as_str());
    Ok(Shown {
        text: [
            String::new(),
            calibrated_text(&story.calibrated),
            String::new(),
            verified_text(&story.left),
            "after a power cycle:".to_owned(),
            verified_text(&story.after),
            String::new(),
            moved(AXIS, &story.moved, id).text,
            String::new(),
            format!("report       {}", report.display()),
            took(wall, stand.machine.now()),
        ]
        .join("\n"),
        value: json!({
            "offsets": story.plan.offsets(),
            "calibration": calibrated_value(&story.calibrated),
            "verified": verified_value(&story.left),
            "verified_after_power_cycle": verified_value(&story.after),
            "move": moved(AXIS, &story.moved, id).value,
            "report": report,
            "wall_s": wall.as_secs_f64(),
        }),
        bad,
    })
}

fn tell(stand: &mut Stand, output: Output) -> Result<Story, Failure> {
    let Stand {
        machine,
        store,
        emulated,
        ..
    } = stand;
    let mut hand = Hand {
        emulated,
        lies_at: 0.0,
        output,
    };
    machine.guarded(|machine| {
        output.note("1 start: identity, set-up, touch probe, supervision");
        machine.start()?;
        output.note("2 zero: the encoder's index mark");
        machine.rotary(AXIS)?.zero()?;
        output.note("3 plan: how to place a plate that is worse than the table");
        let plan = planned(machine, output)?;
        output.note("4 calibrate: every line in every placement, forward and reverse");
        let options = CalibrateOptions::default();
        let calibrated = machine
            .rotary(AXIS)?
            .calibrate(store, &options, &mut hand)?;
        output.note("5 as found and as left: the plate half a line beside all of these");
        let left = machine.rotary(AXIS)?.verify(store, true, &mut hand)?;
        output.note("6 power off and on; zero again, as left");
        power_cycle(machine, emulated, HallDrift::default())?;
        machine.rotary(AXIS)?.zero()?;
        let after = machine.rotary(AXIS)?.verify(store, true, &mut hand)?;
        output.note("7 move: two turns on, across the seam, compensated");
        let target = Radians::from_degrees(SOMEWHERE_DEG);
        let moved = machine.rotary(AXIS)?.move_to(target, Way::Turns)?;
        machine.shut_down()?;
        Ok(Story {
            plan,
            calibrated,
            left,
            after,
            moved,
        })
    })
}

/// One page: the calibration, and both verifications under it.
fn write_report(store: &Store, story: &Story) -> Result<PathBuf, Failure> {
    let measured = read_journal(&story.calibrated.journal)?;
    let (left, after) = (
        read_journal(&story.left.journal)?,
        read_journal(&story.after.journal)?,
    );
    let calibrations = made_from(&story.calibrated.journal)?;
    let later = [("", &left), (", after a power cycle", &after)];
    let html = page::render_with(&measured, &calibrations, &later);
    write_page(store, &left.header, &html)
}

fn planned(machine: &mut crate::Machine, output: Output) -> Result<Design, Failure> {
    let config = machine.rotary(AXIS)?.config().calibrate.as_ref();
    let config = config.ok_or_else(|| Failure::NotConfigured {
        axis: AXIS.to_owned(),
        section: "calibrate",
    })?;
    let plan = config.design()?;
    let pair = Design::new(plan.lines(), &[0, 1], f64::INFINITY);
    let pair = pair.map_or(f64::NAN, |it| it.rms_amplification());
    output.note(&format!(
        "  offsets {:?}: a table error is {:.2} times as uncertain as a reading; {pair:.2} times with \
         the patent's two placements",
        plan.offsets(),
        plan.rms_amplification(),
    ));
    Ok(plan)
}
