//! The alignment platform: index pulses, one model a screw by the camera, poses, alignment.

use std::path::{Path, PathBuf};

use machine::records::read_journal;
use serde_json::json;
use units::{Metres, Radians};

use crate::Failure;
use crate::emulated::HallDrift;
use crate::platform::Pose;
use crate::platform::calibrate::PlatformCalibrated;
use crate::platform::verify::{Aligned, PlatformVerified};
use crate::platform::zero::PlatformZeroed;
use crate::program::demo::stand::{
    Demo, DemoArgs, Show, Shown, Stand, power_cycle, shipped, took, write_page,
};
use crate::program::json as to_json;
use crate::program::made_from::made_from;
use crate::program::output::Output;
use crate::program::platform::report as page;
use crate::program::platform::report::PlatformPage;
use crate::program::platform::verbs::{
    calibrated_text, calibrated_value, verified_text, verified_value,
};
use machine::records::Store;

/// Everything the demonstration found.
struct Story {
    zeros: [PlatformZeroed; 2],
    found: PlatformVerified,
    calibrated: PlatformCalibrated,
    left: PlatformVerified,
    after: PlatformVerified,
    aligned: Aligned,
}

/// What can be shown.
pub(crate) const DEMOS: &[Demo] = &[
    Demo {
        name: "uvw",
        help: "An alignment platform on three screws, seen by an image controller",
        files: shipped!("uvw"),
        show: Show::OnStand(show),
    },
    Demo {
        name: "uvw-copley",
        help: "The same with amplifiers on a serial line in place of drives on CAN",
        files: shipped!("uvw-copley"),
        show: Show::OnStand(show),
    },
];

fn show(stand: &mut Stand, args: &DemoArgs, output: Output) -> Result<Shown, Failure> {
    let story = tell(stand, args, output)?;
    let report = write_report(&stand.store, &story)?;
    let wall = stand.started.elapsed();
    let bad = [&story.left, &story.after];
    let bad = bad.into_iter().find(|it| !it.is_within_tolerance());
    Ok(Shown {
        text: [
            String::new(),
            verified_text("as found", &story.found),
            String::new(),
            calibrated_text(&story.calibrated),
            String::new(),
            verified_text("as left", &story.left),
            verified_text("after a power cycle", &story.after),
            format!(
                "aligned by the image in {} moves: {:.3} µm off after the first, {:.3} µm then",
                story.aligned.moves,
                story.aligned.open_loop.um(),
                story.aligned.left.um()
            ),
            String::new(),
            format!("report       {}", report.display()),
            took(wall, stand.machine.now()),
        ]
        .join("\n"),
        value: json!({
            "as_found": verified_value(&story.found),
            "calibration": calibrated_value(&story.calibrated),
            "as_left": verified_value(&story.left),
            "as_left_after_power_cycle": verified_value(&story.after),
            "alignment": {
                "moves": story.aligned.moves,
                "open_loop_um": to_json::um(story.aligned.open_loop),
                "left_um": to_json::um(story.aligned.left),
            },
            "report": report,
            "wall_s": wall.as_secs_f64(),
        }),
        bad: bad.and_then(|it| it.out_of_tolerance()),
    })
}

fn tell(stand: &mut Stand, args: &DemoArgs, output: Output) -> Result<Story, Failure> {
    let Stand {
        machine,
        store,
        emulated,
        ..
    } = stand;
    machine.guarded(|machine| {
        output.note("1 start: identities, set-up, supervision");
        machine.start()?;
        output.note("2 zero: every screw on its index pulse, reached forward");
        let first = machine.platform()?.zero(store)?;
        output.note("3 as found: poses all over the work range, seen by the camera");
        let found = machine.platform()?.verify(store, false)?;
        machine.platform()?.move_to(Pose::default())?;
        output.note("4 calibrate: lead error, periodic error and lost motion of each screw");
        let calibrated = machine.platform()?.calibrate(store)?;
        output.note("5 as left: the same poses, compensated, open loop");
        let left = machine.platform()?.verify(store, true)?;
        output.note("6 power off and on; zero again, as left");
        power_cycle(machine, emulated, HallDrift::default())?;
        let second = machine.platform()?.zero(store)?;
        let after = machine.platform()?.verify(store, true)?;
        output.note("7 align: move until the image agrees");
        let aligned = machine.platform()?.align(somewhere(args.seed))?;
        machine.shut_down()?;
        Ok(Story {
            zeros: [first, second],
            found,
            calibrated,
            left,
            after,
            aligned,
        })
    })
}

fn write_report(store: &Store, story: &Story) -> Result<PathBuf, Failure> {
    let read = |path: &Path| read_journal(path).map_err(Failure::from);
    let found = read(&story.found.journal)?;
    let left = read(&story.left.journal)?;
    let after = read(&story.after.journal)?;
    let measured = read(&story.calibrated.journal)?;
    let zeros = [
        read(&story.zeros[0].journal)?,
        read(&story.zeros[1].journal)?,
    ];
    let calibrations = made_from(&story.calibrated.journal)?;
    let page = PlatformPage {
        title: format!("truestage: platform {}", left.header.machine),
        facts: page::head(&left, &[]),
        visits: vec![
            ("as found".into(), &found),
            ("as left".into(), &left),
            ("after a power cycle".into(), &after),
        ],
        calibrated: Some((&measured, calibrations)),
        zeros: zeros.iter().collect(),
    };
    write_page(store, &left.header, &page::render(&page))
}

/// Another pose for each seed.
fn somewhere(seed: u64) -> Pose {
    let place = |step: f64| ((seed as f64 * step).fract() - 0.5) * 2.0;
    Pose {
        x: Metres::from_mm(place(0.618)),
        y: Metres::from_mm(place(0.414)),
        angle: Radians::from_arcsec(900.0 * place(0.732)),
    }
}
