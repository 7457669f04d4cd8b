//! Moves and jogs of a machine that a service keeps.

use std::time::{Duration, Instant};

use machine::StopRequest;
use serde_json::{Value, json};

use super::{STOP, Service, failed, refuse, stop_request, stopped, tell, words_of};
use crate::Failure;
use crate::program::MoveArgs;
use crate::program::exchange::ask_on;
use crate::program::jog::JogArgs;
use crate::program::kind::kind_of_axes;
use crate::program::output::{Ended, Output};
use crate::program::targets::AskedMotion;

/// How often a jog is renewed: a service stops one that was not for 200 ms.
const AGAIN: Duration = Duration::from_millis(50);

impl Service {
    pub(crate) fn move_to(&self, args: &MoveArgs, asked: AskedMotion, output: Output) -> Ended {
        refuse(args.machine.record.is_some(), "--record")?;
        let stop = stop_request()?;
        let AskedMotion {
            mut request,
            zeroed,
            notes,
        } = asked;
        for name in &zeroed {
            self.zero_first(Some(name), &stop, output)?;
        }
        request["uncompensated"] = json!(args.agreed.uncompensated);
        request["beyond"] = json!(args.agreed.beyond);
        let motion = self.motion(&request, &stop, output)?;
        if motion["told"].is_object() {
            // Its axes have moved as one.
            return tell(&motion, output);
        }
        let legs = motion["axes"].as_object().into_iter().flatten();
        let told = legs.map(|(axis, leg)| {
            let (text, value) = words_of(leg);
            let notes = notes.iter().filter(|it| it.0 == *axis);
            (
                notes.fold(text, |text, (_, note)| format!("{text}\n{note}")),
                value,
            )
        });
        let (texts, values): (Vec<_>, Vec<_>) = told.unzip();
        output.result(&texts.join("\n"), &json!({"moves": values}))
    }

    /// Says again and again that the axis shall go on, as a service wants to hear it; the axis has its zero.
    pub(crate) fn jog(&self, args: &JogArgs, output: Output) -> Ended {
        refuse(args.machine.record.is_some(), "--record")?;
        let (jog, stop) = (args.jog()?, stop_request()?);
        let named = [jog.axis.as_str()].into_iter();
        let jogs = &kind_of_axes(&args.machine, named)?.jog;
        self.zero_first(jogs.zeroed.or(Some(&jog.axis)), &stop, output)?;
        let id = self.begin("/v1/jog", &jog.request())?;
        // By the wall: whoever keeps the machine has its own clock.
        let end = jog.duration.map(|it| Instant::now() + it);
        let is_over = || stop.is_requested() || end.is_some_and(|end| Instant::now() >= end);
        let path = format!("/v1/motions/{id}");
        self.keep_alive(&path, is_over)?;
        let is_ours = is_over();
        if is_ours {
            // It may just have ended by itself.
            let over = jog.request_of_its_end().to_string();
            let _ = ask_on(&self.at, "POST", "/v1/jog", &over);
        }
        let motion = ask_on(&self.at, "GET", &format!("{path}?wait_s=10"), "")?;
        match motion["state"].as_str() {
            Some("failed" | "timed_out") => Err(failed(&motion)),
            _ if stop.is_requested() => Err(stop.failure().into()),
            Some("stopped") if !is_ours => Err(stopped(&motion)),
            _ => {
                let (text, value) = jogs
                    .told(&jog.axis, &motion)
                    .unwrap_or_else(|| words_of(&motion));
                output.result(&text, &value)
            }
        }
    }

    /// Renews the dead-man of the motion at `path` until that has ended, or `is_over`. Renewed and never asked for
    /// again: what somebody has stopped meanwhile stays stopped.
    fn keep_alive(&self, path: &str, is_over: impl Fn() -> bool) -> Result<(), Failure> {
        let look = format!("{path}?wait_s={}", AGAIN.as_secs_f64());
        while !is_over() {
            let seen = ask_on(&self.at, "GET", &look, "")?;
            if seen["state"] != "moving" && seen["state"] != "queued" {
                break;
            }
            // Refused when it has ended since; then the next look says how.
            let _ = ask_on(&self.at, "POST", &format!("{path}/renew"), "{}");
        }
        Ok(())
    }

    fn motion(
        &self,
        request: &Value,
        stop: &StopRequest,
        output: Output,
    ) -> Result<Value, Failure> {
        let id = self.begin("/v1/motions", request)?;
        let path = format!("/v1/motions/{id}");
        self.end_of(&path, STOP, (stop, output), |_, _| Ok(()))?
            .good()
    }
}
