//! Files of what was measured or designed elsewhere, as a request has them.

use serde::{Deserialize, Serialize};
use truestage::runs::DataFile;
use utoipa::ToSchema;

use crate::problem::{Code, Problem};

/// A file of data.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct GivenFile {
    /// What it is called in what is said of it.
    #[schema(min_length = 1, max_length = 200, example = "at-0.csv")]
    pub name: String,
    /// What stands in it.
    #[schema(max_length = 1000000)]
    pub text: String,
}

/// What a file may be called, in characters.
const NAME_MAX: usize = 200;

impl GivenFile {
    /// # Errors
    /// A name that nobody could print.
    pub(crate) fn checked(&self) -> Result<DataFile, Problem> {
        let length = self.name.chars().count();
        if !(1..=NAME_MAX).contains(&length) || self.name.chars().any(char::is_control) {
            let what = format!("`files[].name` = {:?} names no file", self.name);
            let help = format!("give 1 to {NAME_MAX} characters without control characters");
            return Err(Problem::new(Code::Refused, what, help));
        }
        Ok(DataFile {
            name: self.name.clone(),
            text: self.text.clone(),
        })
    }
}
