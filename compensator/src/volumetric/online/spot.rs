//! Where a camera sees the spot of a beam, or why that says nothing.
//!
//! Source: CN1214003A, tenth aspect: a two-dimensional CCD behind a beam splitter. The camera itself finds the spot in
//! its picture; what comes here is a place, some times a second, of the moment at which the picture was asked for.
//! Between two pictures nothing is known anew: [`SpotCamera::repeats`] says so, and nobody counts a picture twice.
//!
//! Absent: which of several spots is the beam's ([`Unplaced::Several`]), the shape of a spot, errors of the lens.

use core::time::Duration;

use units::{Metres, MetresPerSecond, Time};

use super::{JumpWatch, SettingsError, Trouble};

/// What is known of a camera that sees a beam's spot.
#[derive(Clone, Copy, Debug)]
pub struct SpotSettings {
    /// The lowest and the highest place that it can show, in both directions.
    pub field: [(Metres, Metres); 2],
    /// A picture older than this says nothing about now.
    pub age_max: Duration,
    /// How fast a place can change.
    pub speed_max: MetresPerSecond,
    /// How far apart two pictures of the same place can be, by noise.
    pub noise_max: Metres,
}

/// What a picture shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    /// When it was asked for.
    pub at: Time,
    /// Where the spot is, or why that cannot be said.
    pub place: Result<[Metres; 2], Unplaced>,
}

/// Why a picture tells no place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unplaced {
    /// The camera finds no spot that it accepts.
    NoSpot,
    /// It finds so many, and only one of them is the beam's: the others are reflections.
    Several(u32),
}

impl From<Unplaced> for Trouble {
    fn from(unplaced: Unplaced) -> Self {
        match unplaced {
            Unplaced::NoSpot => Self::Unseen,
            Unplaced::Several(spots) => Self::Several { spots },
        }
    }
}

/// A camera: pictures in, places out.
#[derive(Clone, Copy, Debug)]
pub struct SpotCamera {
    settings: SpotSettings,
    jump: JumpWatch<Metres, 2>,
    last: Option<Time>,
    repeats: bool,
}

impl SpotCamera {
    /// A camera that has seen nothing yet.
    ///
    /// # Errors
    /// When the settings contradict themselves.
    pub fn new(settings: SpotSettings) -> Result<Self, SettingsError> {
        let is_positive = |it: f64| it > 0.0 && it.is_finite();
        let (speed_max, noise_max) = (settings.speed_max, settings.noise_max);
        if !(is_positive(speed_max.value()) && is_positive(noise_max.value())) {
            return Err(SettingsError::NotPositive);
        }
        for (low, high) in settings.field {
            if !is_positive((high - low).value()) {
                return Err(SettingsError::Field { low, high });
            }
        }
        Ok(Self {
            settings,
            jump: JumpWatch::new(speed_max.value(), noise_max),
            last: None,
            repeats: false,
        })
    }

    /// The lowest and the highest place that it can show, in both directions.
    pub const fn field(&self) -> [(Metres, Metres); 2] {
        self.settings.field
    }

    /// The place of the beam by the newest picture, at `now`.
    ///
    /// # Errors
    /// What is wrong: nothing may then be concluded from the picture.
    pub fn read(&mut self, now: Time, newest: Option<&Spot>) -> Result<[Metres; 2], Trouble> {
        let limit = self.settings.age_max;
        let seen = newest.map_or(Duration::MAX, |it| now.since(it.at));
        let Some(spot) = newest.filter(|_| seen <= limit) else {
            self.repeats = false;
            return Err(Trouble::Stale { seen, limit });
        };
        self.repeats = self.last == Some(spot.at);
        let place = self.place(spot)?;
        if !self.repeats {
            self.jump.check(spot.at, place)?;
            self.last = Some(spot.at);
        }
        Ok(place)
    }

    /// Whether the place read last is of the same picture as the one before it.
    pub const fn repeats(&self) -> bool {
        self.repeats
    }

