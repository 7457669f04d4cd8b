//! Runs that ask a person: a rotary table, whose plate somebody turns.

use core::time::Duration;

use mock_bus::fault::Fault;
use service::{
    AnswerRequest, AxisState, Code, IfMoving, MotionState, MoveRequest, QuestionView, RunKind,
    RunRequest, RunState, RunView, StopMode,
};
use tests::{Edit, ROTARY, Rig, Shipped, with_few_lines};
use units::Radians;

use super::{Bed, SEED, anna, bert, each};
use crate::client::PATIENCE;
use crate::stage::Stage;

/// Time passes freely between two looks at a run: whoever looks oftener is one who asks too often.
const LOOK_EVERY: Duration = Duration::from_millis(5);

/// Three placements are few; how good the table becomes is asked elsewhere.
pub(super) fn few_placements(text: String) -> String {
    text.edit("placements = 4 ", "offsets = [0, 73, 162] ")
        .edit("optimise = ", "# ")
        .edit("amplification_limit = 3.0", "amplification_limit = 5.0")
}

fn with_table(body: impl Fn(&Bed<'_>)) {
    let new =
        |rig, folder: &std::path::Path| Stage::new(rig, (ROTARY, SEED), folder, few_placements);
    each(new, |bed| {
        bed.client.zero(&anna(), Some("c"));
        body(bed);
    });
}

/// Somebody who turns the plate, and remembers where it lies.
pub(super) struct Hand<'b> {
    bed: &'b Bed<'b>,
    lies_at: f64,
}

impl<'b> Hand<'b> {
    pub(super) const fn new(bed: &'b Bed<'b>) -> Self {
        Self { bed, lies_at: 0.0 }
    }

    /// Does what is asked, and says so.
    pub(super) fn does(&mut self, id: &str, question: &QuestionView) {
        for word in ["not a safe stop", "switched on"] {
            assert!(question.safety.contains(word), "{question:?}");
        }
        let offset = question.task["offset"].as_f64().expect("an offset");
        let lines = offset - self.lies_at;
        self.lies_at = offset;
        self.bed
            .stage
            .simulation(move |machine| machine.turn_plate(lines));
        self.bed.answer(id, question.number, "done").unwrap();
    }

    /// Does all that the run `id` asks; how that ends.
    pub(super) fn does_all(&mut self, id: &str) -> RunView {
        loop {
            match self.bed.asks_or_ends(id) {
                RunView {
                    question: Some(question),
                    ..
                } => self.does(id, &question),
                ended => return ended,
            }
        }
    }
}

impl Bed<'_> {
    pub(super) fn run_of(&self, kind: RunKind) -> String {
        let id = self.client.plan(&anna(), &RunRequest::of(kind, None));
        id.unwrap_or_else(|problem| panic!("{problem}"))
    }

    pub(super) fn answer(
        &self,
        id: &str,
        question: u32,
        answer: &str,
    ) -> Result<(), service::Problem> {
        let answer = AnswerRequest {
            question,
            answer: answer.to_owned(),
        };
        self.client.answer(&anna(), id, &answer)
    }

    /// The run `id` when it asks something or has ended.
    pub(super) fn asks_or_ends(&self, id: &str) -> RunView {
        for _ in 0..10_000 {
            let run = self.client.run(id, LOOK_EVERY).expect("it was planned");
            if run.question.is_some() || run.state.is_end() || run.state == RunState::Paused {
                return run;
            }
        }
        panic!(
            "it neither asks nor ends: {:?}",
            self.client.run(id, Duration::ZERO)
        )
    }

    /// What the run `id` asks next.
    pub(super) fn asked(&self, id: &str) -> QuestionView {
        let run = self.asks_or_ends(id);
        run.question.unwrap_or_else(|| panic!("{:?}", run.cause))
    }
}

