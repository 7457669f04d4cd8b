//! Whether a configuration fits its bus, computed before the bus is opened.
//!
//! Every frame is counted with the most stuff bits it can need and the interframe space
//! (ISO 11898-1). Within one SYNC period the SYNC, all synchronous PDOs, and the shares of
//! heartbeats and SDO must fit, with a reserve for emergencies and repetitions: by default
//! 20 %. A PDO that comes at every n-th SYNC counts with its n-th part: its frames must yield to the
//! others, by their identifiers. Absent: the order of frames within the period.

use core::time::Duration;

use wire::can::worst_case_bits;

/// What is on one bus.
///
/// # Example
///
/// ```
/// use drivers::protocol::bus_load::BusPlan;
/// use std::time::Duration;
///
/// let four_axes = |ms| BusPlan::new(1_000_000, Duration::from_millis(ms)).with_pdos(&[8; 8]);
/// let error = four_axes(1).load().expect_err("8 PDOs of 135 bits and a SYNC of 55");
/// assert_eq!(
///     error.to_string(),
///     "bus load 114 % (limit 80 %): SYNC and PDOs of each SYNC period take 1.135ms, and it has 1ms; \
///      a SYNC period of 1.419ms would fit"
/// );
/// assert!((four_axes(2).load()?.load - 0.5675).abs() < 1e-9);
/// # Ok::<(), drivers::protocol::bus_load::BusLoadError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct BusPlan {
    /// Bits per second.
    pub bit_rate: u32,
    /// From SYNC to SYNC.
    pub sync_period: Duration,
    /// Whether SYNC carries a counter (0x1019).
    pub sync_counter: bool,
    /// Bytes of each PDO that is sent in every SYNC period.
    pub pdo_bytes: Vec<u8>,
    /// Bytes of each PDO that is sent at every n-th SYNC only, and n.
    pub seldom_pdos: Vec<(u8, u8)>,
    /// Period of each heartbeat, ours included.
    pub heartbeats: Vec<Duration>,
    /// Share of the bus kept for SDO, 0 to 1.
    pub sdo_share: f64,
    /// The load that may not be exceeded, 0 to 1.
    pub load_limit: f64,
}

impl BusPlan {
    /// A bus with nothing but SYNC on it, 80 % of which may be used.
    pub const fn new(bit_rate: u32, sync_period: Duration) -> Self {
        Self {
            bit_rate,
            sync_period,
            sync_counter: false,
            pdo_bytes: Vec::new(),
            seldom_pdos: Vec::new(),
            heartbeats: Vec::new(),
            sdo_share: 0.0,
            load_limit: 0.8,
        }
    }

    /// Adds PDOs of one node; a number above 8 counts as 8.
    #[must_use]
    pub fn with_pdos(mut self, bytes: &[u8]) -> Self {
        self.pdo_bytes.extend(bytes.iter().map(|len| (*len).min(8)));
        self
    }

    /// Adds PDOs of one node that come at every `every`-th SYNC; 0 counts as 1.
    #[must_use]
    pub fn with_seldom_pdos(mut self, bytes: &[u8], every: u8) -> Self {
        let each = bytes.iter().map(|len| ((*len).min(8), every.max(1)));
        self.seldom_pdos.extend(each);
        self
    }

    /// Adds a heartbeat.
    #[must_use]
    pub fn with_heartbeat(mut self, period: Duration) -> Self {
        self.heartbeats.push(period);
        self
    }

    /// The load of this plan.
    ///
    /// # Errors
    /// When the bit rate, the SYNC period, a heartbeat period or a share makes no sense, or
    /// when the plan does not fit; the error says which period would.
    pub fn load(&self) -> Result<BusLoad, BusLoadError> {
        self.validate()?;
        let rate = f64::from(self.bit_rate);
        let cyclic_s = (f64::from(self.cyclic_bits()) + self.seldom_bits()) / rate;
        let heartbeat_bits = f64::from(worst_case_bits(8, false));
        let beats_per_s: f64 = self
            .heartbeats
            .iter()
            .map(|period| 1.0 / period.as_secs_f64())
            .sum();
        let background = heartbeat_bits * beats_per_s / rate + self.sdo_share;
        let load = cyclic_s / self.sync_period.as_secs_f64() + background;
        let room = self.load_limit - background;
        if room <= 0.0 {
            return Err(BusLoadError::NoRoom {
                background,
                limit: self.load_limit,
            });
        }
        let shortest_period = ceil_to_microseconds(cyclic_s / room);
        let result = BusLoad {
            load,
            cyclic: Duration::from_secs_f64(cyclic_s),
            shortest_period,
        };
        if load > self.load_limit {
            return Err(BusLoadError::DoesNotFit {
                load,
                limit: self.load_limit,
                period: self.sync_period,
                cyclic: result.cyclic,
                shortest_period,
            });
        }
        Ok(result)
    }

    fn cyclic_bits(&self) -> u32 {
        let sync = worst_case_bits(if self.sync_counter { 8 } else { 0 }, false);
        self.pdo_bytes.iter().fold(sync, |bits, len| {
            bits.saturating_add(worst_case_bits(u32::from((*len).min(8)) * 8, false))
        })
    }

