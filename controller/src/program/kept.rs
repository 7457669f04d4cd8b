//! The verbs of the cycle on a machine that a service keeps: asked of the service, told as if they were done here.
//!
//! A verb first tries to take the machine. Whoever has it says in its lease where it can be asked; what is wrong
//! with the command line itself has been refused by then.

mod calibrated;
mod files;
mod heard;
mod jobs;
mod left;
mod memories;
mod motions;
mod reset;

use std::path::Path;
use std::time::{Duration, Instant};

use machine::records::StoreError;
use serde_json::{Value, json};
use units::Time;

use crate::Failure;
use crate::program::answering::{Answering, Asked};
use crate::program::chosen::{Used, told};
use crate::program::exchange::{LOST, ask, ask_on, exit_code_of, plain};
use crate::program::output::{Ended, Output};
use crate::program::progress::Bars;
use crate::program::rotary::readings::is_turned_by_hand;
use crate::program::signals::stop_on_signals;
use crate::program::{AskArgs, AxisArgs, MachineArgs, VerifyArgs};
use crate::runs::Choice;
use heard::Heard;
use machine::{Observer as _, Stage, StopRequest};

/// How long an answer is held back: Ctrl-C is looked for so often.
const WAIT: Duration = Duration::from_millis(200);

/// What the service calls three axes that are run together.
const VOLUME: &str = "volume";
/// What stops everything, and is taken from anybody.
const STOP: &str = "/v1/stop";

/// Where the service is.
pub(crate) struct Service {
    at: String,
}

/// How `here` ended; when the machine is in use by a service, how it ends there.
pub(crate) fn or_by_its_service(here: Ended, there: impl FnOnce(&Service) -> Ended) -> Ended {
    match here {
        Err(Failure::Store(StoreError::Leased { owner, places })) => match places.first() {
            Some(place) => there(&Service { at: place.clone() }),
            None => Err(StoreError::Leased { owner, places }.into()),
        },
        ended => ended,
    }
}

impl Service {
    pub(crate) fn zero(&self, args: &AxisArgs, output: Output) -> Ended {
        refuse(args.machine.record.is_some(), "--record")?;
        let run = self.zero_run(args.axis.as_deref(), &stop_request()?, output)?;
        tell(&run, output)
    }

    /// Takes down what the detectors of three axes read.
    pub(crate) fn reference(&self, machine: &MachineArgs, output: Output) -> Ended {
        self.on_volume(json!({"axis": VOLUME}), machine, output)
    }

    /// A run that reads what the detectors of three axes see at stops.
    fn on_volume(&self, request: Value, machine: &MachineArgs, output: Output) -> Ended {
        refuse(machine.record.is_some(), "--record")?;
        let stop = stop_request()?;
        self.zero_first(Some(VOLUME), &stop, output)?;
        let waiting = Waiting::of_nobody(&stop, output);
        let run = self.run(Stage::Reference, request, None, waiting)?;
        tell(&run, output)
    }

    pub(crate) fn verify(
        &self,
        args: &VerifyArgs,
        asked: Vec<&'static Asked>,
        output: Output,
    ) -> Ended {
        if !args.readings.is_empty() {
            let request = json!({"uncompensated": args.uncompensated});
            let resume = args.resume.as_ref();
            return self.by_readings(
                (Stage::Verify, request),
                &args.axis,
                (&args.readings, resume),
                output,
            );
        }
        let stop = self.prepare(&args.axis, output)?;
        let request = json!({"axis": args.axis.axis, "uncompensated": args.uncompensated});
        let resume = args.resume.as_deref();
        let waiting = Waiting::of(&args.axis, &args.ask, &stop, output);
        let waiting = waiting.who_asks(asked);
        let run = self.run(Stage::Verify, request, resume, waiting)?;
        told_of(&run, output)
    }

    /// Uses another calibration from now on.
    pub(crate) fn choose(&self, choice: &Choice, output: Output) -> Ended {
        let chosen = self.post_choice(choice)?;
        let changes = chosen["changes"].as_array().into_iter().flatten();
        let changes = changes.map(|it| Used {
            pointer: it["of"].as_str().unwrap_or_default(),
            id: it["id"].as_str(),
            is_earlier: it["is_earlier"] == true,
        });
        told(choice, &changes.collect::<Vec<_>>(), output)
    }

