//! What a calibration is called.

/// A calibration's name, short enough to read.
///
/// # Example
///
/// ```
/// use machine::records::short;
///
/// assert_eq!(short("af1349b9f5f9a1a6a0404dea36dcc949"), "af1349b9f5f9");
/// ```
pub fn short(id: &str) -> String {
    id.chars().take(12).collect()
}
