//! An incremental encoder: it counts from wherever its power came on.

/// Positions are those of its scale.
#[derive(Clone, Debug)]
pub(super) struct Encoder {
    resolution_m: f64,
    /// Where its power came on, in counts of the scale.
    power_on_count: i64,
    powered: bool,
}

impl Encoder {
    /// Powered with the scale at `scale_m`.
    pub(super) fn new(resolution_nm: f64, scale_m: f64) -> Self {
        let resolution_m = resolution_nm * 1e-9;
        Self {
            resolution_m,
            power_on_count: (scale_m / resolution_m).round() as i64,
            powered: true,
        }
    }

    pub(super) const fn resolution_m(&self) -> f64 {
        self.resolution_m
    }

    /// Loses or gets its power with the scale at `scale_m`; true when the count is a new one.
    pub(super) fn power(&mut self, on: bool, scale_m: f64) -> bool {
        let comes_on = on && !self.powered;
        if comes_on {
            self.power_on_count = (scale_m / self.resolution_m).round() as i64;
        }
        self.powered = on;
        comes_on
    }

    /// The count with the scale at `scale_m`; 0 without power.
    pub(super) fn counts(&self, scale_m: f64) -> i64 {
        if !self.powered {
            return 0;
        }
        (scale_m / self.resolution_m).round() as i64 - self.power_on_count
    }

    /// Where on the scale the count is 0.
    pub(super) fn count_zero_m(&self) -> f64 {
        self.power_on_count as f64 * self.resolution_m
    }
}
