//! The rows of a path, as a request has them: a text as a file has it, or a table.

use std::borrow::Cow;
use std::fmt::Write as _;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::problem::{Code, Problem};

/// The rows of a path: a heading, and a row for each moment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(
    untagged,
    expecting = "the rows of a path: CSV as a text, or {\"columns\": [\"time_s\", …], \"rows\": [[0, …], …]}"
)]
pub enum PathRows {
    /// CSV, as `truestage run` takes it from a file.
    #[schema(example = "time_s,x_mm,y_mm,z_mm\n0,10,10,10\n1,20,10,10")]
    Csv(String),
    /// The same as a table.
    Table(PathTable),
}

/// The rows of a path, as numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct PathTable {
    /// What each column is, with its unit: `time_s`, `x_mm`, `y_mm`, `z_mm`.
    #[schema(min_items = 2, max_items = 16)]
    pub columns: Vec<String>,
    /// What joins the rows, as `join` of the run says it: `spline`, or `linear 50um`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 100, example = "linear 50um")]
    pub join: Option<String>,
    /// A number for each column, in each row. The first row is line 2 in what is said of them.
    #[schema(min_items = 2, max_items = 100000)]
    pub rows: Vec<Vec<f64>>,
}

impl From<String> for PathRows {
    fn from(text: String) -> Self {
        Self::Csv(text)
    }
}

impl PathRows {
    /// As a file has them.
    ///
    /// # Errors
    /// A table that is none.
    pub(crate) fn csv(&self) -> Result<Cow<'_, str>, Problem> {
        match self {
            Self::Csv(text) => Ok(Cow::Borrowed(text)),
            Self::Table(table) => table.csv().map(Cow::Owned),
        }
    }

    /// What a table says that joins them.
    pub(crate) fn join(&self) -> Option<&str> {
        match self {
            Self::Csv(_) => None,
            Self::Table(table) => table.join.as_deref(),
        }
    }
}

impl PathTable {
    fn csv(&self) -> Result<String, Problem> {
        let refused = |what: String, help: &str| Err(Problem::new(Code::Refused, what, help));
        let is_name = |it: &String| !it.is_empty() && !it.contains([',', '\n', '\r', '#', '"']);
        if let Some(other) = self.columns.iter().find(|it| !is_name(it)) {
            let what = format!("`path`: {other:?} is the name of no column");
            return refused(what, "the columns are time_s, x_mm, y_mm, z_mm");
        }
        let mut text = self.columns.join(",");
        text.push('\n');
        for (number, row) in (1..).zip(&self.rows) {
            if row.len() != self.columns.len() {
                let (seen, expected) = (row.len(), self.columns.len());
                let what = format!("`path`, row {number}: {seen} numbers for {expected} columns");
                return refused(what, "give a number for each column");
            }
            for (at, value) in row.iter().enumerate() {
                let comma = if at == 0 { "" } else { "," };
                // Nothing is lost: the shortest text that is read as the same number.
                let _ = write!(text, "{comma}{value}");
            }
            text.push('\n');
        }
        Ok(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(json: &str) -> Result<String, String> {
        let rows: PathRows = serde_json::from_str(json).map_err(|it| it.to_string())?;
        let csv = rows.csv().map_err(|it| it.to_string())?;
        Ok(csv.into_owned())
    }

    #[test]
    fn a_table_is_the_text_that_a_file_has() {
        let text = "time_s,x_mm\n0,10\n0.1,-20.125\n";
        let table = r#"{"columns": ["time_s", "x_mm"], "rows": [[0, 10.0], [1e-1, -20.125]]}"#;
        assert_eq!(read(table).unwrap(), text);
        assert_eq!(read(&serde_json::json!(text).to_string()).unwrap(), text);
        let joined = table.replacen('{', r#"{"join": "linear 50um", "#, 1);
        assert_eq!(read(&joined).unwrap(), text);
        let joined: PathRows = serde_json::from_str(&joined).unwrap();
        assert_eq!(joined.join(), Some("linear 50um"));
    }

    #[test]
    fn what_is_no_table_is_refused_with_what_one_is() {
        for (json, said) in [
            (
                r#"{"columns": ["a"], "rows": [[1, 2]]}"#,
                "row 1: 2 numbers for 1",
            ),
            (r#"{"columns": ["a\n0"], "rows": []}"#, "no column"),
            (r#"{"columns": ["a"], "rows": [["1"]]}"#, "columns"),
            (r#"{"rows": []}"#, "CSV as a text"),
            ("[[0, 1]]", "CSV as a text"),
        ] {
            let refused = read(json).unwrap_err();
            assert!(refused.contains(said), "{json}: {refused}");
        }
    }
}