    fn post_choice(&self, choice: &Choice) -> Result<Value, Failure> {
        let (path, body) = match choice {
            Choice::Activate(id) => (
                format!("/v1/calibrations/{}/activate", plain(id)),
                json!({}),
            ),
            Choice::Rollback(axis) => ("/v1/calibrations/rollback".into(), json!({"axis": axis})),
            Choice::Clear(of) => ("/v1/calibrations/clear".into(), json!({"axis": of})),
        };
        ask(&self.at, "POST", &path, &body.to_string())
    }

    /// What comes before a run that measures: options that are not offered are refused, and the axis has its zero.
    fn prepare(&self, args: &AxisArgs, output: Output) -> Result<StopRequest, Failure> {
        refuse(args.machine.record.is_some(), "--record")?;
        let stop = stop_request()?;
        // Nobody who turns a table by hand expects it to turn by itself.
        if !is_turned_by_hand(args)? {
            self.zero_first(args.axis.as_deref(), &stop, output)?;
        }
        Ok(stop)
    }

    /// A kept machine has its zero, unless it was just started or reset. What somebody has switched off stays off: whoever has
    /// a reason for that need not be who moves it.
    fn zero_first(
        &self,
        axis: Option<&str>,
        stop: &StopRequest,
        output: Output,
    ) -> Result<(), Failure> {
        let axes = ask(&self.at, "GET", "/v1/axes", "")?;
        let axes = axes.as_array().into_iter().flatten();
        let is_meant =
            |it: &&Value| axis.is_none_or(|axis| it["name"] == axis || it["group"] == axis);
        let meant: Vec<&Value> = axes.filter(is_meant).collect();
        if !meant.is_empty() && meant.iter().all(|it| it["homed"] == true) {
            return Ok(());
        }
        // What it says of an axis that is not there is said by the run.
        self.zero_run(axis, stop, output).map(drop)
    }

    fn zero_run(
        &self,
        axis: Option<&str>,
        stop: &StopRequest,
        output: Output,
    ) -> Result<Value, Failure> {
        let waiting = Waiting::of_nobody(stop, output);
        self.run(Stage::Zero, json!({"axis": axis}), None, waiting)
    }

    /// Begins a run, or goes on with one that ended before its result, and waits for its result; the service names runs as people
    /// name their stages.
    fn run(
        &self,
        stage: Stage,
        request: Value,
        resume: Option<&Path>,
        waiting: Waiting<'_>,
    ) -> Result<Value, Failure> {
        self.seen(stage, request, resume, waiting)?.good()
    }

    /// The same, with what is seen of it also where it has no result.
    fn seen(
        &self,
        stage: Stage,
        mut request: Value,
        resume: Option<&Path>,
        waiting: Waiting<'_>,
    ) -> Result<Seen, Failure> {
        if request["kind"].is_null() {
            request["kind"] = json!(stage.text());
        }
        let (run, verb) = match resume {
            None => (
                ask(&self.at, "POST", "/v1/runs", &request.to_string())?,
                "start",
            ),
            Some(journal) => (self.left(&request, journal)?, "resume"),
        };
        let path = format!("/v1/runs/{}", plain(run["id"].as_str().unwrap_or_default()));
        let begun = waiting.person(&run["plan"]).and_then(|person| {
            self.begin(&format!("{path}/{verb}"), &json!({}))?;
            Ok(person)
        });
        let mut person = begun.inspect_err(|_| {
            if resume.is_none() {
                // Nobody else starts what was planned here.
                let _ = ask(&self.at, "POST", &format!("{path}/abort"), "{}");
            }
        })?;
        let mut bars = waiting.output.bars(Bars::new);
        let begun = Instant::now();
        let ending = match run["can_resume"] == true {
            true => "pause",
            false => "abort",
        };
        let ender = format!("{path}/{ending}");
        self.end_of(
            &path,
            &ender,
            (waiting.stop, waiting.output),
            |run, heard| {
                let of = |name: &str| run[name].as_u64().unwrap_or(0);
                let axis = plain(run["of"].as_str().unwrap_or_default());
                // The machine's clock is the service's.
                bars.lives(Time::ZERO + begun.elapsed());
                if of("steps") > 0 {
                    bars.progress(stage, &axis, of("steps_done"), of("steps"));
                }
                match &mut person {
                    Some(person) => self.answer(&path, run, (person, heard)),
                    None => Ok(()),
                }
            },
        )
    }

