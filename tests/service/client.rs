//! A client, whatever interface it uses: the contract is written against this.

use core::time::Duration;
use std::sync::Arc;

use service::{
    AnswerRequest, AxisView, CalibrationView, Caller, ChosenView, Desk, Event, JogRequest,
    LeaseRequest, Leased, MachineView, MotionView, MoveRequest, Problem, RunKind, RunRequest,
    RunState, RunView, StopMode,
};

use crate::stage::{Gate, Stage};

/// The longest that a test waits for an end, by the clock on the wall.
pub(crate) const PATIENCE: Duration = Duration::from_secs(280);

/// Somebody who asks the service.
pub(crate) trait Client {
    /// How.
    fn interface(&self) -> &'static str;
    fn begin(
        &self,
        who: &Caller,
        request: &MoveRequest,
        key: Option<&str>,
    ) -> Result<String, Problem>;
    fn motion(&self, id: &str, wait: Duration) -> Result<MotionView, Problem>;
    fn jog(&self, who: &Caller, request: &JogRequest) -> Result<String, Problem>;
    fn renew(&self, who: &Caller, id: &str) -> Result<(), Problem>;
    fn stop(&self, who: &Caller, mode: StopMode) -> Result<(), Problem>;
    fn reset(&self, who: &Caller) -> Result<(), Problem>;
    fn power(&self, who: &Caller, axis: &str, on: bool) -> Result<(), Problem>;
    fn plan(&self, who: &Caller, request: &RunRequest) -> Result<String, Problem> {
        self.plan_once(who, request, None)
    }
    fn plan_once(
        &self,
        who: &Caller,
        request: &RunRequest,
        key: Option<&str>,
    ) -> Result<String, Problem>;
    fn start(&self, who: &Caller, id: &str) -> Result<(), Problem>;
    fn abort(&self, who: &Caller, id: &str) -> Result<(), Problem>;
    fn pause(&self, who: &Caller, id: &str) -> Result<(), Problem>;
    fn resume(&self, who: &Caller, id: &str) -> Result<(), Problem>;
    fn answer(&self, who: &Caller, id: &str, answer: &AnswerRequest) -> Result<(), Problem>;
    fn runs(&self) -> Vec<RunView>;
    fn run(&self, id: &str, wait: Duration) -> Result<RunView, Problem>;
    fn lease(&self, who: &Caller, request: &LeaseRequest) -> Result<Leased, Problem>;
    fn release(&self, who: &Caller) -> Result<(), Problem>;
    fn calibrations(&self) -> Vec<CalibrationView>;
    fn activate(&self, who: &Caller, id: &str) -> Result<ChosenView, Problem>;
    fn rollback(&self, who: &Caller, axis: &str) -> Result<ChosenView, Problem>;
    fn clear(&self, who: &Caller, of: &str) -> Result<ChosenView, Problem>;
    fn axis(&self, name: &str) -> Result<AxisView, Problem>;
    fn machine(&self) -> MachineView;
    fn events(&self, after: u64) -> Vec<Event>;

    /// Finds the origin of `axis`, or of all axes of a volume.
    fn zero(&self, who: &Caller, axis: Option<&str>) {
        let id = self.plan(who, &RunRequest::of(RunKind::Zero, axis));
        let id = id.unwrap_or_else(|problem| panic!("{problem}"));
        let run = self.run(&id, PATIENCE).expect("it was planned");
        assert_eq!(run.state, RunState::Done, "{run:?}");
    }
}

/// Linked with the library.
pub(crate) struct InProcess {
    desk: Desk,
    gate: Arc<Gate>,
}

impl InProcess {
    pub(crate) fn of(stage: &Stage) -> Self {
        Self {
            desk: stage.desk.clone(),
            gate: Arc::clone(&stage.gate),
        }
    }
}

