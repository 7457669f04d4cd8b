//! A second spot beside that of a beam.

/// A second spot, of a beam that a face of an optic has thrown back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Reflection {
    /// Where it is from the beam's own spot, across.
    pub(crate) off_m: [f64; 2],
    /// Its light by that of the beam's own spot.
    pub(crate) share: f64,
}