    /// Puts what the run at `path` asks to the person at this end, and passes his answer on.
    fn answer(
        &self,
        path: &str,
        run: &Value,
        (person, heard): (&mut Answering, &Heard),
    ) -> Result<(), Failure> {
        let Some((number, answer)) = person.look(&heard.unheard(&run["question"]))? else {
            return Ok(());
        };
        let body = json!({"question": number, "answer": answer}).to_string();
        let Err(refused) = ask_on(&self.at, "POST", &format!("{path}/answers"), &body) else {
            return Ok(());
        };
        // Somebody else may have answered or stopped it: then nothing is asked any more.
        let now = ask_on(&self.at, "GET", path, "")?;
        match now["question"]["number"] == number {
            true => person.refuse(&refused.to_string()),
            false => Ok(()),
        }
    }

    /// The name of what was begun.
    fn begin(&self, path: &str, request: &Value) -> Result<String, Failure> {
        let begun = ask(&self.at, "POST", path, &request.to_string())?;
        Ok(plain(begun["id"].as_str().unwrap_or_default()))
    }

    /// Waits for the end of what is at `path`; when this program is asked to stop, `ender` is asked to end it.
    fn end_of(
        &self,
        path: &str,
        ender: &str,
        (stop, output): (&StopRequest, Output),
        mut meanwhile: impl FnMut(&Value, &Heard) -> Result<(), Failure>,
    ) -> Result<Seen, Failure> {
        let mut is_heard = false;
        let mut trouble = None;
        let mut points = 0;
        let mut heard = Heard::default();
        loop {
            let is_ending = stop.is_requested() || trouble.is_some();
            if is_ending && !is_heard {
                is_heard = self.end(path, ender, output)?;
            }
            let wait_s = WAIT.as_secs_f64();
            // Only a run has points, and those that were told need not come again.
            let known = match points {
                0 => String::new(),
                points => format!("&heard={points}"),
            };
            let look = format!("{path}?wait_s={wait_s}{known}");
            let seen = ask_on(&self.at, "GET", &look, "")?;
            points += jobs::say_reached(&seen, output);
            if !is_ending {
                trouble = meanwhile(&seen, &heard).err();
            }
            heard.tell(&seen, output);
            let bad = match seen["state"].as_str() {
                Some("done") => None,
                Some("stopped" | "paused") if trouble.is_some() => trouble,
                Some("stopped") if is_ending => Some(stop.failure().into()),
                Some("paused") => Some(paused(&seen, is_ending.then(|| stop.failure()))),
                Some("stopped") => Some(stopped(&seen)),
                Some("failed" | "timed_out") => Some(failed(&seen)),
                _ => continue,
            };
            return Ok(Seen { last: seen, bad });
        }
    }

    /// Asks for the end of what is at `path`; whether that was heard. Where `ender` is refused because somebody else
    /// has the lease, everything is stopped: that is taken from anybody.
    fn end(&self, path: &str, ender: &str, output: Output) -> Result<bool, Failure> {
        let Err(refused) = ask_on(&self.at, "POST", ender, "{}") else {
            return Ok(true);
        };
        // It may just have ended.
        let seen = ask_on(&self.at, "GET", path, "")?;
        let goes_on = matches!(
            seen["state"].as_str(),
            Some("running" | "moving" | "queued")
        );
        if !goes_on || ender == STOP {
            return Ok(false);
        }
        output.note(&format!(
            "the service does not end it so: {refused}; everything is stopped instead, and what was measured is kept"
        ));
        Ok(ask_on(&self.at, "POST", STOP, "{}").is_ok())
    }
}

/// How a run or a motion ended.
struct Seen {
    /// What the service said of it last.
    last: Value,
    /// Why it has no result.
    bad: Option<Failure>,
}

impl Seen {
    fn good(self) -> Result<Value, Failure> {
        self.bad.map_or(Ok(self.last), Err)
    }
}