#[test]
fn a_person_is_asked_by_number_and_the_run_goes_on_with_his_answer() {
    with_table(|bed| {
        let plan = RunRequest {
            start: false,
            ..RunRequest::of(RunKind::Calibrate, Some("c"))
        };
        let id = bed.client.plan(&anna(), &plan).unwrap();
        let planned = bed.client.run(&id, Duration::ZERO).unwrap();
        let asks = &planned.plan.asks;
        assert_eq!(asks.len(), 3, "{asks:?}");
        assert!(asks[1].contains("placement 2 of 3") && asks[1].contains("by 73 lines"));
        assert_eq!(planned.plan.points, 3 * 3 * 360);
        let early = bed.answer(&id, 1, "done").unwrap_err();
        assert_eq!(early.code, Code::NotAsked, "{early}");
        bed.client.start(&anna(), &id).unwrap();

        let first = bed.asked(&id);
        assert_eq!((first.number, first.what.as_str()), (1, "turn_plate"));
        assert_eq!(first.text, asks[0]);
        assert_eq!(
            (first.answers.as_slice(), first.takes_text),
            (&["done".to_owned()][..], false)
        );
        // Nobody has his hands in a table that is under power.
        let axis = bed.client.axis("c").unwrap();
        assert_eq!(axis.encoder.as_ref().unwrap().unit, "deg");
        assert!(axis.soft_min.is_none());
        let events = bed.client.events(0);
        let asked = events.iter().find(|it| it.kind == "question");
        assert_eq!(asked.expect("it is told").data["number"], 1);

        let other = bed.answer(&id, 7, "done").unwrap_err();
        assert_eq!(other.code, Code::NotAsked);
        assert!(other.to_string().contains("`question` = 7"), "{other}");
        let unknown = bed.answer(&id, 1, "maybe").unwrap_err();
        assert_eq!(unknown.code, Code::NotAsked);
        assert!(unknown.to_string().contains("`answer`") && unknown.to_string().contains("done"));
        let waits = bed.client.run(&id, Duration::ZERO).unwrap();
        assert_eq!(
            waits.question.as_ref(),
            Some(&first),
            "nothing was answered"
        );

        let mut hand = Hand::new(bed);
        hand.does(&id, &first);
        // Whoever did not hear that it was taken says it again; another answer comes too late.
        bed.answer(&id, 1, "done").unwrap();
        let made = hand.does_all(&id);
        assert_eq!(made.state, RunState::Done, "{made:?}");
        let axis = bed.client.axis("c").unwrap();
        assert_eq!(made.result["calibration"], axis.calibration.unwrap());
        assert!(axis.corrected, "its place is corrected from now on");

        let id = bed.run_of(RunKind::Verify);
        let judged = hand.does_all(&id);
        assert_eq!(judged.state, RunState::Done, "{judged:?}");
        assert_eq!(judged.result["within_tolerance"], true, "{judged:?}");
        assert_eq!(judged.out_of_tolerance, None);
        // What its kind does not have is said.
        let none = bed
            .client
            .plan(&anna(), &RunRequest::of(RunKind::Reference, None));
        let none = none.unwrap_err();
        assert_eq!(none.code, Code::NotOffered);
        assert!(
            none.to_string().contains("zero, calibrate, verify"),
            "{none}"
        );
    });
}

#[test]
fn the_axis_is_off_while_somebody_is_asked_and_a_stop_by_anybody_ends_that() {
    with_table(|bed| {
        for mode in [StopMode::Controlled, StopMode::Quick] {
            let id = bed.run_of(RunKind::Calibrate);
            let question = bed.asked(&id);
            bed.let_time_pass(0.2);
            let axis = bed.client.axis("c").unwrap();
            assert_eq!(
                (axis.state, axis.used_by.as_deref()),
                (AxisState::Disabled, Some(&*id))
            );
            bed.client.stop(&bert(), mode).unwrap();
            let run = bed.client.run(&id, PATIENCE).unwrap();
            assert_eq!(run.state, RunState::Stopped, "{run:?}");
            assert_eq!(run.stopped.as_ref().unwrap().by, "bert");
            assert_eq!(run.question, None);
            let late = bed.answer(&id, question.number, "done").unwrap_err();
            assert_eq!(late.code, Code::NotAsked, "{late}");
            let axis = bed.client.axis("c").unwrap();
            assert_eq!((axis.state, axis.homed), (AxisState::Disabled, true));
        }
        let id = bed.run_of(RunKind::Calibrate);
        bed.asked(&id);
        bed.client.abort(&bert(), &id).unwrap();
        let run = bed.client.run(&id, PATIENCE).unwrap();
        assert_eq!(run.state, RunState::Stopped, "{run:?}");
        // The machine is as it was.
        bed.client.zero(&anna(), None);
    });
}

#[test]
fn nothing_is_moved_or_switched_on_while_hands_are_in_the_machine() {
    with_table(|bed| {
        let queued = MoveRequest {
            if_moving: IfMoving::Queue,
            uncompensated: true,
            ..MoveRequest::of("c", Radians::from_degrees(10.0))
        };
        // Both come in before the run has switched its table off.
        bed.stage.gate.limit(Duration::from_millis(2));
        let id = bed.run_of(RunKind::Calibrate);
        // It waits for the end of the run, which is not while somebody is asked.
        let waits = bed.begin(&queued);
        bed.stage.gate.lift_limit();
        let question = bed.asked(&id);
        let stopped = bed.ended(&waits);
        assert_eq!(stopped.state, MotionState::Stopped, "{stopped:?}");
        let by = stopped.stopped.expect("it says who").by;
        assert!(by.contains(&id) && by.contains("hands"), "{by}");

        let asked = format!("run {id} asks for something that is done by hand (question 1)");
        let refused = bed.refused(&queued, Code::AxisBusy);
        assert!(refused.to_string().contains(&asked), "{refused}");
        let refused = bed.client.power(&anna(), "c", true).unwrap_err();
        assert!(refused.to_string().contains(&asked), "{refused}");

        Hand::new(bed).does(&id, &question);
        // The table is switched on again, and its plate is read.
        bed.let_time_pass(0.5);
        let waits = bed.begin(&queued);
        bed.client.stop(&bert(), StopMode::Controlled).unwrap();
        assert_eq!(bed.ended(&waits).state, MotionState::Stopped);
    });
}

