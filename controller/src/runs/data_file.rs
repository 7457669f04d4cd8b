//! What was measured or designed elsewhere, and is given to a run as a file.

/// A file of data: what it is called, and what stands in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DataFile {
    /// What errors call it.
    pub name: String,
    /// What stands in it.
    pub text: String,
}
