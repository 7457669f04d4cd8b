//! What a calibration is called.

/// A calibration's name, short enough to read.
pub fn short(id: &str) -> String {
    id.chars().take(12).collect()
}
