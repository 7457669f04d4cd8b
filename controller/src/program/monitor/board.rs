//! What is known of a machine, from all that was heard.

use std::collections::VecDeque;
use std::time::Duration;

use serde_json::{Value, json};

use super::feed::Heard;
use super::words;

/// More than any terminal shows.
const EVENTS_KEPT: usize = 100;

/// Longer than samples are apart, on however busy a computer.
const SILENT: Duration = Duration::from_secs(2);

/// What is known.
#[derive(Debug, Default)]
pub(super) struct Board {
    pub(super) at: String,
    pub(super) machine: Value,
    pub(super) axes: Vec<Value>,
    /// The newest first.
    pub(super) runs: Vec<Value>,
    /// The newest first.
    pub(super) events: VecDeque<String>,
    /// Why nothing is heard, as far as that was told.
    lost: Option<String>,
    /// For how long nothing has been heard.
    silence: Duration,
    /// What became of a key that was pressed.
    pub(super) answer: String,
}

impl Board {
    pub(super) fn new(at: &str) -> Self {
        Self {
            at: at.to_owned(),
            ..Self::default()
        }
    }

    pub(super) fn hear(&mut self, heard: Heard) {
        match heard {
            Heard::Lost(failure) => {
                self.lost = Some(failure.to_string());
                return;
            }
            Heard::Ended => {
                self.lost = Some("the service has ended".into());
                return;
            }
            Heard::Machine(machine) => self.machine = machine,
            Heard::Axes(axes) => self.axes = listed(axes),
            Heard::Runs(runs) => {
                self.runs.clear();
                listed(runs).into_iter().for_each(|it| self.run(it));
            }
            Heard::Event(event) => self.event(&event),
        }
        self.lost = None;
    }

    /// Nothing was heard for so long.
    pub(super) const fn silent_for(&mut self, silence: Duration) {
        self.silence = silence;
    }

    /// Why all that is shown is old, when it is.
    pub(super) fn why_old(&self) -> Option<String> {
        let is_silent = self.silence > SILENT;
        let silent = || is_silent.then(|| format!("silent for {} s", self.silence.as_secs()));
        self.lost.clone().or_else(silent)
    }

    /// Those that are under way first, then the newest.
    pub(super) fn runs_in_order(&self) -> impl Iterator<Item = &Value> {
        let is_under_way = |it: &&Value| it["state"] == "running" || it["state"] == "stopping";
        let first = self.runs.iter().filter(is_under_way);
        first.chain(self.runs.iter().filter(move |it| !is_under_way(it)))
    }

    fn event(&mut self, event: &Value) {
        if event["kind"] == "run" {
            let mut run = event["data"].clone();
            if run["id"].is_null() {
                run["id"] = event["of"].clone();
            }
            self.run(run);
        }
        if event["kind"] == "question" {
            let question = match event["data"]["answer"].is_null() {
                true => event["data"].clone(),
                false => Value::Null,
            };
            self.run(json!({"id": event["of"], "question": question}));
        }
        self.events.push_front(words::line(event));
        self.events.truncate(EVENTS_KEPT);
    }

    /// Progress says only what has changed.
    fn run(&mut self, said: Value) {
        let known = self.runs.iter_mut().find(|it| it["id"] == said["id"]);
        match (known, said) {
            (Some(Value::Object(known)), Value::Object(said)) => known.extend(said),
            (_, said) => self.runs.insert(0, said),
        }
    }
}

fn listed(value: Value) -> Vec<Value> {
    match value {
        Value::Array(list) => list,
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn progress_changes_the_run_that_is_known_and_a_new_one_comes_first() {
        let mut board = Board::new("unix:s");
        board.hear(Heard::Runs(
            json!([{"id": "r1-1", "kind": "zero", "state": "done"}]),
        ));
        let event =
            |of: &str, data: Value| Heard::Event(json!({"kind": "run", "of": of, "data": data}));
        board.hear(event(
            "r1-2",
            json!({"id": "r1-2", "kind": "verify", "state": "running"}),
        ));
        board.hear(event(
            "r1-2",
            json!({"stage": "runs", "steps_done": 3, "steps": 84}),
        ));
        let known: Vec<_> = board
            .runs
            .iter()
            .map(|it| (&it["id"], &it["steps_done"], &it["state"]))
            .collect();
        assert_eq!(
            known,
            [
                (&json!("r1-2"), &json!(3), &json!("running")),
                (&json!("r1-1"), &Value::Null, &json!("done"))
            ]
        );
        board.hear(event(
            "r1-3",
            json!({"id": "r1-3", "kind": "zero", "state": "planned"}),
        ));
        let shown: Vec<_> = board.runs_in_order().map(|it| &it["id"]).collect();
        assert_eq!(
            shown,
            ["r1-2", "r1-3", "r1-1"],
            "what is under way stays in view"
        );
    }

    #[test]
    fn a_connection_that_was_lost_shows_until_something_is_heard_again() {
        let mut board = Board::new("unix:s");
        board.hear(Heard::Ended);
        assert_eq!(board.why_old().as_deref(), Some("the service has ended"));
        board.silent_for(Duration::from_secs(9));
        assert_eq!(board.why_old().as_deref(), Some("the service has ended"));
        board.hear(Heard::Axes(json!([])));
        for (seconds, said) in [
            (1, None),
            (3, Some("silent for 3 s")),
            (4, Some("silent for 4 s")),
            (0, None),
        ] {
            board.silent_for(Duration::from_secs(seconds));
            assert_eq!(board.why_old().as_deref(), said);
        }
    }
}
