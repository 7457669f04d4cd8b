//! What the correction of three axes is told: units of the configuration become SI here.

use core::time::Duration;

use compensator::error_table::Limits;
use compensator::volumetric::function::{Function, FunctionError, Shape};
use compensator::volumetric::identify::BendPlan;
use compensator::volumetric::model::{Chain, ChainError, Thermal, ThermalChannel};
use compensator::volumetric::online::{
    BeamDetector, BeamDetectorSettings, BeamDrift, Eye, FeedSettings, Influences, Layout,
    RatioCurve, Reaction, RollError, RollOptics, SettingsError, SpotCamera, SpotSettings,
    TemperatureSettings,
};
use compensator::volumetric::{Axis, Point, Volume, VolumeError};
use units::{Celsius, Metres, MetresPerSecond, Quantity, Radians, Volts};

use crate::hardware::CHECKED;
use crate::volumetric::DriftRecord;
use crate::volumetric::{
    BeamConfig, BeamDetectorConfig, BeamDriftName, DetectorConfig, FeedConfig, InfluenceConfig,
    LayoutName, ReactionName, RollConfig, ShapeName, SpotCameraConfig, TemperatureConfig,
    VolumeAxisName, VolumetricCompensationConfig, VolumetricConfig,
};

/// A detector of the configuration that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BeamDetectorError {
    /// Neither a straight line nor points, or both.
    #[error("give either `um_per_one` with `ratio_max`, or points of a `curve`")]
    NoCurve,
    /// The points form no curve.
    #[error(transparent)]
    Curve(#[from] FunctionError),
    /// Its limits contradict each other.
    #[error(transparent)]
    Settings(#[from] SettingsError),
}

/// The direction that a name stands for.
pub(crate) const fn volume_axis(name: VolumeAxisName) -> Axis {
    match name {
        VolumeAxisName::X => Axis::X,
        VolumeAxisName::Y => Axis::Y,
        VolumeAxisName::Z => Axis::Z,
    }
}

/// How an error function is drawn between its nodes.
pub(crate) const fn function_shape(name: ShapeName) -> Shape {
    match name {
        ShapeName::Linear => Shape::Linear,
        ShapeName::MonotoneCubic => Shape::MonotoneCubic,
        ShapeName::Spline => Shape::Spline,
    }
}

/// A point of three millimetres.
pub(crate) fn point_of_mm(mm: [f64; 3]) -> Point {
    let [x, y, z] = mm.map(Metres::from_mm);
    Point::new(x, y, z)
}

fn seconds(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX)
}

fn millis(ms: f64) -> Duration {
    seconds(ms * 1e-3)
}

/// Which axis stands on which.
///
/// # Errors
/// When the text is no chain.
pub(crate) fn volumetric_chain(config: &VolumetricConfig) -> Result<Chain, ChainError> {
    config.chain.parse()
}

/// The work volume.
///
/// # Errors
/// When it has no extent.
pub(crate) fn work_volume(config: &VolumetricConfig) -> Result<Volume, VolumeError> {
    Volume::new(point_of_mm(config.low_mm), point_of_mm(config.high_mm))
}

/// A beam detector that has seen nothing yet.
///
/// # Errors
/// When its curve or its limits cannot be.
pub fn beam_detector(config: &BeamDetectorConfig) -> Result<BeamDetector, BeamDetectorError> {
    let layout = match config.layout {
        LayoutName::Quadrants => Layout::Quadrants,
        LayoutName::Lateral => Layout::Lateral,
    };
    Ok(BeamDetector::new(BeamDetectorSettings {
        layout,
        dark: config.dark_mv.map(|mv| Volts(mv * 1e-3)),
        gain: config.gain,
        saturation: Volts(config.saturation_v),
        intensity_min: Volts(config.intensity_min_v),
        intensity_max: Volts(config.intensity_max_v),
        age_max: millis(config.age_max_ms),
        speed_max: MetresPerSecond(config.speed_max_um_per_s * 1e-6),
        noise_max: Metres::from_um(config.noise_max_um),
        stuck_samples: config.stuck_samples,
        curves: curves(config)?,
    })?)
}

