//! What is known of the machine while its lines are read, and taken off each reading: what the
//! detectors see beyond their references, and what temperatures do by the configuration as far as
//! this calibration does not find it. The tables then hold for the machine as it was when the
//! references were taken, however warm it became meanwhile.

use compensator::volumetric::Axis;
use compensator::volumetric::identify::{ExpansionPlan, Observation, Reading};
use compensator::volumetric::model::{Chain, Machine as Model, Seen, VolumetricModel};
use compensator::volumetric::online::MovingState;
use units::portable::powi;
use units::{Celsius, Metres};

use crate::volumetric::VolumetricConfig;
use crate::volumetric::VolumetricFailure;
use crate::volumetric::settings::{model_limits, roll_max, thermal, volumetric_chain, work_volume};

/// What the detectors see beyond their references, and how sure the displacements of each axis are by noise.
#[derive(Clone, Debug, Default)]
pub(super) struct SeenState {
    pub(super) state: MovingState,
    pub(super) u_displacement: [Metres; 3],
}

/// A model without any table: only what is known otherwise.
pub(super) struct Known {
    model: VolumetricModel,
}

impl Known {
    /// For readings that count from `references`. What `is_found` (the calibration reads warm lines
    /// too) is left in the readings.
    pub(super) fn new(
        config: &VolumetricConfig,
        references: &[Celsius],
        is_found: bool,
    ) -> Result<Self, VolumetricFailure> {
        let mut thermal = thermal(config, references);
        if is_found {
            for plan in expansion_plans(config) {
                for channel in &mut thermal.channels {
                    channel.expansion[plan.axis.index()] = 0.0;
                    channel.u_expansion[plan.axis.index()] = 0.0;
                }
            }
        }
        let machine = Model {
            chain: volumetric_chain(config)?,
            volume: work_volume(config)?,
            axes: Default::default(),
            squareness: Default::default(),
            thermal,
            tool_max: Metres::from_mm(config.tool_max_mm),
            displacement_max: Metres::from_um(config.compensation.displacement_max_um),
            roll_max: roll_max(config),
        };
        let model = VolumetricModel::new(machine, model_limits(&config.compensation))?;
        Ok(Self { model })
    }

    /// Which axis stands on which.
    pub(super) fn chain(&self) -> Chain {
        self.model.machine().chain
    }

    /// The reading as it would be, were all as when the references were taken. How sure what is
    /// taken off is becomes part of how sure the reading is.
    ///
    /// No term that is known turns anything: what tilts with warmth is to be found.
    pub(super) fn without(
        &self,
        observation: &Observation,
        seen: &SeenState,
        temperatures: &[Celsius],
    ) -> Result<Reading, VolumetricFailure> {
        let Reading::Length {
            along,
            deviation,
            u,
        } = observation.reading
        else {
            return Ok(observation.reading);
        };
        let (model, at) = (&self.model, observation.at);
        let now = model.conditions(observation.tool, temperatures, &seen.state)?;
        let u_seen = model.standard_uncertainty(at, &now, &Seen::default())?;
        let u_displacement = seen.u_displacement;
        let seen = model.deviation(at, &now)?;
        let (mut part, mut square) = (0.0, u.value() * u.value());
        for axis in Axis::ALL {
            let share = along[axis.index()];
            part += seen.along(axis).value() * share;
            square += powi(u_seen.along(axis).value() * share, 2);
            // Each of the other two slides goes aside in this direction.
            let others = axis.others().map(|it| u_displacement[it.index()].value());
            square += others.iter().map(|u| powi(u * share, 2)).sum::<f64>();
        }
        Ok(Reading::Length {
            along,
            deviation: deviation - Metres(part),
            u: Metres(square.sqrt()),
        })
    }
}

