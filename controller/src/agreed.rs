//! What a move may do without once somebody has agreed to it.

/// What whoever asks for a move agrees to. Nothing by default: to a place whose deviation nobody has measured, or
/// nobody corrects, a machine does not go unasked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Agreed {
    /// Without compensation: to the target by the encoders alone, whether there is a calibration or not.
    pub uncompensated: bool,
    /// Beyond the calibrated range, where what was measured at its end is all there is.
    pub beyond: bool,
}
