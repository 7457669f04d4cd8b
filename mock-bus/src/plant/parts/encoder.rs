//! An incremental encoder: it counts from wherever its power came on. Its scale is one of metres
//! or, in a rotary axis, of radians.

/// Positions are those of its scale.
#[derive(Clone, Debug)]
pub(in crate::plant) struct Encoder {
    resolution: f64,
    /// Where its power came on, in counts of the scale.
    power_on_count: i64,
    powered: bool,
}

impl Encoder {
    /// Powered with the scale at `scale`; a count is `resolution`.
    pub(in crate::plant) fn new(resolution: f64, scale: f64) -> Self {
        Self {
            resolution,
            power_on_count: (scale / resolution).round() as i64,
            powered: true,
        }
    }

    pub(in crate::plant) const fn resolution(&self) -> f64 {
        self.resolution
    }

    /// Loses or gets its power with the scale at `scale`; true when the count is a new one.
    pub(in crate::plant) fn power(&mut self, on: bool, scale: f64) -> bool {
        let comes_on = on && !self.powered;
        if comes_on {
            self.power_on_count = (scale / self.resolution).round() as i64;
        }
        self.powered = on;
        comes_on
    }

    /// The count with the scale at `scale`; 0 without power.
    pub(in crate::plant) fn counts(&self, scale: f64) -> i64 {
        if !self.powered {
            return 0;
        }
        (scale / self.resolution).round() as i64 - self.power_on_count
    }

    /// Where on the scale the count is 0.
    pub(in crate::plant) fn count_zero(&self) -> f64 {
        self.power_on_count as f64 * self.resolution
    }
}