/// The scales whose expansions warm lines tell: those of which the configuration says that they have
/// some, by the thermometers it says that of.
pub(super) fn expansion_plans(config: &VolumetricConfig) -> Vec<ExpansionPlan> {
    let each = Axis::ALL.into_iter().map(|axis| {
        let expands = |it: &usize| config.temperature[*it].expansion_ppm_per_k[axis.index()] != 0.0;
        let thermometers = (0..config.temperature.len()).filter(expands).collect();
        ExpansionPlan { axis, thermometers }
    });
    each.filter(|it| !it.thermometers.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use crate::Edit;
    use compensator::volumetric::Point;
    use units::Radians;

    use super::*;

    const SHIPPED: &str = include_str!("../../../../configs/machines/volumetric.toml");
    /// All thermometers when the references were taken.
    const COLD: [Celsius; 6] = [Celsius(21.0); 6];

    /// The shipped three axes, whose first thermometer also tells growth and a squareness.
    fn config() -> VolumetricConfig {
        let own = "expansion_ppm_per_k = [5.0, 0.0, 0.0]";
        let more = format!(
            "{own}\ngrowth_um_per_k = [0.0, 0.0, 2.0]\nsquareness_arcsec_per_k = [1.0, 0.0, 0.0]"
        );
        let text = SHIPPED.edit_first(own, &more);
        let config = crate::config::parse(&text, "m").unwrap().config;
        config.volumetric.unwrap()
    }

    fn length(along: [f64; 3]) -> Observation {
        Observation {
            at: Point::from_mm(500.0, 400.0, 300.0),
            tool: Point::from_mm(0.0, 0.0, -100.0),
            run: 0,
            reading: Reading::Length {
                along,
                deviation: Metres(0.0),
                u: Metres::from_um(0.02),
            },
            common: 0.0,
            common_of_run: 0.0,
        }
    }

    /// What is taken off, and the uncertainty left, in micrometres.
    #[track_caller]
    fn check(is_found: bool, along: [f64; 3], warmer: [f64; 6], expected: [f64; 2]) {
        let known = Known::new(&config(), &COLD, is_found).unwrap();
        let warm: Vec<Celsius> = COLD
            .iter()
            .zip(warmer)
            .map(|(it, by)| *it + Celsius(by))
            .collect();
        let reading = known
            .without(&length(along), &SeenState::default(), &warm)
            .unwrap();
        let Reading::Length { deviation, u, .. } = reading else {
            panic!("{reading:?}")
        };
        let seen = [-deviation.um(), u.um()];
        for (seen, expected) in seen.into_iter().zip(expected) {
            assert!((seen - expected).abs() < 1e-3, "{seen} um, not {expected}");
        }
    }

    /// 0.5 K make 10 ppm/K · 0.5 m = 2.5 µm along x; its two thermometers are 0.01 K sure each.
    #[test]
    fn warmth_between_lines_is_taken_off_by_what_is_known_of_it() {
        let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
        let half = [0.5; 6];
        let scale_u = |mm: f64| 0.01 * 5e-6 * mm * 1e3;
        // The squareness leans y by 0.5 arcsec towards x: 400 mm of it are 0.97 µm, negative.
        let lean = Radians::from_arcsec(0.5).value() * 400e3;
        let lean_u = Radians::from_arcsec(0.01).value() * 400e3;
        let x_u = (scale_u(500.0) - lean_u).hypot(scale_u(500.0)).hypot(0.02);
        check(false, x, half, [2.5 - lean, x_u]);
        let y_u = scale_u(400.0).hypot(scale_u(400.0)).hypot(0.02);
        check(false, y, half, [2.0, y_u]);
        let growth_u = 0.01 * 2.0;
        let z_u = scale_u(300.0)
            .hypot(scale_u(300.0))
            .hypot(growth_u)
            .hypot(0.02);
        check(false, z, half, [1.5 + 1.0, z_u]);
        check(false, y, [0.0; 6], [0.0, y_u]);
    }

    /// Warm lines tell the expansions; growth and squareness per kelvin stay what they are said to be.
    #[test]
    fn what_warm_lines_tell_is_left_in_the_readings() {
        let (y, z) = ([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
        check(true, y, [0.5; 6], [0.0, 0.02]);
        check(true, z, [0.5; 6], [1.0, 0.02_f64.hypot(0.02)]);
    }

    /// Along y the slides of x and z go aside.
    #[test]
    fn the_noise_of_detectors_makes_a_reading_less_sure() {
        let known = Known::new(&config(), &COLD, true).unwrap();
        let seen = SeenState {
            u_displacement: [0.1, 5.0, 0.3].map(Metres::from_um),
            ..SeenState::default()
        };
        let reading = known.without(&length([0.0, 1.0, 0.0]), &seen, &COLD);
        let Reading::Length { u, .. } = reading.unwrap() else {
            panic!("it is a length")
        };
        assert!((u.um() - 0.02_f64.hypot(0.1).hypot(0.3)).abs() < 1e-12);
    }

    #[test]
    fn tilts_are_left_as_they_were_read() {
        let known = Known::new(&config(), &COLD, false).unwrap();
        let reading = Reading::Angle {
            about: Axis::X,
            deviation: Radians(3e-6),
            u: Radians(1e-7),
        };
        let observation = Observation {
            reading,
            ..length([1.0, 0.0, 0.0])
        };
        let warm = COLD.map(|it| it + Celsius(1.0));
        let left = known.without(&observation, &SeenState::default(), &warm);
        assert_eq!(left.unwrap(), reading);
    }
}
