//! Edits of the text of a machine's file that must not miss their place.

/// A text in which a passage is replaced. An edit that matches nothing would leave the text as it
/// is, and the caller would then use a machine that was not meant.
pub trait Edit {
    /// The text with every `from` become `to`.
    ///
    /// # Panics
    /// When there is no `from` in it.
    #[must_use]
    #[track_caller]
    fn edit(&self, from: &str, to: &str) -> String;

    /// The text with the first `from` become `to`.
    ///
    /// # Panics
    /// When there is no `from` in it.
    #[must_use]
    #[track_caller]
    fn edit_first(&self, from: &str, to: &str) -> String;
}

impl Edit for str {
    fn edit(&self, from: &str, to: &str) -> String {
        assert!(self.contains(from), "`{from}` is not in the text");
        self.replace(from, to)
    }

    fn edit_first(&self, from: &str, to: &str) -> String {
        assert!(self.contains(from), "`{from}` is not in the text");
        self.replacen(from, to, 1)
    }
}

/// The text of a machine file with the shipped heartbeats made rare: hours without SYNC cost little in
/// virtual time then.
///
/// # Panics
/// When one of them is not in the text.
pub fn with_rare_heartbeats(text: &str) -> String {
    text.edit("master_heartbeat_ms = 50", "master_heartbeat_ms = 2000")
        .edit("heartbeat_producer_ms = 50", "heartbeat_producer_ms = 2000")
        .edit(
            "heartbeat_consumer_ms = 150",
            "heartbeat_consumer_ms = 7000",
        )
        .edit("watch_master_ms = 500", "watch_master_ms = 7000")
}

#[cfg(test)]
mod tests {
    use super::Edit;

    #[test]
    fn every_passage_or_the_first_is_exchanged() {
        assert_eq!("a = 1, b = 1".edit("= 1", "= 2"), "a = 2, b = 2");
        assert_eq!("a = 1, b = 1".edit_first("= 1", "= 2"), "a = 2, b = 1");
    }

    #[test]
    #[should_panic(expected = "`= 3` is not in the text")]
    fn an_edit_that_matches_nothing_fails() {
        let _ = "a = 1, b = 1".edit("= 3", "= 2");
    }

    #[test]
    #[should_panic(expected = "`= 3` is not in the text")]
    fn an_edit_of_the_first_that_matches_nothing_fails() {
        let _ = "a = 1, b = 1".edit_first("= 3", "= 2");
    }
}
