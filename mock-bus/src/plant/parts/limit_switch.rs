//! A limit switch: it acts a little elsewhere each time.

use crate::random::Stream;

use crate::plant::config::LimitConfig;

#[derive(Clone, Debug)]
pub(in crate::plant) struct LimitSwitch {
    /// +1 for the positive end, -1 for the negative one.
    side: f64,
    /// Distance from zero, along its side.
    at_m: f64,
    config: LimitConfig,
    jitter_m: f64,
    pressed: bool,
    pub(in crate::plant) forced: Option<bool>,
    stream: Stream,
}

impl LimitSwitch {
    /// The negative and the positive one; `whose` begins the names of their random streams.
    pub(in crate::plant) fn pair(config: &LimitConfig, seed: u64, whose: &str) -> [Self; 2] {
        let switch = |side: f64, at_mm: f64, name| Self {
            side,
            at_m: side * at_mm * 1e-3,
            config: config.clone(),
            jitter_m: 0.0,
            pressed: false,
            forced: None,
            stream: Stream::new(seed, &format!("{whose}{name}")),
        };
        [
            switch(-1.0, config.negative_mm, "negative limit"),
            switch(1.0, config.positive_mm, "positive limit"),
        ]
    }

    /// Whether it may change its state here, where the true place is within `error_m` of what the
    /// encoder shows; saves looking closer.
    pub(in crate::plant) fn is_near(&self, encoder_m: f64, error_m: f64) -> bool {
        const MARGIN_M: f64 = 1e-6;
        let beyond_m = self.side * encoder_m - self.at_m - self.jitter_m;
        if self.pressed {
            beyond_m < error_m + MARGIN_M - self.config.hysteresis_um * 1e-6
        } else {
            beyond_m > -error_m - MARGIN_M
        }
    }

    pub(in crate::plant) fn watch(&mut self, true_m: f64) {
        let beyond_m = self.side * true_m - self.at_m - self.jitter_m;
        if !self.pressed && beyond_m >= 0.0 {
            self.pressed = true;
        } else if self.pressed && beyond_m < -self.config.hysteresis_um * 1e-6 {
            self.pressed = false;
            let limit_m = self.config.repeatability_um * 1e-6;
            self.jitter_m = self.stream.between(-limit_m, limit_m);
        }
    }

    pub(in crate::plant) fn is_pressed(&self) -> bool {
        self.forced.unwrap_or(self.pressed)
    }
}