/// The drive of a second axis, which has no mechanics.
const SECOND_DRIVE: &str = r#"
[[nodes]]
name = "second"
port = "can0"
[nodes.device]
kind = "cia402_drive"
node_id = 3
axis = 1
identity = { vendor_id = 0x7FF, product_code = 0x42_0002, revision = 0x1_0000, serial_number = 3003 }
boot_delay_ms = 100
heartbeat_ms = 0
quick_stop_option = 6
abort_connection_option = 3
"#;

/// The table `c`, and an axis `d` on the same bus.
fn with_a_second_axis(body: impl Fn(&Bed<'_>)) {
    let part = |text: &str, from: &str, to: &str| {
        let begin = text.find(from).expect("it is there");
        let end = text[begin..].find(to).expect("it is there");
        text[begin..begin + end].to_owned()
    };
    let emulated = ROTARY.emulated;
    let rotary = part(
        emulated,
        "[nodes.device.rotary]",
        "[nodes.device.touch_probe]",
    );
    let emulated = [emulated, SECOND_DRIVE, &rotary].concat();
    let shipped = Shipped {
        emulated: Box::leak(emulated.into_boxed_str()),
        ..ROTARY
    };
    let new = move |rig, folder: &std::path::Path| {
        Stage::new(rig, (shipped, SEED), folder, |text| {
            let second = part(&text, "[rotary.c]", "[rotary.c.zero]")
                .edit("[rotary.c]", "[rotary.d]")
                .edit("[rotary.c.identity]", "[rotary.d.identity]")
                .edit("node_id = 1", "node_id = 3");
            few_placements(text) + "\n" + &second
        })
    };
    each(new, |bed| {
        bed.client.zero(&anna(), Some("c"));
        body(bed);
    });
}

#[test]
fn other_axes_are_switched_off_before_somebody_is_asked_and_stay_so_until_he_has_answered() {
    with_a_second_axis(|bed| {
        bed.client.power(&anna(), "d", true).unwrap();
        assert_eq!(bed.client.axis("d").unwrap().state, AxisState::Standstill);
        let calibrate = RunRequest::of(RunKind::Calibrate, Some("c"));
        let id = bed.client.plan(&anna(), &calibrate).unwrap();
        let question = bed.asked(&id);
        assert_eq!(bed.client.axis("d").unwrap().state, AxisState::Disabled);
        let refused = bed.client.power(&anna(), "d", true).unwrap_err();
        assert_eq!(refused.code, Code::AxisBusy);
        let said = refused.to_string();
        assert!(said.contains(&id) && said.contains("question 1"), "{said}");
        bed.client.power(&anna(), "d", false).unwrap();
        Hand::new(bed).does(&id, &question);
        assert_eq!(bed.client.axis("d").unwrap().state, AxisState::Disabled);
        bed.client.power(&anna(), "d", true).unwrap();
        bed.client.abort(&anna(), &id).unwrap();
    });
}

#[test]
fn a_run_that_waits_for_a_person_is_paused_and_goes_on_with_the_placements_that_are_read() {
    with_table(|bed| {
        let id = bed.run_of(RunKind::Calibrate);
        let mut hand = Hand::new(bed);
        let first = bed.asked(&id);
        hand.does(&id, &first);
        let second = bed.asked(&id);
        assert_eq!(second.number, 2);
        bed.client.pause(&bert(), &id).unwrap();
        let paused = bed.paused(&id);
        assert_eq!(paused.question, None);
        assert!(paused.journal.is_some());
        bed.client.resume(&anna(), &id).unwrap();
        let again = bed.asked(&id);
        assert_eq!(again.number, 3, "no number is used twice");
        assert_eq!(again.task["offset"], second.task["offset"]);
        hand.does(&id, &again);
        let made = hand.does_all(&id);
        assert_eq!(made.state, RunState::Done, "{made:?}");
        // A verification by the detector is one placement: it cannot go on.
        let id = bed.run_of(RunKind::Verify);
        bed.asked(&id);
        let refused = bed.client.pause(&bert(), &id).unwrap_err();
        assert_eq!(refused.code, Code::RunState, "{refused}");
        bed.client.abort(&bert(), &id).unwrap();
    });
}

#[test]
fn the_axis_stays_supervised_while_somebody_is_asked() {
    with_table(|bed| {
        let id = bed.run_of(RunKind::Calibrate);
        let question = bed.asked(&id);
        let fault = bed.stage.inject(Fault::StopHeartbeat {
            node: "drive".to_owned(),
        });
        let run = bed.client.run(&id, PATIENCE).unwrap();
        assert_eq!(run.state, RunState::Failed, "{run:?}");
        assert_eq!(run.question, None);
        assert!(bed.stage.deliveries(fault) > 0);
        let late = bed.answer(&id, question.number, "done").unwrap_err();
        assert_eq!(late.code, Code::NotAsked, "{late}");
        assert_eq!(bed.client.axis("c").unwrap().state, AxisState::ErrorStop);
    });
}

/// A plate of few lines on a table that these can see, which a person reads.
pub(crate) fn stage_with_a_reader(rig: Rig, folder: &std::path::Path) -> Stage {
    stage_read_by("to_line", rig, folder)
}

/// The same, of which he reads that.
pub(super) fn stage_read_by(value: &str, rig: Rig, folder: &std::path::Path) -> Stage {
    let emulated = with_few_lines(ROTARY.emulated)
        .edit("lines = 72", "lines = 24")
        .edit("    { order = 18, amplitude_arcsec = 0.3 },\n", "");
    let shipped = Shipped {
        emulated: Box::leak(emulated.into_boxed_str()),
        ..ROTARY
    };
    Stage::new(rig, (shipped, SEED), folder, |text| {
        let detector =
            "[rotary.c.line_detector]       # at the drive's touch probe 1\nedge = \"positive\"";
        let sighting = format!("[rotary.c.sighting]\nvalue = {value:?}\nrange_arcsec = 200.0");
        text.edit(detector, &sighting)
            .edit("lines = 360", "lines = 24")
            .edit("offset_lines = 200.5", "offset_lines = 12.5")
            .edit("closure_limit_arcsec = 0.1 ", "closure_limit_arcsec = 5.0 ")
    })
}

fn with_a_reader(body: impl Fn(&Bed<'_>)) {
    each(stage_with_a_reader, |bed| {
        bed.client.zero(&anna(), Some("c"));
        body(bed);
    });
}

/// A verification of the table without a calibration.
pub(super) fn as_found() -> RunRequest {
    RunRequest {
        uncompensated: true,
        ..RunRequest::of(RunKind::Verify, None)
    }
}

#[test]
fn what_a_person_reads_of_a_plate_is_answered_line_by_line_and_nothing_else_is_taken() {
    with_a_reader(|bed| {
        let verify = as_found();
        let id = bed.client.plan(&anna(), &verify).unwrap();
        let mut hand = Hand::new(bed);
        let mut lines = 0;
        let ended = loop {
            let run = bed.asks_or_ends(&id);
            let Some(question) = run.question else {
                break run;
            };
            let number = question.number;
            match question.what.as_str() {
                "turn_plate" => hand.does(&id, &question),
                "read_line" => {
                    let line = question.task["line"].as_u64().expect("a line");
                    let line = u32::try_from(line).expect("a plate has few");
                    if lines == 0 {
                        bed.answer(&id, number, "12 parsecs").unwrap();
                        let again = bed.asked(&id);
                        assert!(again.text.contains("not taken"), "{again:?}");
                        assert_eq!(again.number, number + 1);
                    }
                    let seen = bed
                        .stage
                        .simulation(move |machine| machine.sight_line(line));
                    let to_line = seen.to_line.map(|it| it.arcsec());
                    let answer = to_line.map_or("none".to_owned(), |it| format!("{it}arcsec"));
                    let number = bed.asked(&id).number;
                    bed.answer(&id, number, &answer).unwrap();
                    lines += 1;
                }
                "close_placement" => {
                    assert!(question.answers.contains(&"close".to_owned()));
                    bed.answer(&id, number, "close").unwrap();
                }
                other => panic!("{other}"),
            }
        };
        assert_eq!(ended.state, RunState::Done, "{ended:?}");
        assert_eq!(lines, 3 * 24);
        // Who reads stops when he likes, and goes on later.
        let id = bed.client.plan(&anna(), &verify).unwrap();
        hand.does(&id, &bed.asked(&id));
        let line = bed.asked(&id);
        bed.answer(&id, line.number, "stop").unwrap();
        let paused = bed.asks_or_ends(&id);
        assert_eq!(paused.state, RunState::Paused, "{paused:?}");
        assert!(paused.journal.is_some() && paused.can_resume, "{paused:?}");
    });
}