/// Who waits for a run at this end.
struct Waiting<'w> {
    stop: &'w StopRequest,
    output: Output,
    /// Whether what is asked is done without waiting for it, and where an emulated machine's hand does it.
    by: (bool, Option<&'w Path>),
    /// How each question is put to a person.
    asked: Vec<&'static Asked>,
}

impl<'w> Waiting<'w> {
    fn of(args: &'w AxisArgs, ask: &AskArgs, stop: &'w StopRequest, output: Output) -> Self {
        Self {
            by: (ask.yes, args.machine.hand()),
            ..Self::of_nobody(stop, output)
        }
    }

    fn of_nobody(stop: &'w StopRequest, output: Output) -> Self {
        Self {
            stop,
            output,
            by: (false, None),
            asked: Vec::new(),
        }
    }

    fn who_asks(self, asked: Vec<&'static Asked>) -> Self {
        Self { asked, ..self }
    }

    /// Whoever answers, where a run of this plan asks something.
    ///
    /// # Errors
    /// When nobody can: nothing has begun then.
    fn person(&self, plan: &Value) -> Result<Option<Answering>, Failure> {
        let asks = plan["asks"].as_array();
        if asks.is_none_or(|it| it.is_empty()) {
            return Ok(None);
        }
        Answering::new(self.by, self.asked.clone(), self.output).map(Some)
    }
}

fn stop_request() -> Result<StopRequest, Failure> {
    let stop = StopRequest::default();
    stop_on_signals(&stop)?;
    Ok(stop)
}

/// # Errors
/// When an option is given that only a program which opens the machine itself can heed.
fn refuse(is_given: bool, option: &str) -> Result<(), Failure> {
    if !is_given {
        return Ok(());
    }
    Err(Failure::Usage {
        what: format!(
            "{option}: this machine is kept by `truestage serve`, which does not offer it"
        ),
        help: "leave it out, or end the service first".into(),
    })
}

fn stopped(seen: &Value) -> Failure {
    let by = plain(seen["stopped"]["by"].as_str().unwrap_or("somebody"));
    Failure::Kept {
        said: format!("stopped by {by}; the axes stand{}", goes_on(seen)),
        exit_code: machine::Failure::Interrupted.exit_code(),
    }
}

/// How a run that ended before its result is continued.
fn goes_on(seen: &Value) -> String {
    match (&seen["can_resume"], seen["journal"].as_str()) {
        (Value::Bool(true), Some(journal)) => {
            format!("; go on with --resume ({})", plain(journal))
        }
        _ => String::new(),
    }
}

/// `asked`: this program was told to end, and paused it for that.
fn paused(seen: &Value, asked: Option<machine::Failure>) -> Failure {
    let failure = asked.unwrap_or(machine::Failure::Interrupted);
    Failure::Kept {
        said: format!(
            "{failure}; the run is paused and the axes stand: go on with --resume ({})",
            plain(
                seen["journal"]
                    .as_str()
                    .unwrap_or("nothing was measured yet")
            )
        ),
        exit_code: failure.exit_code(),
    }
}

fn failed(seen: &Value) -> Failure {
    let cause = &seen["cause"];
    let why = cause["cause"].as_str();
    Failure::Kept {
        said: plain(why.unwrap_or("the service says no cause")) + &goes_on(seen),
        exit_code: exit_code_of(cause).unwrap_or(LOST),
    }
}

/// What a run or an axis of a motion gave, as the command line says it, or in the service's own figures.
fn words_of(ended: &Value) -> (String, Value) {
    let told = &ended["told"];
    match told["text"].as_str() {
        Some(text) => (plain(text), told["value"].clone()),
        None => ("done".into(), json!({"result": ended["result"]})),
    }
}

fn tell(ended: &Value, output: Output) -> Ended {
    let (text, value) = words_of(ended);
    output.result(&text, &value)
}

/// What a run gave, and why that is a bad result, if it is.
fn told_of(run: &Value, output: Output) -> Ended {
    let Some(failure) = bad_result_of(run) else {
        return tell(run, output);
    };
    let (text, value) = words_of(run);
    output.bad_result(&text, value, failure)
}

fn bad_result_of(run: &Value) -> Option<Failure> {
    let bad = &run["out_of_tolerance"];
    let exit_code = exit_code_of(bad)?;
    let said = plain(bad["cause"].as_str().unwrap_or_default());
    Some(Failure::Kept { said, exit_code })
}
