//! What a run asks a person, and the answer.

use std::cell::RefCell;
use std::rc::Rc;

use serde_json::json;
use truestage::Failure;
use truestage::runs::{Person, Question};

use super::Keeper;
use crate::problem::{Code, Problem};
use crate::request::AnswerRequest;
use crate::view::QuestionView;

/// The longest line that is an answer, in characters.
const ANSWER_MAX: usize = 200;

/// What passes between a procedure that asks and whoever answers.
#[derive(Debug, Default)]
pub(super) struct Talk {
    /// Asked since the last tick.
    asked: Option<Question>,
    answer: Option<String>,
    /// What the next question begins with.
    said: Vec<String>,
}

/// The person of a procedure: whoever answers its run.
pub(crate) struct Asker(Rc<RefCell<Talk>>);

impl Person for Asker {
    fn ask(&mut self, question: Question) -> Result<(), Failure> {
        let mut talk = self.0.borrow_mut();
        let said = core::mem::take(&mut talk.said);
        let text = said.into_iter().chain([question.text]);
        let text = text.collect::<Vec<_>>().join("\n");
        talk.answer = None;
        talk.asked = Some(Question { text, ..question });
        Ok(())
    }

    fn answer(&mut self) -> Result<Option<String>, Failure> {
        Ok(self.0.borrow_mut().answer.take())
    }

    fn tell(&mut self, text: &str) {
        self.0.borrow_mut().said.push(text.to_owned());
    }
}

impl Keeper {
    /// The person of the procedure that begins.
    pub(crate) fn asker(&mut self) -> Asker {
        *self.talk.borrow_mut() = Talk::default();
        Asker(Rc::clone(&self.talk))
    }

    /// What was asked since the last tick becomes part of the run.
    pub(super) fn take_question(&mut self) {
        let Some(question) = self.talk.borrow_mut().asked.take() else {
            return;
        };
        let Some(run) = self.runs.under_way() else {
            return;
        };
        run.asked += 1;
        let question = QuestionView {
            number: run.asked,
            what: question.what.to_owned(),
            text: question.text,
            answers: question.answers.iter().map(|it| (*it).to_owned()).collect(),
            takes_text: question.takes_text,
            task: question.task,
        };
        let (id, data) = (run.view.id.clone(), json!(question));
        run.view.question = Some(question);
        self.events.push("question", &id, data);
    }

    /// Answers what the run `id` asks.
    pub(super) fn answer_run(
        &mut self,
        id: &str,
        by: &str,
        given: &AnswerRequest,
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
        let data = json!({"number": question.number, "answer": answer, "by": by});
        run.answered = Some((question.number, answer.to_owned()));
        run.view.question = None;
        self.talk.borrow_mut().answer = Some(answer.to_owned());
        self.events.push("question", id, data);
        Ok(())
    }
}
