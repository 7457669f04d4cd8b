//! What is published of runs is copied when it changes, and only then.

use serde_json::json;

use super::*;

fn run(id: &str) -> Run {
    let machine = include_str!("../../../../configs/machines/linear.toml");
    let loaded = truestage::config::parse(machine, "linear.toml").unwrap();
    let group = truestage::groups(&loaded.config).remove(0);
    let request: RunRequest = serde_json::from_value(json!({"kind": "calibrate"})).unwrap();
    let of = (group.name.as_str(), group.axes.clone());
    let view = RunView::planned(id, "somebody", request.kind, of, RunPlanView::default());
    let task = Task {
        id: id.into(),
        request,
        group: Arc::new(group),
        is_resumed: false,
        resume: None,
        judged: None,
    };
    Run::new(task, vec![0], view)
}

fn two_of_which_the_second_goes_on() -> Runs {
    let mut runs = Runs::default();
    runs.keep(run("first"));
    runs.keep(run("second"));
    runs.find("first").unwrap().view.state = RunState::Done;
    runs.find("second").unwrap().view.state = RunState::Running;
    runs
}

#[test]
fn a_list_is_the_same_until_something_changes() {
    let mut runs = two_of_which_the_second_goes_on();
    let list = runs.list();
    assert_eq!(runs.running().unwrap().view.id, "second");
    assert!(Arc::ptr_eq(&list, &runs.list()), "somebody looked at it");
}

#[test]
fn what_changes_is_shown_and_nothing_else_is_copied() {
    let mut runs = two_of_which_the_second_goes_on();
    let before = runs.list();
    runs.under_way().unwrap().view.steps_done = 7;
    let after = runs.list();
    assert_eq!((before[1].steps_done, after[1].steps_done), (0, 7));
    assert!(Arc::ptr_eq(&before[0], &after[0]), "it is over");
    runs.running_mut().unwrap().view.steps_done = 8;
    runs.find("first").unwrap().view.made_worse = true;
    let last = runs.list();
    assert_eq!((last[1].steps_done, last[0].made_worse), (8, true));
}

/// A machine's thread looks at its runs after every tick.
#[test]
fn where_no_run_goes_on_nothing_is_copied() {
    let mut runs = two_of_which_the_second_goes_on();
    runs.find("second").unwrap().view.state = RunState::Done;
    let list = runs.list();
    assert!(runs.under_way().is_none() && runs.running().is_none());
    assert!(Arc::ptr_eq(&list, &runs.list()));
}