/// What sees a beam, and has seen nothing yet.
///
/// # Errors
/// When its curve, its field or its limits cannot be.
pub(crate) fn eye(config: DetectorConfig<'_>) -> Result<Eye, BeamDetectorError> {
    match config {
        DetectorConfig::Channels(own) => Ok(beam_detector(own)?.into()),
        DetectorConfig::Camera(own) => Ok(Eye::Camera(spot_camera(own)?)),
    }
}

/// Likewise a camera.
///
/// # Errors
/// When its field or its limits cannot be.
pub(crate) fn spot_camera(config: &SpotCameraConfig) -> Result<SpotCamera, BeamDetectorError> {
    Ok(SpotCamera::new(SpotSettings {
        field: config
            .field_um
            .map(|um| (Metres::from_um(-um), Metres::from_um(um))),
        age_max: millis(config.age_max_ms),
        speed_max: MetresPerSecond(config.speed_max_um_per_s * 1e-6),
        noise_max: Metres::from_um(config.noise_max_um),
    })?)
}

fn curves(config: &BeamDetectorConfig) -> Result<[RatioCurve; 2], BeamDetectorError> {
    match (config.um_per_one, config.ratio_max, &*config.curve) {
        (Some([first, second]), Some(ratio_max), []) => {
            let straight = |um: f64| RatioCurve::straight(Metres::from_um(um), ratio_max);
            Ok([straight(first)?, straight(second)?])
        }
        (None, None, [_, ..]) => {
            let points = config.curve.iter();
            let ratios: Vec<f64> = points.clone().map(|it| it.ratio).collect();
            let first: Vec<_> = points
                .clone()
                .map(|it| Metres::from_um(it.first_um))
                .collect();
            let second: Vec<_> = points.map(|it| Metres::from_um(it.second_um)).collect();
            Ok([
                RatioCurve::new(&ratios, &first)?,
                RatioCurve::new(&ratios, &second)?,
            ])
        }
        _ => Err(BeamDetectorError::NoCurve),
    }
}

/// How a beam moves; `None` while a key that this kind of drift needs is missing.
pub fn beam_drift(config: &BeamConfig) -> Option<BeamDrift> {
    let place = |mm: Option<f64>| mm.map(Metres::from_mm);
    Some(match config.drift {
        BeamDriftName::Translating => BeamDrift::Translating,
        BeamDriftName::Pivoting => BeamDrift::Pivoting {
            source: place(config.source_mm)?,
            end: place(config.end_mm)?,
        },
        BeamDriftName::Mixed => BeamDrift::Mixed {
            source: place(config.source_mm)?,
            end: place(config.end_mm)?,
            translation: config.translation_share?,
        },
    })
}

/// The same as it is written down; `None` where it is not known where the beam begins and ends.
pub(crate) fn drift_record(config: &BeamConfig) -> Option<DriftRecord> {
    Some(DriftRecord {
        source_m: Metres::from_mm(config.source_mm?).value(),
        end_m: Metres::from_mm(config.end_mm?).value(),
        translation_share: match config.drift {
            BeamDriftName::Translating => 1.0,
            BeamDriftName::Pivoting => 0.0,
            BeamDriftName::Mixed => config.translation_share?,
        },
    })
}

/// The arrangement of two roll detectors.
///
/// # Errors
/// When it does not determine a roll.
pub fn roll_optics(config: &RollConfig) -> Result<RollOptics, RollError> {
    RollOptics::new(
        Metres::from_mm(config.height_mm),
        Metres::from_mm(config.base_mm),
        Radians::from_degrees(config.inclination_deg),
        Radians::from_arcsec(config.roll_max_arcsec),
    )
}

/// The largest roll that any detectors may report.
pub(crate) fn roll_max(config: &VolumetricConfig) -> Radians {
    let each = config.roll.each().iter();
    let each = each.map(|it| Radians::from_arcsec(it.roll_max_arcsec));
    each.fold(Radians(0.0), Quantity::max)
}

