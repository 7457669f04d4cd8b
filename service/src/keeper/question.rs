//! What a run asks a person, and the answer. While it is something to do by hand, nothing else moves.

use std::cell::RefCell;
use std::rc::Rc;

use machine::{Driving, Machine};
use serde_json::json;
use truestage::Failure;
use truestage::runs::{Person, Question, Told};

use super::Keeper;
use super::seat::Task;
use super::stop::stopped_by;
use crate::problem::{Code, Problem};
use crate::request::AnswerRequest;
use crate::view::{QuestionView, ToldView};

/// The longest line that is an answer, in characters.
const ANSWER_MAX: usize = 200;

/// How a question is answered here.
const ANSWERED: &str = "this is answered";

/// What passes between a procedure that asks and whoever answers.
#[derive(Debug, Default)]
pub(super) struct Talk {
    /// Asked, and not told yet: since the last tick, or other axes still slow down.
    asked: Option<Question>,
    answer: Option<String>,
    /// What the next question begins with; without one, what the run says at its end.
    said: Vec<String>,
    /// Points that were reached since the last tick.
    reached: Vec<Told>,
}

/// The person of a procedure: whoever answers its run.
pub(crate) struct Asker(Rc<RefCell<Talk>>);

impl Person for Asker {
    fn ask(&mut self, mut question: Question) -> Result<(), Failure> {
        let mut talk = self.0.borrow_mut();
        let said = core::mem::take(&mut talk.said);
        let text = said
            .into_iter()
            .chain([core::mem::take(&mut question.text)]);
        let text = text.collect::<Vec<_>>().join("\n");
        talk.answer = None;
        question.text = text;
        talk.asked = Some(question);
        Ok(())
    }

    fn answer(&mut self) -> Result<Option<String>, Failure> {
        Ok(self.0.borrow_mut().answer.take())
    }

    fn tell(&mut self, text: &str) {
        self.0.borrow_mut().said.push(text.to_owned());
    }

    fn reached(&mut self, point: Told) {
        self.0.borrow_mut().reached.push(point);
    }
}

impl Keeper {
    /// The person of the procedure that begins.
    pub(crate) fn asker(&mut self) -> Asker {
        *self.talk.borrow_mut() = Talk::default();
        Asker(Rc::clone(&self.talk))
    }

    /// Points that were reached since the last tick are told, each by an event of its own.
    pub(super) fn take_reached(&mut self) {
        let reached = core::mem::take(&mut self.talk.borrow_mut().reached);
        for point in reached {
            let Some(run) = self.runs.under_way() else {
                return;
            };
            let id = run.view.id.clone();
            run.view.reached.push(point.text.clone());
            self.events.push("point", &id, json!(ToldView::from(point)));
        }
    }

    /// What the person was told since the last question is part of the run as soon as it was.
    pub(super) fn show_said(&mut self) {
        let Some(run) = self.runs.running() else {
            return;
        };
        let talk = self.talk.borrow();
        if run.view.said.len() != talk.said.len() {
            let (id, said) = (run.view.id.clone(), talk.said.clone());
            drop(talk);
            self.change_run(&id, |view| view.said = said);
        }
    }

    /// What was asked since the last tick becomes part of the run. What is to be done by hand is asked when everything
    /// else stands and is switched off, too.
    pub(super) fn take_question(&mut self, machine: &mut Machine) -> Result<(), machine::Failure> {
        let Some(by_hand) = self.talk.borrow().asked.as_ref().map(|it| it.by_hand) else {
            return Ok(());
        };
        if !by_hand || self.clear_for_hands(machine)? {
            self.put_question();
        }
        Ok(())
    }

    fn put_question(&mut self) {
        let Some(question) = self.talk.borrow_mut().asked.take() else {
            return;
        };
        let Some(run) = self.runs.running_mut() else {
            return;
        };
        run.asked += 1;
        // What is read by hand is asked line by line: hands are there in between, too.
        run.has_hands = question.by_hand && question.takes_text;
        let safety = question.warning(ANSWERED).unwrap_or_default();
        let question = QuestionView {
            safety,
            number: run.asked,
            what: question.what.to_owned(),
            text: question.text,
            answers: question.answers.iter().map(|it| (*it).to_owned()).collect(),
            takes_text: question.takes_text,
            by_hand: question.by_hand,
            task: question.task,
        };
        let (id, data) = (run.view.id.clone(), json!(question));
        run.view.question = Some(question);
        self.events.push("question", &id, data);
    }

