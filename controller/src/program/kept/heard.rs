//! What a run says to a person without a question: told at once, and once.

use serde_json::{Value, json};

use crate::program::exchange::plain;
use crate::program::output::Output;

/// What was told since the last question.
#[derive(Debug, Default)]
pub(super) struct Heard(Vec<String>);

impl Heard {
    /// Tells what `run` has said since.
    pub(super) fn tell(&mut self, run: &Value, output: Output) {
        for text in self.news(run) {
            output.must_say(&format!("> {}", plain(&text)));
        }
    }

    fn news(&mut self, run: &Value) -> Vec<String> {
        let said = run["said"].as_array().into_iter().flatten();
        let said: Vec<String> = said.filter_map(|it| it.as_str().map(Into::into)).collect();
        // A question has begun with what was said before it.
        let known = match said.starts_with(&self.0) {
            true => self.0.len(),
            false => 0,
        };
        let news = said[known..].to_vec();
        self.0 = said;
        news
    }

    /// The question without what it begins with that was told already.
    pub(super) fn unheard(&self, question: &Value) -> Value {
        let mut question = question.clone();
        if let Some(text) = question["text"].as_str() {
            let told = self.0.iter().fold(text, |text, told| {
                let rest = text.strip_prefix(told.as_str());
                rest.and_then(|it| it.strip_prefix('\n')).unwrap_or(text)
            });
            question["text"] = json!(told);
        }
        question
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_is_told_once_also_where_a_question_begins_with_it() {
        let mut heard = Heard::default();
        let question = json!({"number": 2, "text": "a\nb\nset it up"});
        assert_eq!(heard.news(&json!({"said": ["a"]})), ["a"]);
        assert_eq!(heard.news(&json!({"said": ["a", "b"]})), ["b"]);
        assert_eq!(heard.news(&json!({"said": ["a", "b"]})), [""; 0]);
        assert_eq!(heard.unheard(&question)["text"], "set it up");
        assert_eq!(heard.news(&json!({"said": []})), [""; 0]);
        assert_eq!(heard.news(&json!({"said": ["a"]})), ["a"]);
        assert_eq!(heard.unheard(&question)["text"], "b\nset it up");
        assert_eq!(heard.unheard(&Value::Null), Value::Null);
    }
}
