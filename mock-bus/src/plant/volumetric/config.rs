//! What a three-axis machine is made of, as a configuration file says it. Every key ends in its
//! unit; arrays of three are for x, y and z.

use serde::Deserialize;

use crate::config::error::{ConfigError, positive};
use crate::plant::config::{LimitConfig, MotionConfig, WeightConfig};

/// Three linear axes, their errors, what warms them, and what watches them.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct VolumetricConfig {
    /// The order of the bodies from workpiece to tool; `F` is the foot. Axes before it carry the
    /// workpiece, axes after it the tool.
    pub chain: String,
    /// The tool point from the machine's zero, with all axes at 0.
    pub tool_offset_mm: [f64; 3],
    /// The work range of each axis, from 0.
    pub travel_mm: [f64; 3],
    /// Travel of an encoder count, of every axis.
    pub resolution_nm: f64,
    /// What all slides have in common.
    pub slide: SlideConfig,
    /// What pulls at the third axis while its drive is off; none where it is balanced.
    pub weight_z: Option<WeightConfig>,
    /// Errors that are there from the beginning.
    pub errors: ErrorsConfig,
    /// What warms the machine, and what that does to it.
    pub heat: HeatConfig,
    /// The reference beams along the axes, and their detectors.
    pub beams: BeamConfig,
    /// The two detectors that see a slide roll.
    pub roll: RollConfig,
    /// The temperature sensors.
    pub temperatures: TemperatureConfig,
    /// The optics that a laser is set up with.
    pub laser: LaserConfig,
}

impl Default for VolumetricConfig {
    fn default() -> Self {
        Self {
            chain: "FXYZ".into(),
            tool_offset_mm: [0.0, 0.0, -100.0],
            travel_mm: [500.0, 400.0, 300.0],
            resolution_nm: 10.0,
            slide: SlideConfig::default(),
            weight_z: None,
            errors: ErrorsConfig::default(),
            heat: HeatConfig::default(),
            beams: BeamConfig::default(),
            roll: RollConfig::default(),
            temperatures: TemperatureConfig::default(),
            laser: LaserConfig::default(),
        }
    }
}

/// A slide on a linear motor with an incremental scale.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[expect(missing_docs, reason = "the names say it, units included")]
pub struct SlideConfig {
    pub servo_bandwidth_hz: f64,
    pub servo_damping: f64,
    pub feed_forward_fraction: f64,
    pub acceleration_max_m_per_s2: f64,
    pub friction_deceleration_m_per_s2: f64,
    /// Standard deviation of where the settled servo stands.
    pub rest_error_nm: f64,
    /// Where a slide stands when first switched on: uniform between these two.
    pub start_min_mm: f64,
    pub start_max_mm: f64,
    /// A power cycle moves a slide by up to this much either way.
    pub power_cycle_shift_um: f64,
    /// From the work range to the limit switches.
    pub limit_overrun_mm: f64,
    pub limit_repeatability_um: f64,
    pub limit_hysteresis_um: f64,
    /// From the work range to the mechanical ends.
    pub hard_stop_overrun_mm: f64,
    /// From one reference mark of the scale to the next; one of them is at 0.
    pub index_spacing_mm: f64,
    pub index_repeatability_nm: f64,
}

impl Default for SlideConfig {
    fn default() -> Self {
        Self {
            servo_bandwidth_hz: 40.0,
            servo_damping: 0.9,
            feed_forward_fraction: 0.98,
            acceleration_max_m_per_s2: 10.0,
            friction_deceleration_m_per_s2: 2.0,
            rest_error_nm: 5.0,
            start_min_mm: 5.0,
            start_max_mm: 40.0,
            power_cycle_shift_um: 200.0,
            limit_overrun_mm: 6.0,
            limit_repeatability_um: 20.0,
            limit_hysteresis_um: 50.0,
            hard_stop_overrun_mm: 8.0,
            index_spacing_mm: 20.0,
            index_repeatability_nm: 20.0,
        }
    }
}

