//! What a terminal is given to show: files, devices and services may say what it would obey.

/// Nothing that a terminal would obey, but for the ends of lines and what lines are made up with.
pub(crate) fn plain(text: &str) -> String {
    text.chars()
        .filter(|it| !it.is_control() || matches!(it, '\n' | '\t'))
        // What turns the direction of a line round.
        .filter(|it| !matches!(it, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}'))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_file_says_clears_no_screen_and_names_no_window() {
        let heading = "run\u{1b}[2J\tapproach\u{1b}]0;owned\u{7}\u{9b}31m\nx";
        assert_eq!(plain(heading), "run[2J\tapproach]0;owned31m\nx");
    }
}
