//! What joins the rows of a path, and how its file says so.

use core::fmt;

use units::Metres;
use units::text::length;

/// What joins the rows of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Join {
    /// The cubic spline with continuous acceleration through all rows, at rest at both ends. At a corner it swings out.
    Spline,
    /// Straight lines. A corner is rounded as little as the axes' limits of acceleration and jerk want at the speed of
    /// the rows, and passed within `blend` at most; the path speeds up along its first line and slows down along
    /// its last one.
    Linear {
        /// How far from a corner it may pass.
        blend: Metres,
    },
}

impl fmt::Display for Join {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Spline => f.write_str("spline"),
            Self::Linear { blend } => write!(f, "linear {}um", units::Short(blend.um())),
        }
    }
}

/// What a comment before the heading begins with that says it.
const MARK: &str = "join:";

impl Join {
    /// As the comment `# join: spline` or `# join: linear 50um` says it; `None` for any other comment.
    ///
    /// # Errors
    /// When it says something else.
    pub(super) fn of_comment(text: &str) -> Option<Result<Self, ()>> {
        let said = text.trim_start_matches('#').trim().strip_prefix(MARK)?;
        Some(Self::of_text(said).ok_or(()))
    }

    /// What `spline` or `linear 50um` says; `None` for anything else.
    pub fn of_text(said: &str) -> Option<Self> {
        let mut words = said.split_whitespace();
        match (words.next(), words.next(), words.next()) {
            (Some("spline"), None, _) => Some(Self::Spline),
            (Some("linear"), Some(blend), None) => {
                let blend = length(blend).filter(|it| it.value() > 0.0)?;
                Some(Self::Linear { blend })
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comment_says_what_joins_rows_and_a_join_is_written_as_it_is_read() {
        for (text, expected) in [
            ("# join: spline", Some(Ok(Join::Spline))),
            (
                "#join:linear   50um",
                Some(Ok(Join::Linear {
                    blend: Metres::from_um(50.0),
                })),
            ),
            ("# join: linear", Some(Err(()))),
            ("# join: linear 50", Some(Err(()))),
            ("# join: linear 0um", Some(Err(()))),
            ("# join: linear -1um", Some(Err(()))),
            ("# join: linear 1um 2um", Some(Err(()))),
            ("# join: circles", Some(Err(()))),
            ("# joined by hand", None),
        ] {
            assert_eq!(Join::of_comment(text), expected, "{text}");
            if let Some(Ok(join)) = expected {
                assert_eq!(Join::of_text(&join.to_string()), Some(join));
            }
        }
    }
}