impl SlideConfig {
    pub(super) const fn motion(&self, travel_mm: f64) -> MotionConfig {
        MotionConfig {
            servo_bandwidth_hz: self.servo_bandwidth_hz,
            servo_damping: self.servo_damping,
            feed_forward_fraction: self.feed_forward_fraction,
            acceleration_max_m_per_s2: self.acceleration_max_m_per_s2,
            friction_deceleration_m_per_s2: self.friction_deceleration_m_per_s2,
            rest_error_nm: self.rest_error_nm,
            hard_stop_min_mm: -self.hard_stop_overrun_mm,
            hard_stop_max_mm: travel_mm + self.hard_stop_overrun_mm,
            start_min_mm: self.start_min_mm,
            start_max_mm: self.start_max_mm,
            power_cycle_shift_um: self.power_cycle_shift_um,
            weight: None,
        }
    }

    pub(super) const fn limits(&self, travel_mm: f64) -> LimitConfig {
        LimitConfig {
            negative_mm: -self.limit_overrun_mm,
            positive_mm: travel_mm + self.limit_overrun_mm,
            repeatability_um: self.limit_repeatability_um,
            hysteresis_um: self.limit_hysteresis_um,
        }
    }
}

/// The six error motions of each axis, and the three squarenesses. Each motion is a smooth
/// function of position, drawn from the seed, 0 at 0 and scaled to half the width of a band.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[expect(missing_docs, reason = "the names say it, units included")]
pub struct ErrorsConfig {
    pub positioning_um: f64,
    pub straightness_um: f64,
    pub roll_arcsec: f64,
    pub pitch_and_yaw_arcsec: f64,
    /// Each squareness is between half of this and all of it, with either sign.
    pub squareness_arcsec: f64,
    /// The x guide's deliberate bow, upwards in its middle.
    pub deliberate_bow_um: f64,
    /// A roll of the slide of `deliberate_roll_axis`, the same everywhere.
    pub deliberate_roll_arcsec: f64,
    /// Which slide rolls so: 0, 1, 2.
    pub deliberate_roll_axis: usize,
    /// Since when these two are there.
    pub deliberate_from_h: f64,
}

impl Default for ErrorsConfig {
    fn default() -> Self {
        Self {
            positioning_um: 20.0,
            straightness_um: 8.0,
            roll_arcsec: 5.0,
            pitch_and_yaw_arcsec: 10.0,
            squareness_arcsec: 30.0,
            deliberate_bow_um: 0.0,
            deliberate_roll_arcsec: 0.0,
            deliberate_roll_axis: 0,
            deliberate_from_h: 0.0,
        }
    }
}

/// Air that swings, motors that warm up, and what comes of both. Sizes differ between axes and
/// seeds by up to 30 %.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[expect(missing_docs, reason = "the names say it, units included")]
pub struct HeatConfig {
    pub air_temperature_c: f64,
    pub air_swing_k: f64,
    pub air_swing_period_h: f64,
    /// How the machine as a whole follows the air.
    pub air_time_constant_min: f64,
    /// How hard the motors work, and since when; before the first entry they rest.
    pub duty: Vec<DutyConfig>,
    /// By how much full duty warms a scale, in the end.
    pub scale_warming_k: f64,
    pub scale_time_constant_min: f64,
    /// Linear expansion of the scales.
    pub scale_expansion_ppm_per_k: f64,
    /// The difference across a guide that full duty makes in the end.
    pub gradient_k: f64,
    pub gradient_time_constant_min: f64,
    /// How much of the difference between air and machine is also one across a guide.
    pub gradient_of_air: f64,
    /// How far a guide's middle bends per kelvin of that difference; its slide pitches with the
    /// slope.
    pub bow_um_per_k: f64,
    /// The films that carry the slides grow with their oil's warmth: a shift sideways that does
    /// not turn the slide, at its largest place and at full duty in the end.
    pub film_um: f64,
    pub film_time_constant_min: f64,
    /// The watched slide (`roll.axis`) also rolls, at the end of its travel.
    pub film_roll_arcsec: f64,
}

impl Default for HeatConfig {
    fn default() -> Self {
        Self {
            air_temperature_c: 21.0,
            air_swing_k: 0.8,
            air_swing_period_h: 24.0,
            air_time_constant_min: 150.0,
            duty: vec![
                DutyConfig {
                    from_h: 0.0,
                    share: 0.8,
                },
                DutyConfig {
                    from_h: 4.0,
                    share: 0.1,
                },
                DutyConfig {
                    from_h: 4.5,
                    share: 1.0,
                },
            ],
            scale_warming_k: 2.5,
            scale_time_constant_min: 60.0,
            scale_expansion_ppm_per_k: 10.0,
            gradient_k: 1.2,
            gradient_time_constant_min: 40.0,
            gradient_of_air: 0.3,
            bow_um_per_k: 4.0,
            film_um: 7.0,
            film_time_constant_min: 90.0,
            film_roll_arcsec: 2.0,
        }
    }
}

