//! What a person types.

use units::{Approach, Radians, text};

/// What may be typed in place of a value.
pub(super) const WORDS: &str = "none: the line cannot be read; again: the line before; again 17: line 17 of this pass; again 17 1-: \
     that of pass 1-; stop: what was read is kept, go on with --resume";

/// A line of a pass that was read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) pass: u32,
    pub(super) approach: Approach,
    pub(super) line: u32,
}

/// An answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Answer {
    Value(Radians),
    /// The line cannot be read.
    Unreadable,
    /// The line before is to be read again.
    Before,
    /// This line, of this pass where no other is named.
    Again {
        line: u32,
        pass: Option<(u32, Approach)>,
    },
    /// The placement is given up.
    Discard,
    /// Enough for now.
    Stop,
    /// Only Enter.
    Enter,
}

/// Reads an answer.
///
/// # Errors
/// What it should look like.
pub(super) fn parse(typed: &str) -> Result<Answer, String> {
    let words: Vec<&str> = typed.split_whitespace().collect();
    match words.as_slice() {
        [] => Ok(Answer::Enter),
        ["none"] => Ok(Answer::Unreadable),
        ["stop"] => Ok(Answer::Stop),
        ["discard"] => Ok(Answer::Discard),
        ["again"] => Ok(Answer::Before),
        ["again", line] => again(line, None),
        ["again", line, pass] => again(line, Some(pass)),
        _ => value(typed.trim()),
    }
}

fn again(line: &str, pass: Option<&str>) -> Result<Answer, String> {
    let line = line.parse();
    let line = line.map_err(|_| "write `again` and the number of a line: again 17".to_owned())?;
    let pass = pass.map(named_pass).transpose()?;
    Ok(Answer::Again { line, pass })
}

fn named_pass(text: &str) -> Result<(u32, Approach), String> {
    let parsed = match text.strip_suffix('+') {
        Some(number) => number.parse().map(|it| (it, Approach::Forward)),
        None => text
            .strip_suffix('-')
            .unwrap_or("")
            .parse()
            .map(|it| (it, Approach::Reverse)),
    };
    parsed.map_err(|_| format!("`{text}` is not a pass; passes are called 1+, 1-, 2+"))
}

fn value(typed: &str) -> Result<Answer, String> {
    if let Some(angle) = text::angle(typed) {
        return Ok(Answer::Value(angle));
    }
    let seen = match typed.contains(',') {
        true => "has a comma: write a decimal point",
        false if typed.parse::<f64>().is_ok() => "has no unit",
        false => "is not an angle",
    };
    Err(format!(
        "`{typed}` {seen}; write a number with its unit (12.3arcsec, -0.25arcmin, 73.0034deg), or one of \
         these words. {WORDS}"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_typed_is_a_value_with_its_unit_or_one_of_a_few_words() {
        let arcsec = |it| Ok(Answer::Value(Radians::from_arcsec(it)));
        let near = |typed: &str, expected: f64| {
            let Ok(Answer::Value(seen)) = parse(typed) else {
                panic!("{typed}: {:?}", parse(typed))
            };
            assert!((seen.arcsec() - expected).abs() < 1e-9, "{typed}: {seen:?}");
        };
        near("12.3arcsec", 12.3);
        near(" -0.25 arcmin ", -15.0);
        near("73.0034deg", 262_812.24);
        assert_eq!(parse("0arcsec"), arcsec(0.0));
        assert_eq!(parse("  "), Ok(Answer::Enter));
        assert_eq!(parse("again"), Ok(Answer::Before));
        let again = |line, pass| Ok(Answer::Again { line, pass });
        assert_eq!(parse("again 17"), again(17, None));
        assert_eq!(
            parse("again 17 1-"),
            again(17, Some((1, Approach::Reverse)))
        );
        assert_eq!(
            parse("again 0 12+"),
            again(0, Some((12, Approach::Forward)))
        );
        assert_eq!(parse("none"), Ok(Answer::Unreadable));
    }

    #[test]
    fn what_means_nothing_is_told_with_what_would() {
        for (typed, says) in [
            ("12.3", "has no unit"),
            ("12,3arcsec", "decimal point"),
            ("12.3mm", "is not an angle"),
            ("nanarcsec", "is not an angle"),
            ("again x", "the number of a line"),
            ("again 17 1", "passes are called 1+"),
            ("again 17 -", "passes are called 1+"),
            ("again 17 1- 2", "is not an angle"),
        ] {
            let why = parse(typed).unwrap_err();
            assert!(why.contains(says), "{typed}: {why}");
        }
    }
}
