//! An event in one line.

use serde_json::Value;

use crate::program::exchange::plain;

/// In one line, and nothing that a terminal would obey.
pub(super) fn one_line(text: &str) -> String {
    plain(text).replace('\n', " ")
}

/// A number with its unit, as it came.
fn quantity(value: &Value, digits: usize) -> Option<String> {
    let number = value["value"].as_f64()?;
    let unit = value["unit"]
        .as_str()
        .unwrap_or_default()
        .replace("um", "µm");
    Some(format!("{number:.digits$} {unit}"))
}

/// What of `data` tells most, in the words of the service.
fn told(data: &Value) -> String {
    let steps = data["steps"].as_u64().filter(|it| *it > 0);
    if let (Some(stage), Some(done), Some(steps)) =
        (data["stage"].as_str(), data["steps_done"].as_u64(), steps)
    {
        return format!("{stage}, {done} of {steps}");
    }
    if let Some(place) = quantity(&data["position"], 6).or_else(|| quantity(&data["encoder"], 6)) {
        return place;
    }
    let state = data["state"].as_str().unwrap_or_default();
    let cause = data["cause"]["cause"].as_str();
    let stopped = data["stopped"]["by"].as_str().map(|by| format!("by {by}"));
    if let Some(why) = cause.map(str::to_owned).or(stopped) {
        return format!("{state} {why}").trim_start().to_owned();
    }
    if let Some(by) = data["released_by"].as_str() {
        return format!("released by {by}");
    }
    if let (Some(name), Some(from)) = (data["name"].as_str(), data["taken_from"].as_str()) {
        return format!("{name}, taken from {from}");
    }
    let first = ["text", "waiting", "state", "mode", "stage", "id", "name"];
    let first = first
        .into_iter()
        .find_map(|it| data[it].as_str())
        .unwrap_or_default();
    match data["by"].as_str() {
        Some(by) => format!("{first} by {by}"),
        None => first.to_owned(),
    }
}

/// `08:00:01.123 motion m1-2 done`; nothing in it that a terminal would obey.
pub(super) fn line(event: &Value) -> String {
    let word = |name: &str| event[name].as_str().unwrap_or_default();
    // RFC 3339: the time of day stands behind the date and a T.
    let time = word("at").get(11..23).unwrap_or_default();
    let what = match (event["from"].as_u64(), event["to"].as_u64()) {
        (Some(from), Some(to)) => format!("events {from} to {to} were missed"),
        _ => told(&event["data"]),
    };
    let words = [time, word("kind"), word("of"), &what];
    let said: Vec<&str> = words.into_iter().filter(|it| !it.is_empty()).collect();
    one_line(&said.join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kind, what it is of, what it says; and how its line ends.
    const EVENTS: &str = r#"
motion m1-2 {"id": "m1-2", "state": "done", "by": "anna"} => motion m1-2 done by anna
motion m1-3 {"state": "failed", "cause": {"cause": "axis x:\u001b[2J\nfault"}} => motion m1-3 failed axis x:[2J fault
motion m1-4 {"state": "stopped", "stopped": {"by": "bob"}} => motion m1-4 stopped by bob
position x {"position": {"value": 12.5, "unit": "mm"}, "motion": "m1-2"} => position x 12.500000 mm
run r1-1 {"stage": "runs", "steps_done": 3, "steps": 84} => run r1-1 runs, 3 of 84
stop - {"by": "page", "mode": "quick"} => stop quick by page
lease - {"name": null, "released_by": "anna"} => lease released by anna
lease - {"name": "anna", "taken_from": "bob"} => lease anna, taken from bob
lease - {"name": "anna", "taken_from": null} => lease anna
warning - {"text": "late"} => warning late
axis x {"state": "Standstill"} => axis x Standstill
"#;

    #[test]
    fn an_event_says_when_what_and_why_and_nothing_that_a_terminal_obeys() {
        for row in EVENTS.trim().lines() {
            let (event, expected) = row.split_once(" => ").unwrap();
            let [kind, of, data] = event.splitn(3, ' ').collect::<Vec<_>>()[..] else {
                panic!("{row}");
            };
            let data: Value = serde_json::from_str(data).unwrap();
            let event = serde_json::json!({
                "id": 3,
                "at": "2026-03-01T08:00:01.123Z",
                "kind": kind,
                "of": of.trim_matches('-'),
                "data": data,
            });
            assert_eq!(line(&event), format!("08:00:01.123 {expected}"));
        }
        let gap = serde_json::json!({"from": 3, "to": 9});
        assert_eq!(line(&gap), "events 3 to 9 were missed");
        assert_eq!(line(&Value::Null), "");
    }
}
