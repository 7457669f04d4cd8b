//! What a stop says: however wrong that is, it stops.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use utoipa::ToSchema;

use crate::request::StopMode;

/// How everything is stopped.
#[derive(Debug, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "the description alone reads it")]
pub(super) struct StopRequest {
    /// `controlled` when left out.
    #[serde(default)]
    mode: StopMode,
}

/// That it stops.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct StopDone {
    /// Always true.
    pub(super) done: bool,
    /// What of the request was not understood, and how it was stopped all the same.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) warning: Option<String>,
}

/// How a request that says `said` is to be stopped, and what of it cannot be understood.
pub(super) fn understood(said: &[u8]) -> (StopMode, Option<String>) {
    if said.trim_ascii().is_empty() {
        return (StopMode::default(), None);
    }
    let mut members = match serde_json::from_slice(said) {
        Ok(Value::Object(members)) => members,
        Ok(_) => {
            let what = "the body is no object; expected {\"mode\": \"controlled\"} or \"quick\"";
            return (StopMode::default(), Some(what.into()));
        }
        Err(error) => {
            let what = format!("the body is no JSON: {error}");
            return (StopMode::default(), Some(what));
        }
    };
    let mode = members.remove("mode").map(serde_json::from_value);
    let (mode, mut unclear) = match mode {
        None => (StopMode::default(), Vec::new()),
        Some(Ok(mode)) => (mode, Vec::new()),
        Some(Err(error)) => (StopMode::default(), vec![format!("`mode`: {error}")]),
    };
    if !members.is_empty() {
        unclear.push("what else it says beside `mode`, which a stop does not have".to_owned());
    }
    let warning = (!unclear.is_empty()).then(|| unclear.join("; "));
    (mode, warning)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whatever_is_said_stops_and_what_was_understood_of_it_counts() {
        let of = |said: &str| understood(said.as_bytes());
        for plain in ["", " ", "{}", r#"{"mode": "controlled"}"#] {
            assert_eq!(of(plain), (StopMode::Controlled, None), "{plain}");
        }
        assert_eq!(of(r#"{"mode": "quick"}"#), (StopMode::Quick, None));
        let (mode, warning) = of(r#"{"mode": "quick", "why": "smoke"}"#);
        assert_eq!(mode, StopMode::Quick);
        assert!(warning.is_some_and(|it| it.contains("beside `mode`")));
        for wrong in [
            "{",
            "[]",
            "null",
            "quick",
            r#"{"mode": "QUICK"}"#,
            r#"{"mode": null}"#,
            r#"{"now": 1}"#,
        ] {
            let (mode, warning) = of(wrong);
            assert_eq!(mode, StopMode::Controlled, "{wrong}");
            assert!(warning.is_some(), "{wrong}");
        }
    }
}
