//! Runs by what was measured or designed elsewhere: nothing moves, and no axis is switched on.

use std::path::Path;

use service::{AxisState, Code, GivenFile, RunKind, RunRequest, RunState, RunView};

use super::memories::with_references;
use super::questions::{few_placements, stage_read_by};
use super::{Bed, SEED, anna, each, each_here};
use crate::client::PATIENCE;
use crate::stage::Stage;

impl Bed<'_> {
    fn by_files(&self, request: &RunRequest) -> RunView {
        let id = self.client.plan(&anna(), request);
        let run = id.and_then(|id| self.client.run(&id, PATIENCE));
        run.unwrap_or_else(|problem| panic!("{problem}"))
    }

    /// What a person reads of the plate after turning it by so many lines, in a file.
    fn placement(&self, offset: f64, turned: f64) -> GivenFile {
        let text = self.stage.simulation(move |machine| {
            machine.turn_plate(turned);
            let mut text = String::from("offset,pass,approach,line,angle_deg\n");
            for pass in ["1,+", "1,-", "2,+"] {
                for line in 0..24 {
                    let angle = machine.sight_line(line).angle.expect("it has a microscope");
                    let angle = angle.degrees().rem_euclid(360.0);
                    text += &format!("{offset},{pass},{line},{angle:.9}\n");
                }
            }
            text
        });
        GivenFile {
            name: format!("at-{offset}.csv"),
            text,
        }
    }
}

fn of_files(kind: RunKind, files: Vec<GivenFile>) -> RunRequest {
    RunRequest {
        files,
        ..RunRequest::of(kind, None)
    }
}

#[test]
fn a_plate_read_elsewhere_calibrates_the_table_placement_by_placement_and_nothing_moves() {
    let new = |rig, folder: &Path| stage_read_by("angle", rig, folder);
    each(new, |bed| {
        // Nothing is zeroed, and nothing has to be.
        let wrong = bed.placement(5.0, 0.0);
        let refused = bed.by_files(&of_files(RunKind::Calibrate, vec![wrong]));
        assert_eq!(refused.state, RunState::Failed, "{refused:?}");
        let cause = refused.cause.clone().expect("it says why").cause;
        assert!(cause.contains("at-5.csv:2:1: `offset` is 5"), "{cause}");
        assert!(!refused.can_resume, "{refused:?}");
        let by_driving = bed.client.resume(&anna(), &refused.id).unwrap_err();
        assert_eq!(by_driving.code, Code::RunState, "{by_driving}");

        let mut lies_at = 0.0;
        let first = bed.placement(0.0, 0.0);
        let mut run = bed.by_files(&of_files(RunKind::Calibrate, vec![first]));
        while run.result["calibration"].is_null() {
            assert_eq!(run.state, RunState::Done, "{run:?}");
            assert!(run.stored.is_empty(), "{run:?}");
            let due = run.result["due_offset"].as_f64().expect("an offset");
            let journal = run.result["journal"].as_str().map(Path::new);
            let journal = journal.and_then(Path::file_stem).expect("it is kept");
            let next = RunRequest {
                resume: Some(journal.to_string_lossy().into_owned()),
                ..of_files(RunKind::Calibrate, vec![bed.placement(due, due - lies_at)])
            };
            lies_at = due;
            run = bed.by_files(&next);
        }
        let axis = bed.client.axis("c").unwrap();
        assert_eq!(run.result["calibration"], axis.calibration.unwrap());
        assert_eq!((axis.state, axis.homed), (AxisState::Disabled, false));

        let between = bed.placement(12.5, 12.5 - lies_at);
        let verified = bed.by_files(&of_files(RunKind::Verify, vec![between]));
        assert_eq!(verified.state, RunState::Done, "{verified:?}");
        assert_eq!(verified.result["within_tolerance"], true, "{verified:?}");
        are_refused(bed);
    });
}

fn are_refused(bed: &Bed<'_>) {
    let file = |name: &str| GivenFile {
        name: name.into(),
        text: "offset\n".into(),
    };
    let refused = |request: &RunRequest, words: &str| {
        let problem = bed.client.plan(&anna(), request).unwrap_err();
        assert!(problem.to_string().contains(words), "{problem}");
    };
    refused(
        &of_files(RunKind::Zero, vec![file("a.csv")]),
        "c measures itself for a run of this kind",
    );
    refused(&of_files(RunKind::Verify, vec![file("a\nb")]), "a\\nb");
    let both = RunRequest {
        verify: true,
        ..of_files(RunKind::Calibrate, vec![file("a.csv")])
    };
    refused(&both, "a verification has files of its own");
    let unknown = RunRequest {
        resume: Some("nothing".into()),
        ..of_files(RunKind::Verify, vec![file("a.csv")])
    };
    refused(&unknown, "there is no journal nothing");
    let without = RunRequest {
        resume: Some("nothing".into()),
        ..RunRequest::of(RunKind::Verify, None)
    };
    refused(&without, "`resume` is for runs of the kind `job`");
}

#[test]
fn a_table_that_a_detector_reads_takes_no_files() {
    let new = |rig, folder: &Path| Stage::new(rig, (tests::ROTARY, SEED), folder, few_placements);
    each_here(new, |bed| {
        let file = GivenFile {
            name: "a.csv".into(),
            text: String::new(),
        };
        let request = of_files(RunKind::Calibrate, vec![file]);
        let refused = bed.client.plan(&anna(), &request);
        let refused = refused.unwrap_err();
        assert_eq!(refused.code, Code::Configuration, "{refused}");
        assert!(
            refused.to_string().contains("c measures itself"),
            "{refused}"
        );
    });
}

#[test]
fn a_designed_shape_is_kept_as_the_first_memory_and_no_other_run_of_three_axes_takes_files() {
    with_references(|bed: &Bed<'_>| {
        let shape = |last: &str| GivenFile {
            name: "shape.csv".into(),
            text: format!(
                "axis,along,position_mm,displacement_um\nx,y,0,0\nx,y,60,2.5\nx,y,120,{last}\n"
            ),
        };
        let run = bed.by_files(&of_files(RunKind::FirstMemory, vec![shape("0")]));
        assert_eq!(run.state, RunState::Done, "{run:?}");
        let used = bed.client.calibrations().into_iter();
        let mut used = used.filter(|it| it.active && it.axis == "volume-first-memory");
        let used = used.next().expect("it is in use").id;
        assert_eq!(run.result["memory"], used);
        assert_eq!(bed.client.axis("x").unwrap().state, AxisState::Disabled);

        let wrong = bed.by_files(&of_files(RunKind::FirstMemory, vec![shape("3000")]));
        let cause = wrong.cause.expect("it says why").cause;
        assert!(
            cause.contains("shape.csv:4: a displacement of 3000 um"),
            "{cause}"
        );
        for (kind, words) in [
            (RunKind::SecondMemory, "that a first part was made in"),
            (RunKind::Reference, "what the machine's detectors see"),
            (RunKind::Calibrate, "volume measures itself"),
        ] {
            let request = of_files(kind, vec![shape("0")]);
            let refused = bed.client.plan(&anna(), &request).unwrap_err();
            assert!(refused.to_string().contains(words), "{refused}");
        }
        let two = of_files(RunKind::FirstMemory, vec![shape("0"), shape("0")]);
        let refused = bed.client.plan(&anna(), &two).unwrap_err();
        assert!(refused.to_string().contains("2 files"), "{refused}");
    });
}