    /// Stops and switches off what the run that asks does not have; whether all of that is done.
    fn clear_for_hands(&mut self, machine: &mut Machine) -> Result<bool, machine::Failure> {
        let Some(id) = self.runs.running().map(|it| it.view.id.clone()) else {
            return Ok(true);
        };
        self.stop_motions(
            machine,
            &stopped_by(format!("run {id} (hands in the machine)")),
        );
        for seat in self.seats.iter_mut().filter(|it| it.is_free()) {
            if seat.is_enabled(machine) {
                Driving::of(machine, &seat.name)?.disable();
                seat.task = Task::Power(None);
            }
        }
        let is_cleared = |seat: &super::Seat| seat.is_free() || seat.is_of(&id);
        Ok(self.motions.is_empty() && self.seats.iter().all(is_cleared))
    }

    /// Refuses what moves an axis, or switches one on, while a run has asked for something that is done by hand.
    pub(super) fn require_no_hands(&self) -> Result<(), Problem> {
        let talk = self.talk.borrow();
        let is_next = talk.asked.as_ref().is_some_and(|it| it.by_hand);
        drop(talk);
        let Some(run) = self.runs.running() else {
            return Ok(());
        };
        let number = match &run.view.question {
            Some(question) if question.by_hand => question.number,
            _ if is_next => run.asked + 1,
            None if run.has_hands => run.asked,
            _ => return Ok(()),
        };
        let what = format!(
            "run {} asks for something that is done by hand (question {number}): hands may be in the machine",
            run.view.id
        );
        let help = "wait until it is answered, or end the run";
        Err(Problem::new(Code::AxisBusy, what, help))
    }

    /// What a person was told after the last question.
    pub(super) fn take_said(&mut self) -> Vec<String> {
        let mut talk = self.talk.borrow_mut();
        // What nobody was asked will not be.
        talk.asked = None;
        core::mem::take(&mut talk.said)
    }

    /// Answers what the run `id` asks. `text` is whether who answers may say more than its words.
    pub(super) fn answer_run(
        &mut self,
        id: &str,
        by: &str,
        given: &AnswerRequest,
        text: Result<(), Problem>,
    ) -> Result<(), Problem> {
        let run = self.runs.find(id)?;
        let answer = given.answer.trim();
        // Whoever did not hear that it was taken says it again.
        if run.answered.as_ref() == Some(&(given.question, answer.to_owned())) {
            return Ok(());
        }
        let Some(question) = &run.view.question else {
            let what = format!("`question` = {}: run {id} asks nothing now", given.question);
            return Err(Problem::new(Code::NotAsked, what, "look what it does"));
        };
        if question.number != given.question {
            let (seen, asked) = (given.question, question.number);
            let what = format!("`question` = {seen}: run {id} asks question {asked} now");
            let help = format!("answer what is asked: {}", question.text);
            return Err(Problem::new(Code::NotAsked, what, help));
        }
        let is_a_word = question.answers.iter().any(|it| it == answer);
        let is_line = (1..=ANSWER_MAX).contains(&answer.chars().count())
            && !answer.chars().any(char::is_control);
        let is_text = question.takes_text && is_line;
        if !is_a_word && !is_text {
            let words = question.answers.join(", ");
            let what = format!(
                "`answer` = {answer:?} does not answer question {}",
                question.number
            );
            return Err(Problem::new(Code::NotAsked, what, format!("say {words}")));
        }
        if !is_a_word {
            text?;
        }
        let data = json!({"number": question.number, "answer": answer, "by": by});
        run.answered = Some((question.number, answer.to_owned()));
        run.view.question = None;
        self.talk.borrow_mut().answer = Some(answer.to_owned());
        self.events.push("question", id, data);
        Ok(())
    }
}
