//! The weight of an axis and the brake that holds it without torque.
//!
//! The brake is wired to the drive's brake output: it opens with the torque, and falls in when the
//! drive takes the torque away or asks for it ([`Servo::Brake`](super::servo::Servo::Brake)).

use core::time::Duration;

use units::Time;

use crate::plant::config::WeightConfig;

/// The weight and its brake.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::plant) struct Weight {
    /// The acceleration without torque and brake.
    pub(in crate::plant) acceleration: f64,
    brake: Option<Brake>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Brake {
    engages_in: Duration,
    releases_in: Duration,
    wants_closed: bool,
    /// Until then it is as it was.
    acts_at: Time,
}

impl Weight {
    /// No weight and no brake.
    pub(in crate::plant) const NONE: Self = Self {
        acceleration: 0.0,
        brake: None,
    };

    /// The drive's brake output asks for an open or a closed brake.
    pub(super) fn ask_brake(&mut self, now: Time, closed: bool) {
        if let Some(brake) = &mut self.brake
            && brake.wants_closed != closed
        {
            brake.wants_closed = closed;
            let takes = match closed {
                true => brake.engages_in,
                false => brake.releases_in,
            };
            brake.acts_at = now + takes;
        }
    }

    /// Whether the brake holds.
    pub(super) fn is_braked(&self, now: Time) -> bool {
        self.brake
            .is_some_and(|brake| brake.wants_closed == (now >= brake.acts_at))
    }
}

impl From<WeightConfig> for Weight {
    fn from(config: WeightConfig) -> Self {
        let ms = |ms: f64| Duration::from_secs_f64(ms * 1e-3);
        let brake = Brake {
            engages_in: ms(config.brake_engage_ms),
            releases_in: ms(config.brake_release_ms),
            wants_closed: true,
            acts_at: Time::ZERO,
        };
        Self {
            acceleration: config.gravity_m_per_s2,
            brake: config.has_brake.then_some(brake),
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::plant::config::{PlantConfig, WeightConfig};
    use crate::plant::{Plant, Servo};
    use units::Time;

    /// Where an axis is half a second after `last`, of a weight with or without a brake.
    fn drop_m(has_brake: bool, last: &[(f64, Servo)]) -> f64 {
        let mut config = PlantConfig::default();
        config.stage.motion.weight = Some(WeightConfig {
            has_brake,
            ..WeightConfig::default()
        });
        let mut plant = Plant::new(&config, 1);
        plant.set_servo(0, Servo::Follow { demand: 20e-3 });
        plant.advance(Time::from_seconds(2.0));
        plant.mark_travel(0);
        for (at_s, servo) in last {
            plant.advance(Time::from_seconds(2.0 + at_s));
            plant.set_servo(0, *servo);
        }
        plant.advance(Time::from_seconds(3.0));
        let travel = plant.truth().travel(0).unwrap();
        assert_eq!(travel.speed, 0.0, "{last:?}");
        travel.position - travel.since_mark.from
    }

    #[test]
    fn without_torque_the_brake_falls_in_late() {
        // 30 ms at 9.81 less 2 m/s² of friction, then 20 m/s² of the brake.
        let dropped = drop_m(true, &[(0.0, Servo::Off)]);
        assert!((-5.5e-3..-4.0e-3).contains(&dropped), "{dropped}");
    }

    #[test]
    fn a_brake_that_holds_first_drops_nothing() {
        let demand = 20e-3;
        let dropped = drop_m(true, &[(0.0, Servo::Brake { demand }), (0.031, Servo::Off)]);
        assert!(dropped.abs() < 1e-6, "{dropped}");
    }

    #[test]
    fn without_a_brake_it_falls_to_its_end() {
        let dropped = drop_m(false, &[(0.0, Servo::Off)]);
        assert!(dropped < -25e-3, "{dropped}");
    }

    #[test]
    fn a_closed_brake_holds_against_the_servo() {
        let demand = 20e-3;
        let again = Servo::Follow { demand: 21e-3 };
        let steps = [
            (0.0, Servo::Brake { demand }),
            (0.1, Servo::Off),
            (0.2, again),
        ];
        assert!((drop_m(true, &steps) - 1e-3).abs() < 1e-6, "it opens again");
    }
}
