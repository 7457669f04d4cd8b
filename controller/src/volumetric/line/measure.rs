//! What a counted path means with the optics of a line.

use compensator::volumetric::identify::Reading;
use compensator::volumetric::{Axis, Point};
use units::portable::asin;
use units::{Metres, Radians};

use crate::config::OpticsConfig;
use crate::volumetric::line::LineOptics;
use crate::volumetric::line::settings;

/// Optics with what turns their path into a reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Measure {
    /// The path is the tool's displacement along the line.
    Along,
    /// A displacement across is so many times the path.
    Across { direction: Axis, factor: f64 },
    /// A tilt's sine is the path over the distance of the two reflectors.
    Tilt { about: Axis, separation: Metres },
}

impl Measure {
    /// # Errors
    /// The key that the configuration lacks.
    pub(super) fn new(optics: LineOptics, config: &OpticsConfig) -> Result<Self, &'static str> {
        match optics {
            LineOptics::Linear => Ok(Self::Along),
            LineOptics::Straightness { across } => {
                let factor = config.straightness_factor.ok_or("straightness_factor")?;
                let direction = across;
                Ok(Self::Across { direction, factor })
            }
            LineOptics::Angular { about } => {
                let separation = settings::angular_separation(config);
                let separation = separation.ok_or("angular_separation_mm")?;
                Ok(Self::Tilt { about, separation })
            }
        }
    }

    pub(super) const fn has_two_beams(self) -> bool {
        match self {
            Self::Along => false,
            Self::Across { .. } | Self::Tilt { .. } => true,
        }
    }

    /// What `path` with its standard uncertainty means after `way` from the start of a line with
    /// direction `along`.
    pub(super) fn reading(self, along: [f64; 3], way: Point, path: Metres, u: Metres) -> Reading {
        match self {
            Self::Along => {
                let [x, y, z] = along;
                let made = way.x * x + way.y * y + way.z * z;
                let deviation = path - made;
                Reading::Length {
                    along,
                    deviation,
                    u,
                }
            }
            Self::Across { direction, factor } => Reading::Length {
                along: Axis::ALL.map(|axis| f64::from(u8::from(axis == direction))),
                deviation: path * factor,
                u: u * factor,
            },
            Self::Tilt { about, separation } => Reading::Angle {
                about,
                deviation: Radians(asin(path / separation)),
                u: Radians(u / separation),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OPTICS: OpticsConfig = OpticsConfig {
        straightness_factor: Some(36.0),
        angular_separation_mm: Some(30.0),
    };
    const U: Metres = Metres(20e-9);

    #[track_caller]
    fn reading(optics: LineOptics, path: Metres) -> Reading {
        let way = Point::from_mm(60.0, 80.0, 0.0);
        let measure = Measure::new(optics, &OPTICS).unwrap();
        measure.reading([0.6, 0.8, 0.0], way, path, U)
    }

    /// 100 mm were made, 100.003 mm counted.
    #[test]
    fn a_displacement_is_compared_with_the_way_made() {
        let seen = reading(LineOptics::Linear, Metres::from_mm(100.003));
        let Reading::Length {
            along,
            deviation,
            u,
        } = seen
        else {
            panic!("{seen:?}")
        };
        assert_eq!((along, u), ([0.6, 0.8, 0.0], U));
        assert!((deviation.um() - 3.0).abs() < 1e-6, "{}", deviation.um());
    }

    #[test]
    fn a_straightness_is_36_times_the_path() {
        let seen = reading(LineOptics::Straightness { across: Axis::Z }, Metres(1e-7));
        let Reading::Length {
            along,
            deviation,
            u,
        } = seen
        else {
            panic!("{seen:?}")
        };
        assert_eq!(along, [0.0, 0.0, 1.0]);
        assert!((deviation.um() - 3.6).abs() < 1e-9 && (u.um() - 0.72).abs() < 1e-9);
    }

    /// 1 µm over 30 mm: 6.8755 arcsec.
    #[test]
    fn a_tilt_is_the_path_over_the_separation() {
        let seen = reading(LineOptics::Angular { about: Axis::Z }, Metres(1e-6));
        let Reading::Angle {
            about,
            deviation,
            u,
        } = seen
        else {
            panic!("{seen:?}")
        };
        assert_eq!(about, Axis::Z);
        assert!((deviation.arcsec() - 6.875_494).abs() < 1e-5);
        assert!((u.arcsec() - 0.137_51).abs() < 1e-5);
    }

    #[test]
    fn optics_that_are_not_configured_are_named() {
        let none = OpticsConfig::default();
        let new = |optics| Measure::new(optics, &none);
        let across = LineOptics::Straightness { across: Axis::Y };
        assert_eq!(new(across), Err("straightness_factor"));
        let about = LineOptics::Angular { about: Axis::Y };
        assert_eq!(new(about), Err("angular_separation_mm"));
        assert_eq!(new(LineOptics::Linear), Ok(Measure::Along));
    }
}
