//! How an interferometer is used.

use core::time::Duration;
use units::Metres;
use wire::umd2::{DEFAULT_SAMPLE_RATE_HZ, VACUUM_WAVELENGTH_M};

use crate::device::Direction;

/// How an interferometer is used.
///
/// # Example
///
/// The first good sample is the datum; ten counts are ten half wavelengths from there, and half as much with a
/// beam that goes there twice.
///
/// ```
/// use drivers::device::{Device, DisplacementInstrument, umd2::{Umd2, Umd2Settings}};
/// use units::{Metres, Time};
/// use wire::{Input, Payload};
///
/// let settings = Umd2Settings { optics_factor: 2, start_samples: 1, ..Umd2Settings::default() };
/// let mut laser = Umd2::new(settings);
/// laser.start(Time::ZERO);
/// for (at, line) in [(0.1, "58 2458 0 0\n"), (0.102, "2458 2458 1000 0 0 7 0 0\n")] {
///     let input = Input::Payload(Payload::Bytes(line.into()));
///     laser.handle(Time::from_seconds(at), &input);
/// }
/// assert_eq!(laser.poll_outcome(), Some(Ok(())));
/// let line = b"2458 2458 1010 0 0 8 0 0\n".to_vec();
/// laser.handle(Time::from_seconds(0.104), &Input::Payload(Payload::Bytes(line)));
/// let seen = laser.latest().map(|it| it.vacuum.nm());
/// assert!(seen.is_some_and(|nm| (nm - 5.0 * 316.495_686).abs() < 1e-3));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Umd2Settings {
    /// The laser's wavelength in vacuum.
    pub vacuum_wavelength: Metres,
    /// Passes of the beam over the measured length: 1, 2 or 4; more divide finer.
    pub optics_factor: u8,
    /// Which way the displacement counts.
    pub direction: Direction,
    /// Samples per second, as the firmware is set.
    pub sample_rate_hz: f64,
    /// An average fails when more samples than this are missing or unusable in it.
    pub lost_samples_max: u64,
    /// The beam counts as lost below this signal strength; `None`: not judged.
    pub signal_strength_min: Option<i32>,
    /// A sample may be this much older than its arrival (USB hands over in batches); an
    /// average takes none that may be older than its beginning.
    pub arrival_latency: Duration,
    /// The stream is silent after this.
    pub stream_timeout: Duration,
    /// The start waits this long for the stream.
    pub start_timeout: Duration,
    /// The stream is good after this many good samples in a row.
    pub start_samples: u32,
    /// This many damaged lines in a row raise an alarm.
    pub garbage_lines_max: u64,
    /// Temperature, pressure and humidity older than this are not given.
    pub environment_age_max: Duration,
}

impl Default for Umd2Settings {
    fn default() -> Self {
        Self {
            vacuum_wavelength: Metres(VACUUM_WAVELENGTH_M),
            optics_factor: 1,
            direction: Direction::AsCounted,
            sample_rate_hz: DEFAULT_SAMPLE_RATE_HZ,
            lost_samples_max: 6,
            signal_strength_min: None,
            arrival_latency: Duration::from_millis(16),
            stream_timeout: Duration::from_millis(100),
            start_timeout: Duration::from_secs(3),
            start_samples: 20,
            garbage_lines_max: 20,
            environment_age_max: Duration::from_secs(10),
        }
    }
}