/// What a temperature can be.
pub(crate) fn temperature_settings(config: &TemperatureConfig) -> TemperatureSettings {
    TemperatureSettings {
        low: Celsius(config.low_c),
        high: Celsius(config.high_c),
        rate_max: config.rate_max_k_per_min / 60.0,
        noise_max: config.noise_max_k,
        age_max: millis(config.age_max_ms),
        stuck_samples: config.stuck_samples,
    }
}

/// What temperatures do to the machine, each by how far it is from what it was when the machine
/// was calibrated: `references`, in the order of the configuration.
pub(crate) fn thermal(config: &VolumetricConfig, references: &[Celsius]) -> Thermal {
    let channels = config.temperature.iter().zip(references);
    let channels = channels.map(|(it, reference)| ThermalChannel {
        reference: *reference,
        low: Celsius(it.low_c),
        high: Celsius(it.high_c),
        expansion: it.expansion_ppm_per_k.map(|ppm| ppm * 1e-6),
        u_expansion: [0.0; 3],
        growth: point_of_mm(it.growth_um_per_k.map(|um| um * 1e-3)),
        squareness: it.squareness_arcsec_per_k.map(Radians::from_arcsec),
        u: it.u_kelvin(),
    });
    Thermal {
        channels: channels.collect(),
        bends: Vec::new(),
        fixed: point_of_mm(config.expansion_fixed_mm),
    }
}

/// The guides that bend, as identification looks for their bows: from tilts alone, since films and
/// supports shift a slide sideways too.
pub(crate) fn bend_plans(config: &VolumetricConfig) -> Vec<BendPlan> {
    let place = |axis: Axis| {
        let beam = config.beam.each()[axis.index()];
        let detector = beam.and_then(BeamConfig::on_the_slide);
        detector.map(|it| point_of_mm(it.place_mm()))
    };
    let each = config.bend.iter().map(|it| BendPlan {
        seen_from: place(volume_axis(it.axis)),
        axis: volume_axis(it.axis),
        towards: volume_axis(it.towards),
        over: it.over,
        under: it.under,
        low: Metres::from_mm(it.low_mm),
        high: Metres::from_mm(it.high_mm),
        sideways: false,
    });
    each.collect()
}

/// The influence functions; 1 where there is none.
///
/// # Errors
/// When positions and factors form no function.
pub(crate) fn influences(config: &[InfluenceConfig]) -> Result<Influences, FunctionError> {
    let mut influences = Influences::default();
    for it in config {
        let nodes: Vec<_> = it
            .position_mm
            .iter()
            .map(|mm| Metres::from_mm(*mm))
            .collect();
        let factors: Vec<_> = it.factor.iter().copied().map(Metres).collect();
        let function = Function::new(&nodes, &factors, Shape::Linear)?;
        let (axis, direction) = (volume_axis(it.axis), volume_axis(it.direction));
        let Some(place) = axis.others().iter().position(|it| *it == direction) else {
            continue;
        };
        let along = volume_axis(it.along).index();
        influences.of[axis.index()][place].along[along] = Some(function);
    }
    Ok(influences)
}

/// How values of detectors come and go that are given `repeats` times each: so often a feed counts what it is given.
pub(crate) fn feed_settings(config: &FeedConfig, repeats: u32) -> FeedSettings {
    FeedSettings {
        patience: millis(config.patience_ms),
        reaction: match config.reaction {
            ReactionName::Hold => Reaction::Hold,
            ReactionName::FadeOut => Reaction::FadeOut(seconds(config.fade_out_s.expect(CHECKED))),
            ReactionName::Stop => Reaction::Stop,
        },
        blend: seconds(config.blend_s),
        confirm: config.confirm.saturating_mul(repeats),
        smoothing: seconds(config.smoothing_s),
        repeats,
    }
}

/// What the model's deviations may be at most.
pub(crate) fn model_limits(config: &VolumetricCompensationConfig) -> Limits {
    Limits {
        size: Metres::from_um(config.size_limit_um),
        slope: config.slope_limit,
        rate: MetresPerSecond(config.rate_limit_um_per_s * 1e-6),
    }
}