    /// What a picture says by itself.
    ///
    /// # Errors
    /// When it shows no spot, several, or one beyond the field.
    pub fn place(&self, spot: &Spot) -> Result<[Metres; 2], Trouble> {
        let place = spot.place?;
        for (seen, (low, high)) in place.into_iter().zip(self.settings.field) {
            if !(seen >= low && seen <= high) {
                return Err(Trouble::BesideField { seen, low, high });
            }
        }
        Ok(place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn um(um: f64) -> Metres {
        Metres::from_um(um)
    }

    fn ms(ms: u64) -> Time {
        Time::ZERO + Duration::from_millis(ms)
    }

    fn settings() -> SpotSettings {
        SpotSettings {
            field: [(um(-400.0), um(400.0)), (um(-300.0), um(300.0))],
            age_max: Duration::from_millis(200),
            speed_max: MetresPerSecond(100e-6),
            noise_max: um(2.0),
        }
    }

    fn spot(at: u64, place: [f64; 2]) -> Spot {
        Spot {
            at: ms(at),
            place: Ok(place.map(um)),
        }
    }

    #[test]
    fn a_picture_is_a_place_until_it_is_too_old_and_counts_once() {
        let mut camera = SpotCamera::new(settings()).unwrap();
        let picture = spot(10, [3.0, -4.0]);
        assert_eq!(camera.read(ms(60), Some(&picture)), Ok([um(3.0), um(-4.0)]));
        assert!(!camera.repeats());
        camera.read(ms(61), Some(&picture)).unwrap();
        assert!(camera.repeats(), "nothing new has come");
        camera.read(ms(80), Some(&spot(75, [3.5, -4.0]))).unwrap();
        assert!(!camera.repeats());
        let late = camera.read(ms(276), Some(&spot(75, [3.5, -4.0])));
        assert!(matches!(late, Err(Trouble::Stale { .. })), "{late:?}");
        let never = camera.read(ms(1), None);
        assert!(matches!(never, Err(Trouble::Stale { .. })), "{never:?}");
    }

    #[test]
    fn what_no_beam_can_have_done_is_not_believed() {
        let mut camera = SpotCamera::new(settings()).unwrap();
        let dark = Spot {
            at: ms(5),
            place: Err(Unplaced::NoSpot),
        };
        assert_eq!(camera.read(ms(10), Some(&dark)), Err(Trouble::Unseen));
        let reflected = Spot {
            at: ms(6),
            place: Err(Unplaced::Several(2)),
        };
        let refused = camera.read(ms(10), Some(&reflected));
        assert_eq!(refused, Err(Trouble::Several { spots: 2 }));
        let beside = camera.read(ms(20), Some(&spot(15, [0.0, 300.5])));
        assert!(
            matches!(beside, Err(Trouble::BesideField { seen, .. }) if seen == um(300.5)),
            "{beside:?}"
        );
        camera.read(ms(30), Some(&spot(30, [0.0, 0.0]))).unwrap();
        // 100 ms at 0.1 µm/ms and 2 µm of noise: 12 µm.
        let jumped = camera.read(ms(130), Some(&spot(130, [12.5, 0.0])));
        assert!(matches!(jumped, Err(Trouble::Jumped { .. })), "{jumped:?}");
        camera.read(ms(131), Some(&spot(131, [11.5, 0.0]))).unwrap();
    }

    #[test]
    fn settings_that_leave_nothing_are_refused() {
        let field = SpotSettings {
            field: [(um(1.0), um(1.0)), (um(-1.0), um(1.0))],
            ..settings()
        };
        assert!(matches!(
            SpotCamera::new(field),
            Err(SettingsError::Field { .. })
        ));
        let noise = SpotSettings {
            noise_max: Metres(f64::NAN),
            ..settings()
        };
        assert!(matches!(
            SpotCamera::new(noise),
            Err(SettingsError::NotPositive)
        ));
    }
}
