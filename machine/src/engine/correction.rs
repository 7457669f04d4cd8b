//! What is added to the path so that the tool goes where the path says: limited, never a step.
//!
//! A [`Correction`] says what is right now; how that reaches the set-points is decided here.
//! Size and rate are limited ([`SlewedCorrection`]), enabling, disabling and another correction
//! are slewed, and one that has nothing to say is held or faded out. The slope along an axis is
//! proved where a table is loaded; at run time the rate is its limit times the speed.

use core::any::Any;
use core::time::Duration;

use compensator::apply::{Alarm, SlewedCorrection};
use compensator::volumetric::online::Spot;
use units::{Celsius, Metres, Time, Volts};

use super::cause::Cause;
use super::limits::CorrectionLimits;
use super::{AXES_MAX, Lack, PerAxis};

/// Analog channels that a correction sees at most.
pub const CHANNELS_MAX: usize = 32;
/// Thermometers that a correction sees at most.
pub const THERMOMETERS_MAX: usize = 32;

/// Cameras that a correction sees at most.
pub const SPOTS_MAX: usize = 8;

/// One analog channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Channel {
    /// When its sample arrived; its age is the correction's to judge.
    pub at: Time,
    /// What it says.
    pub volts: Volts,
    /// Whether the converter stood at an end of its range.
    pub saturated: bool,
}

/// One thermometer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThermometerSample {
    /// When its sample arrived.
    pub at: Time,
    /// What it says; `None` where the module says that there is none, or beyond its range.
    pub celsius: Option<Celsius>,
}

/// What a correction is computed from.
#[derive(Clone, Copy, Debug)]
pub struct Observed<'a> {
    /// Now.
    pub now: Time,
    /// Where the path wants the axes at the next SYNC.
    pub nominal: &'a [Metres],
    /// Where they were at the last SYNC.
    pub actual: &'a [Metres],
    /// The analog modules' channels, in the order of the modules' names; `None` before the
    /// first sample.
    pub channels: &'a [Option<Channel>],
    /// The thermometers of the same modules, likewise.
    pub temperatures: &'a [Option<ThermometerSample>],
    /// What each camera that is a detector showed last, in the order of the cameras' names.
    pub spots: &'a [Option<Spot>],
}

/// How far a correction can be relied upon now.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Validity {
    /// It is right.
    #[default]
    Valid,
    /// As right as it can be without this; its uncertainty says how right.
    Without(Lack),
    /// It cannot be known for the moment: the last one stays.
    Hold,
    /// It cannot be known for longer: it goes back to zero at the limited rate.
    FadeOut,
    /// The machine must not go on without it: a controlled stop, for this reason.
    Stop(&'static str),
    /// The machine must not go on without this: a controlled stop.
    Lost(Lack),
}

impl Validity {
    /// Whether what the correction says is to be added.
    const fn is_followed(&self) -> bool {
        matches!(self, Self::Valid | Self::Without(_))
    }
}

/// What a correction says.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Corrected {
    /// To be added to each axis's set-point.
    pub offset: PerAxis<Metres>,
    /// The standard uncertainty of each; counts while the correction is valid, or as valid as it can be.
    pub uncertainty: PerAxis<Metres>,
    /// Whether to do so.
    pub validity: Validity,
}

/// Computes corrections in the loop: without memory, locks or waiting.
pub trait Correction: Send {
    /// The correction for the next SYNC.
    fn correct(&mut self, observed: &Observed<'_>) -> Corrected;

    /// Itself, for the correction that takes over from it; `None` when there is nothing to be had.
    fn as_any(&self) -> Option<&dyn Any> {
        None
    }

    /// Takes over from the correction that was in use until now: what that one knows of the same
    /// detectors needs not be waited for again.
    fn take_over(&mut self, _before: &dyn Any) {}
}

/// Corrects nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoCorrection;

impl Correction for NoCorrection {
    fn correct(&mut self, _observed: &Observed<'_>) -> Corrected {
        Corrected::default()
    }
}

/// The correction in use and how far it is applied.
pub(super) struct Applied {
    correction: Box<dyn Correction>,
    slewed: PerAxis<SlewedCorrection>,
    last: Corrected,
    enabled: bool,
    /// What the slewing works towards: enabled, and not fading.
    following: bool,
    limited: u64,
    period: Duration,
    /// Periods decided, as a time: a pause between two of them must not be worth a step.
    slewed_until: Time,
}

impl Applied {
    /// Switched off.
    pub(super) fn new(
        correction: Box<dyn Correction>,
        limits: &PerAxis<CorrectionLimits>,
        period: Duration,
    ) -> Self {
        Self {
            correction,
            slewed: core::array::from_fn(|axis| {
                SlewedCorrection::new(limits[axis].size, limits[axis].rate)
            }),
            last: Corrected::default(),
            enabled: false,
            following: false,
            limited: 0,
            period,
            slewed_until: Time::ZERO,
        }
    }