    /// On the average of the periods.
    fn seldom_bits(&self) -> f64 {
        let part = |(len, every): &(u8, u8)| {
            let bits = worst_case_bits(u32::from((*len).min(8)) * 8, false);
            f64::from(bits) / f64::from((*every).max(1))
        };
        self.seldom_pdos.iter().map(part).sum()
    }

    fn validate(&self) -> Result<(), BusLoadError> {
        let share = |value: f64| (0.0..=1.0).contains(&value);
        let what = if self.bit_rate == 0 {
            "bit rate is zero"
        } else if self.sync_period.is_zero() {
            "SYNC period is zero"
        } else if self.heartbeats.iter().any(Duration::is_zero) {
            "a heartbeat period is zero"
        } else if !share(self.sdo_share) || !share(self.load_limit) {
            "a share is not between 0 and 1"
        } else {
            return Ok(());
        };
        Err(BusLoadError::Senseless { what })
    }
}

fn ceil_to_microseconds(seconds: f64) -> Duration {
    Duration::from_micros((seconds * 1e6 - 1e-6).ceil() as u64)
}

/// A load that fits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BusLoad {
    /// Share of the bus that is used, 0 to 1.
    pub load: f64,
    /// How long SYNC and the PDOs of one period take on the wire; of seldom ones their part.
    pub cyclic: Duration,
    /// The shortest SYNC period that would still fit.
    pub shortest_period: Duration,
}

/// Why a plan is refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the Display text says what each field is")]
pub enum BusLoadError {
    /// Too much for the SYNC period.
    #[error(
        "bus load {:.0} % (limit {:.0} %): SYNC and PDOs of each SYNC period take {cyclic:?}, and it has {period:?}; \
         a SYNC period of {shortest_period:?} would fit",
        load * 100.0, limit * 100.0
    )]
    DoesNotFit {
        load: f64,
        limit: f64,
        period: Duration,
        cyclic: Duration,
        shortest_period: Duration,
    },
    /// Heartbeats and SDO alone are too much.
    #[error(
        "bus load: heartbeats and SDO alone take {:.0} % (limit {:.0} %)",
        background * 100.0, limit * 100.0
    )]
    NoRoom { background: f64, limit: f64 },
    /// A number that cannot be.
    #[error("bus load: {what}")]
    Senseless { what: &'static str },
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Eight bytes are 135 bits: two of them in every SYNC, or a fifth of ten.
    #[test]
    fn what_comes_at_every_fifth_sync_counts_a_fifth() {
        let bus = || BusPlan::new(1_000_000, Duration::from_millis(2));
        let seldom = bus().with_seldom_pdos(&[8; 10], 5).load().unwrap();
        let often = bus().with_pdos(&[8; 2]).load().unwrap();
        assert_eq!(seldom.cyclic, often.cyclic);
        assert_eq!(often.cyclic, Duration::from_micros(55 + 2 * 135));
    }

    fn four_axes(period_ms: u64) -> BusPlan {
        BusPlan::new(1_000_000, Duration::from_millis(period_ms)).with_pdos(&[8; 8])
    }

    #[test]
    fn four_axes_with_two_full_pdos_do_not_fit_one_millisecond_at_1_mbit() {
        let error = four_axes(1).load().unwrap_err();
        let BusLoadError::DoesNotFit {
            cyclic,
            shortest_period,
            ..
        } = error
        else {
            panic!("{error}")
        };
        assert_eq!(cyclic, Duration::from_micros(1135));
        assert_eq!(shortest_period, Duration::from_micros(1419));
        assert_eq!(
            error.to_string(),
            "bus load 114 % (limit 80 %): SYNC and PDOs of each SYNC period take 1.135ms, and it has 1ms; \
             a SYNC period of 1.419ms would fit"
        );
    }

    #[test]
    fn they_fit_two_milliseconds_at_57_percent() {
        let load = four_axes(2).load().unwrap();
        assert!((load.load - 0.5675).abs() < 1e-9, "{}", load.load);
    }

    #[test]
    fn the_shortest_period_named_does_fit() {
        let mut plan = four_axes(2).with_heartbeat(Duration::from_millis(50));
        plan.sdo_share = 0.1;
        plan.sync_period = plan.load().unwrap().shortest_period;
        assert!(plan.load().is_ok());
        plan.sync_period -= Duration::from_micros(1);
        assert!(plan.load().is_err());
    }

    #[test]
    fn heartbeats_and_sdo_count() {
        let plan = BusPlan::new(125_000, Duration::from_millis(10))
            .with_heartbeat(Duration::from_millis(100));
        // One byte: 8 + 34 + 13 + 10 = 65 bits, ten times a second; SYNC: 55 bits.
        let expected = 650.0 / 125_000.0 + 0.044;
        assert!((plan.load().unwrap().load - expected).abs() < 1e-12);
    }

    #[test]
    fn senseless_numbers_are_refused() {
        assert!(BusPlan::new(0, Duration::from_millis(1)).load().is_err());
        assert!(BusPlan::new(1, Duration::ZERO).load().is_err());
        let mut plan = four_axes(10);
        plan.sdo_share = f64::NAN;
        assert!(plan.load().is_err());
        plan.sdo_share = 0.9;
        assert!(matches!(plan.load(), Err(BusLoadError::NoRoom { .. })));
    }
}
