//! A sweep over both Hall sensors' curves, as far as a search goes, and what Vc and which bands follow from it.

use std::path::{Path, PathBuf};

use compensator::hall_zero::{
    HallPoint, HallSeries, Pass, PlanError, Settings, ZeroPlan, plan_zero,
};
use machine::ask_disk;
use units::Metres;

use crate::assemble;
use crate::config::{AxisConfig, MachineConfig};
use crate::failure::Failure;
use crate::linear::ZeroConfig;
use crate::linear::pairing::sampling_of;
use crate::linear::passes::BETWEEN_PASSES;
use crate::linear::stage::LinearStage;
use crate::run::{missing, utc_now};
use crate::store::Store;

/// How often the curves are passed, half of that in reverse.
const PASSES: u32 = 4;

/// What a sweep proposes for the zero of an axis.
#[derive(Clone, Debug)]
pub struct ZeroPlanned {
    /// Which axis.
    pub axis: String,
    /// What is proposed.
    pub plan: ZeroPlan,
    /// How many passes it rests on, and over which places.
    pub passes: usize,
    /// From here …
    pub from: Metres,
    /// … to here.
    pub to: Metres,
    /// The sweep, to be planned with again.
    pub sweep: PathBuf,
}

impl LinearStage<'_> {
    /// Refers the axis to its limit switch, passes over the curves of its Hall sensors as far as its search may go,
    /// keeps that sweep in `store`, and proposes Vc and the bands of the search. The axis is not zeroed by that.
    ///
    /// # Errors
    /// Whatever stops the machine; a side of a gantry; curves from which nothing can be proposed.
    pub fn plan_zero(&mut self, store: &Store) -> Result<ZeroPlanned, Failure> {
        self.require_alone()?;
        let config = self.config.zero.as_ref();
        let config = config.ok_or_else(|| missing(self.axis, "zero"))?;
        self.core.set_zeroed(self.axis, false)?;
        self.go_to_nominal(config)?;
        let settings = assemble::hall_settings(config, &self.config.motion);
        let sweep = self.sweep(config, &settings)?;
        let stamp = utc_now().replace([':', '-'], "");
        let path = store
            .runs()
            .join(format!("{stamp}-sweep-{}.csv", self.axis));
        let (to, text) = (path.clone(), sweep.to_csv());
        ask_disk(&mut self.core, store, move |store| {
            store.write_report(&to, &text)
        })??;
        planned(self.core.config, self.axis, &sweep, &path)
    }

    fn sweep(&mut self, config: &ZeroConfig, settings: &Settings) -> Result<HallSeries, Failure> {
        let low = settings.soft_min.max(Metres::ZERO - settings.search_limit);
        let high = settings.soft_max.min(settings.search_limit);
        let speed = self.usual_pass_speed(config, settings);
        self.pass(config, low, speed)?;
        let mut points: Vec<HallPoint> = Vec::new();
        for number in 0..PASSES {
            self.rest(BETWEEN_PASSES)?;
            let end = if number % 2 == 0 { high } else { low };
            points.extend(self.pass(config, end, speed)?.points);
        }
        HallSeries::new(points).map_err(|source| Failure::Data(Box::new(source)))
    }
}

/// What `sweep`, kept at `path`, proposes for the zero of `axis`.
///
/// # Errors
/// When the axis has no section `zero`, or nothing can be proposed.
pub(crate) fn planned(
    config: &MachineConfig,
    axis: &str,
    sweep: &HallSeries,
    path: &Path,
) -> Result<ZeroPlanned, Failure> {
    let known = config.axis.get_key_value(axis);
    let of_axis: Option<(&AxisConfig, &ZeroConfig)> =
        known.and_then(|(_, it)| Some((it, it.zero.as_ref()?)));
    let (own, zero) = of_axis.ok_or_else(|| missing(axis, "zero"))?;
    let settings = assemble::hall_settings(zero, &own.motion);
    let passes = Pass::all_of(sweep);
    let failed = |source: PlanError| Failure::ZeroPlan {
        axis: axis.to_owned(),
        sweep: path.to_owned(),
        source,
    };
    let plan = plan_zero(&passes, &settings, sampling_of(config, own, zero)).map_err(failed)?;
    let places = || sweep.points().iter().map(|it| it.position.value());
    Ok(ZeroPlanned {
        axis: axis.to_owned(),
        plan,
        passes: passes.len(),
        from: Metres(places().fold(f64::INFINITY, f64::min)),
        to: Metres(places().fold(f64::NEG_INFINITY, f64::max)),
        sweep: path.to_owned(),
    })
}