/// How hard the motors work from some time on.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DutyConfig {
    /// From when on.
    pub from_h: f64,
    /// 0 rests, 1 is all the motors can.
    pub share: f64,
}

/// A beam along each axis, a detector of four quadrants on its slide and one at the end of the
/// beam's way.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BeamConfig {
    /// From the beam's source to the slide's detector at position 0.
    pub source_before_zero_mm: f64,
    /// From the slide's detector at the end of the work range to the end detector.
    pub end_behind_travel_mm: f64,
    /// How far the source shifts sideways, at most.
    pub translation_um: f64,
    /// How far the beam swings about its source, at most.
    pub pivot_urad: f64,
    /// The slowest period of both; there are shorter ones beside it.
    pub wander_period_min: f64,
    /// Standard deviation of what turbulent air does to the spot, at the end of the way.
    pub turbulence_um: f64,
    /// Where the slide's detector is, from the point whose errors are `errors`.
    pub detector_place_mm: [f64; 3],
    /// Radius (1/e²) of the spot, which is Gaussian.
    pub spot_radius_mm: f64,
    /// By how much a detector's own radius may differ, either way.
    pub radius_tolerance_percent: f64,
    /// How far from its middle a detector is mounted, at most.
    pub mounting_um: f64,
    /// Sum of the four channels.
    pub sum_v: f64,
    /// How far the intensity drifts, at most.
    pub intensity_drift_percent: f64,
    /// Standard deviation of each channel.
    pub noise_mv: f64,
    /// The channels saturate here.
    pub rail_v: f64,
    /// Standard deviation of where a camera finds the spot in one picture, in each direction.
    pub camera_noise_um: f64,
    /// A camera sees the spot up to this far from its middle, in each direction.
    pub camera_field_um: f64,
}

impl Default for BeamConfig {
    fn default() -> Self {
        Self {
            source_before_zero_mm: 100.0,
            end_behind_travel_mm: 100.0,
            translation_um: 0.2,
            pivot_urad: 15.0,
            wander_period_min: 120.0,
            turbulence_um: 0.1,
            detector_place_mm: [0.0, 15.0, 25.0],
            spot_radius_mm: 1.0,
            radius_tolerance_percent: 1.0,
            mounting_um: 20.0,
            sum_v: 8.0,
            intensity_drift_percent: 8.0,
            noise_mv: 0.1,
            rail_v: 5.0,
            camera_noise_um: 0.15,
            camera_field_um: 300.0,
        }
    }
}

/// Two parallel slanting beams and two detectors on one slide (S4's h, L and φ).
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[expect(missing_docs, reason = "the names say it, units included")]
pub struct RollConfig {
    /// Which slide: 0, 1, 2.
    pub axis: usize,
    /// Slides that have two such detectors as well, at terminals of their own.
    pub further_axes: Vec<usize>,
    /// L, from one beam to the other.
    pub distance_mm: f64,
    /// h, from the slide's surface to the detectors' marks.
    pub height_mm: f64,
    /// φ, of the beams against the slide's normal.
    pub slant_deg: f64,
    pub sensitivity_v_per_mm: f64,
}

impl Default for RollConfig {
    fn default() -> Self {
        Self {
            axis: 0,
            further_axes: Vec::new(),
            distance_mm: 300.0,
            height_mm: 20.0,
            slant_deg: 45.0,
            sensitivity_v_per_mm: 10.0,
        }
    }
}

/// Two sensors on each guide: over and under its neutral plane.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[expect(missing_docs, reason = "the names say it, units included")]
pub struct TemperatureConfig {
    /// A sensor's constant error is up to this much either way.
    pub offset_k: f64,
    pub noise_k: f64,
}

impl Default for TemperatureConfig {
    fn default() -> Self {
        Self {
            offset_k: 0.03,
            noise_k: 0.003,
        }
    }
}