    /// After a pause another correction may be wanted than before it.
    pub(super) fn begin(&mut self) {
        self.expect_jump();
    }

    /// What was added last.
    pub(super) fn current(&self) -> PerAxis<Metres> {
        core::array::from_fn(|axis| self.slewed[axis].current())
    }

    pub(super) const fn switch(&mut self, on: bool) {
        self.enabled = on;
    }

    /// Another correction from now on; the one before is handed back.
    pub(super) fn swap(&mut self, mut correction: Box<dyn Correction>) -> Box<dyn Correction> {
        self.expect_jump();
        if let Some(before) = self.correction.as_any() {
            correction.take_over(before);
        }
        core::mem::replace(&mut self.correction, correction)
    }

    pub(super) fn in_use(&self) -> Option<&dyn Any> {
        self.correction.as_any()
    }

    fn expect_jump(&mut self) {
        for slewed in &mut self.slewed {
            slewed.expect_jump();
        }
    }

    /// What the correction gives, its uncertainty not a number unless it has one to give, and whether it
    /// is followed.
    pub(super) const fn last(&self) -> (&Corrected, bool) {
        (&self.last, self.following)
    }

    /// How often a correction was cut off or could not be followed.
    pub(super) const fn limited(&self) -> u64 {
        self.limited
    }

    /// The last offset stays; how far it is from right nobody knows any more.
    const fn keep(&mut self, validity: Validity) {
        self.last.validity = validity;
        self.last.uncertainty = [Metres(f64::NAN); AXES_MAX];
    }

    /// What to add at `observed.now`; with the reason to stop, if there is one.
    pub(super) fn advance(&mut self, observed: &Observed<'_>) -> (PerAxis<Metres>, Option<Cause>) {
        let mut wanted = self.correction.correct(observed);
        if wanted.validity.is_followed() && !wanted.offset.iter().all(|it| it.is_finite()) {
            wanted.validity = Validity::Stop("its value is not a number");
        }
        let mut stop = None;
        let mut follow = self.enabled;
        match wanted.validity {
            Validity::Valid | Validity::Without(_) => {
                if !self.last.validity.is_followed() {
                    self.expect_jump();
                }
                self.last = wanted;
            }
            Validity::Hold => self.keep(Validity::Hold),
            Validity::FadeOut => {
                self.keep(Validity::FadeOut);
                follow = false;
            }
            Validity::Stop(reason) => {
                self.keep(wanted.validity);
                stop = Some(Cause::Correction { reason });
            }
            Validity::Lost(lack) => {
                self.keep(wanted.validity);
                stop = Some(Cause::CorrectionLost { lack });
            }
        }
        if core::mem::replace(&mut self.following, follow) != follow {
            for slewed in &mut self.slewed {
                if follow {
                    slewed.enable();
                } else {
                    slewed.disable();
                }
            }
        }
        self.slewed_until += self.period;
        let mut offset = [Metres::ZERO; AXES_MAX];
        for (axis, slewed) in self.slewed.iter_mut().enumerate() {
            offset[axis] = slewed.advance(self.slewed_until, self.last.offset[axis]);
            self.limited += u64::from(slewed.alarm().is_some());
        }
        // While it stops, the correction stays as it is.
        (offset, stop.filter(|_| self.enabled))
    }

    /// What of the last correction was cut off, or could not be followed in time.
    pub(super) fn alarms(&self) -> PerAxis<Option<Alarm>> {
        core::array::from_fn(|axis| self.slewed[axis].alarm())
    }
}
