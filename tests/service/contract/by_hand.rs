//! A table that a person turns by hand, line by line, to read its plate.

use core::time::Duration;

use service::{AxisState, Code, RunState};

use super::questions::{Hand, as_found, stage_read_by};
use super::{anna, each};

#[test]
fn hands_that_turn_the_table_have_it_switched_off_from_the_first_question_to_the_end() {
    let new = |rig, folder: &std::path::Path| stage_read_by("angle", rig, folder);
    each(new, |bed| {
        let verify = as_found();
        // Angles count from the zero.
        let early = bed.client.plan(&anna(), &verify).unwrap_err();
        assert_eq!(early.code, Code::NotZeroed, "{early}");
        bed.client.zero(&anna(), Some("c"));
        let id = bed.client.plan(&anna(), &verify).unwrap();
        let plan = bed.client.run(&id, Duration::ZERO).unwrap().plan;
        assert_eq!((plan.points, plan.seconds_at_least), (3 * 24, 0.0));
        let mut hand = Hand::new(bed);
        let mut lines = 0;
        let ended = loop {
            let run = bed.asks_or_ends(&id);
            let Some(question) = run.question else {
                break run;
            };
            assert!(question.by_hand, "{question:?}");
            let number = question.number;
            if lines % 20 == 0 {
                assert_eq!(bed.client.axis("c").unwrap().state, AxisState::Disabled);
                let refused = bed.client.power(&anna(), "c", true).unwrap_err();
                assert!(refused.to_string().contains("by hand"), "{refused}");
            }
            match question.what.as_str() {
                "turn_plate" => hand.does(&id, &question),
                "read_line" => {
                    let line = question.task["line"].as_u64().expect("a line");
                    let line = u32::try_from(line).expect("a plate has few");
                    let seen = bed
                        .stage
                        .simulation(move |machine| machine.sight_line(line));
                    let angle = seen.angle.expect("it has a microscope").degrees();
                    let answer = format!("{:.9}deg", angle.rem_euclid(360.0));
                    bed.answer(&id, number, &answer).unwrap();
                    lines += 1;
                }
                "close_placement" => bed.answer(&id, number, "close").unwrap(),
                other => panic!("{other}"),
            }
        };
        assert_eq!(ended.state, RunState::Done, "{ended:?}");
        assert_eq!(lines, 3 * 24);
        // It is for people to say that their hands are out.
        let axis = bed.client.axis("c").unwrap();
        assert_eq!((axis.state, axis.homed), (AxisState::Disabled, true));
        bed.client.power(&anna(), "c", true).unwrap();
    });
}