/// The optics of a laser interferometer, and the hand that sets them up.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LaserConfig {
    /// A beam is off its line by up to this, either way in both directions across.
    pub misalignment_urad: f64,
    /// A straightedge slopes by up to this, either way.
    pub straightedge_slope_urad: f64,
    /// Between the two beams of the prism: 1.5916° make a displacement 36 times its path.
    pub prism_divergence_deg: f64,
    /// From one corner cube of the angular optics to the other.
    pub angular_separation_mm: f64,
    /// So far from its line a target loses the beam.
    pub lateral_max_mm: f64,
    /// How long hands are in the beam.
    pub set_up_ms: f64,
}

impl Default for LaserConfig {
    fn default() -> Self {
        Self {
            misalignment_urad: 100.0,
            straightedge_slope_urad: 150.0,
            prism_divergence_deg: 1.5916,
            angular_separation_mm: 30.0,
            lateral_max_mm: 2.0,
            set_up_ms: 300.0,
        }
    }
}

impl VolumetricConfig {
    /// What makes no three axes.
    pub(super) fn check_numbers(&self) -> Result<(), ConfigError> {
        for (key, seen) in self.positive_numbers() {
            positive(key, seen)?;
        }
        let mut watched = self.roll.further_axes.iter();
        if let Some(axis) = watched.find(|it| **it > 2 || **it == self.roll.axis) {
            return Err(ConfigError::Value {
                key: "roll.further_axes",
                seen: *axis as f64,
                expected: "axes from 0 to 2 other than roll.axis",
            });
        }
        if self.errors.deliberate_roll_axis > 2 {
            return Err(ConfigError::Value {
                key: "deliberate_roll_axis",
                seen: self.errors.deliberate_roll_axis as f64,
                expected: "an axis from 0 to 2",
            });
        }
        if self.is_a_chain() {
            return Ok(());
        }
        Err(ConfigError::Value {
            key: "chain and roll.axis",
            seen: self.roll.axis as f64,
            expected: "F, X, Y and Z once each, and an axis from 0 to 2",
        })
    }

    /// Whether the chain names the foot and each axis once.
    pub(crate) fn is_a_chain(&self) -> bool {
        let mut letters: Vec<char> = self.chain.chars().collect();
        letters.sort_unstable();
        letters == ['F', 'X', 'Y', 'Z'] && self.roll.axis < 3
    }

    /// What must be more than 0 for the rest to make sense.
    fn positive_numbers(&self) -> Vec<(&'static str, f64)> {
        let (slide, heat, beams) = (&self.slide, &self.heat, &self.beams);
        let mut numbers = vec![
            ("resolution_nm", self.resolution_nm),
            ("servo_bandwidth_hz", slide.servo_bandwidth_hz),
            ("acceleration_max_m_per_s2", slide.acceleration_max_m_per_s2),
            (
                "friction_deceleration_m_per_s2",
                slide.friction_deceleration_m_per_s2,
            ),
            ("index_spacing_mm", slide.index_spacing_mm),
            (
                "hard_stop_overrun_mm - limit_overrun_mm",
                slide.hard_stop_overrun_mm - slide.limit_overrun_mm,
            ),
            (
                "start_min_mm + hard_stop_overrun_mm",
                slide.start_min_mm + slide.hard_stop_overrun_mm,
            ),
            ("air_swing_period_h", heat.air_swing_period_h),
            ("air_time_constant_min", heat.air_time_constant_min),
            ("scale_time_constant_min", heat.scale_time_constant_min),
            (
                "gradient_time_constant_min",
                heat.gradient_time_constant_min,
            ),
            ("film_time_constant_min", heat.film_time_constant_min),
            ("wander_period_min", beams.wander_period_min),
            ("spot_radius_mm", beams.spot_radius_mm),
            ("camera_field_um", beams.camera_field_um),
            ("sum_v", beams.sum_v),
            ("beams.rail_v", beams.rail_v),
            ("distance_mm", self.roll.distance_mm),
            ("prism_divergence_deg", self.laser.prism_divergence_deg),
            ("angular_separation_mm", self.laser.angular_separation_mm),
            ("lateral_max_mm", self.laser.lateral_max_mm),
            ("set_up_ms", self.laser.set_up_ms),
        ];
        for travel_mm in self.travel_mm {
            numbers.push(("travel_mm", travel_mm));
            numbers.push(("travel_mm - start_max_mm", travel_mm - slide.start_max_mm));
        }
        numbers
    }
}
