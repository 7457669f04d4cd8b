//! The mean of samples that come one by one.

/// Mean and standard uncertainty of the mean.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::volumetric) struct Mean {
    count: f64,
    sum: f64,
    squares: f64,
}

impl Mean {
    pub(in crate::volumetric) fn add(&mut self, value: f64) {
        self.count += 1.0;
        let before = self.sum;
        self.sum += value;
        if self.count > 1.0 {
            // Welford's update: what the value is off the mean before and after it.
            let old = before / (self.count - 1.0);
            self.squares += (value - old) * (value - self.mean());
        }
    }

    pub(in crate::volumetric) fn mean(&self) -> f64 {
        self.sum / self.count
    }

    /// The mean, once there is a value.
    #[cfg(feature = "program")]
    pub(in crate::volumetric) fn known(&self) -> Option<f64> {
        (self.count > 0.0).then(|| self.mean())
    }

    pub(in crate::volumetric) fn u(&self) -> f64 {
        if self.count < 2.0 {
            return 0.0;
        }
        (self.squares / (self.count - 1.0) / self.count).sqrt()
    }
}

/// The noise of single samples, by means that were taken at many places.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::volumetric) struct Noise {
    squares: f64,
    freedom: f64,
}

impl Noise {
    pub(in crate::volumetric) fn add(&mut self, mean: &Mean) {
        self.squares += mean.squares;
        self.freedom += (mean.count - 1.0).max(0.0);
    }

    /// The standard uncertainty of the mean of so many samples; nothing before two were taken at one place.
    pub(in crate::volumetric) fn u_of_mean(&self, samples: u32) -> f64 {
        if self.freedom < 1.0 || samples == 0 {
            return 0.0;
        }
        (self.squares / self.freedom / f64::from(samples)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_knows_how_sure_it_is() {
        let mut mean = Mean::default();
        for value in [1.0, 2.0, 3.0, 4.0] {
            mean.add(value);
        }
        assert!((mean.mean() - 2.5).abs() < 1e-15);
        // s² = 5/3, of the mean a quarter.
        assert!((mean.u() - (5.0_f64 / 12.0).sqrt()).abs() < 1e-15);
    }

    /// About 2 and about 10: what the places differ by is no noise.
    #[test]
    fn noise_is_of_samples_about_their_own_mean() {
        let mut noise = Noise::default();
        assert_eq!(noise.u_of_mean(4).to_bits(), 0.0_f64.to_bits());
        for values in [[1.0, 2.0, 3.0], [9.0, 10.0, 11.0]] {
            let mut mean = Mean::default();
            values.into_iter().for_each(|it| mean.add(it));
            noise.add(&mean);
        }
        // Four squares of 1, four degrees of freedom.
        assert!((noise.u_of_mean(4) - 0.5).abs() < 1e-15);
    }
}