impl Client for InProcess {
    fn interface(&self) -> &'static str {
        "the library"
    }

    fn begin(
        &self,
        who: &Caller,
        request: &MoveRequest,
        key: Option<&str>,
    ) -> Result<String, Problem> {
        let _passing = self.gate.pass();
        self.desk.begin_motion(who, request, key)
    }

    fn motion(&self, id: &str, wait: Duration) -> Result<MotionView, Problem> {
        let _passing = self.gate.pass_for(wait);
        self.desk.wait_motion(id, wait)
    }

    fn jog(&self, who: &Caller, request: &JogRequest) -> Result<String, Problem> {
        let _passing = self.gate.pass();
        self.desk.jog(who, request)
    }

    fn renew(&self, who: &Caller, id: &str) -> Result<(), Problem> {
        let _passing = self.gate.pass();
        self.desk.renew(who, id)
    }

    fn stop(&self, who: &Caller, mode: StopMode) -> Result<(), Problem> {
        let _passing = self.gate.pass();
        self.desk.stop(who, mode)
    }

    fn reset(&self, who: &Caller) -> Result<(), Problem> {
        let _passing = self.gate.pass();
        self.desk.reset(who)
    }

    fn power(&self, who: &Caller, axis: &str, on: bool) -> Result<(), Problem> {
        let _passing = self.gate.pass();
        match on {
            true => self.desk.enable(who, axis),
            false => self.desk.disable(who, axis),
        }
    }

    fn plan_once(
        &self,
        who: &Caller,
        request: &RunRequest,
        key: Option<&str>,
    ) -> Result<String, Problem> {
        let _passing = self.gate.pass();
        self.desk.plan_run(who, request, key)
    }

    fn start(&self, who: &Caller, id: &str) -> Result<(), Problem> {
        let _passing = self.gate.pass();
        self.desk.start_run(who, id)
    }

    fn abort(&self, who: &Caller, id: &str) -> Result<(), Problem> {
        let _passing = self.gate.pass();
        self.desk.abort_run(who, id)
    }

    fn pause(&self, who: &Caller, id: &str) -> Result<(), Problem> {
        let _passing = self.gate.pass();
        self.desk.pause_run(who, id)
    }

    fn resume(&self, who: &Caller, id: &str) -> Result<(), Problem> {
        let _passing = self.gate.pass();
        self.desk.resume_run(who, id)
    }

    fn answer(&self, who: &Caller, id: &str, answer: &AnswerRequest) -> Result<(), Problem> {
        let _passing = self.gate.pass();
        self.desk.answer_run(who, id, answer)
    }

    fn runs(&self) -> Vec<RunView> {
        self.desk.runs()
    }

    fn run(&self, id: &str, wait: Duration) -> Result<RunView, Problem> {
        let _passing = self.gate.pass_for(wait);
        self.desk.wait_run(id, wait)
    }

    fn lease(&self, who: &Caller, request: &LeaseRequest) -> Result<Leased, Problem> {
        let _passing = self.gate.pass();
        self.desk.lease(who, request)
    }

    fn release(&self, who: &Caller) -> Result<(), Problem> {
        let _passing = self.gate.pass();
        self.desk.release(who)
    }

    fn calibrations(&self) -> Vec<CalibrationView> {
        self.desk.calibrations().expect("they can be read")
    }

    fn activate(&self, who: &Caller, id: &str) -> Result<ChosenView, Problem> {
        let _passing = self.gate.pass();
        self.desk.activate(who, id)
    }

    fn rollback(&self, who: &Caller, axis: &str) -> Result<ChosenView, Problem> {
        let _passing = self.gate.pass();
        self.desk.rollback(who, axis)
    }

    fn clear(&self, who: &Caller, of: &str) -> Result<ChosenView, Problem> {
        let _passing = self.gate.pass();
        self.desk.clear(who, of)
    }

    fn axis(&self, name: &str) -> Result<AxisView, Problem> {
        self.desk.axis(name)
    }

    fn machine(&self) -> MachineView {
        self.desk.machine()
    }

    fn events(&self, after: u64) -> Vec<Event> {
        self.desk.events(after)
    }
}
