//! Why the cyclic engine refused, or had to stop every drive at once.

use core::time::Duration;

use units::{Metres, MetresPerSecond};

use super::AXES_MAX;
use super::motion::MotionError;

/// Why the cyclic engine cannot begin or go on.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EngineFailure {
    /// Nothing to move, or too much.
    #[error("{seen} axes: the cyclic engine moves 1 to {AXES_MAX}")]
    Axes {
        /// How many were named.
        seen: usize,
    },
    /// An axis is not made for it.
    #[error("axis {axis}: [axis.{axis}.cyclic] is missing in the configuration")]
    NotConfigured {
        /// Which axis.
        axis: String,
    },
    /// An axis cannot be moved in two ways.
    #[error("axis {axis}: named twice; name each axis of a motion once")]
    Twice {
        /// Which axis.
        axis: String,
    },
    /// The machine's buses have different SYNC periods.
    #[error(
        "[can.{bus}]: the SYNC period is {seen:?}, but that of the axes that move together is \
         {expected:?}, and their SYNC is sent on every CAN bus; give all CAN buses the same \
         sync_period_ms"
    )]
    Periods {
        /// The bus with another period.
        bus: String,
        /// The axes' period.
        expected: Duration,
        /// This one's.
        seen: Duration,
    },
    /// An axis goes on moving although nothing drives it.
    #[error(
        "axis {axis}: still moving after {waited:?}; the cyclic mode is entered and left only at \
         rest; does its servo oscillate, or does something push the axis?"
    )]
    NotAtRest {
        /// Which axis.
        axis: String,
        /// How long was waited.
        waited: Duration,
    },
    /// An axis stands where its set-points may not lead.
    #[error(
        "axis {axis}: stands at {:.6} mm, outside the soft limits {:.3} to {:.3} mm; nothing was \
         moved; move it back with `truestage move`, which zeroes it first",
        at.mm(), min.mm(), max.mm()
    )]
    Outside {
        /// Which axis.
        axis: String,
        /// Where it stands.
        at: Metres,
        /// The lower limit.
        min: Metres,
        /// The upper limit.
        max: Metres,
    },
    /// A drive does not say what it holds.
    #[error("axis {axis}: its drive is no longer in the cyclic mode")]
    NotCyclic {
        /// Which axis.
        axis: String,
    },
    /// A calibration's correction would be cut off on the way.
    #[error(
        "axis {axis}: its calibration corrects by up to {:.3} um, and by up to {:.3} um/s at full \
         speed, which is more than [axis.{axis}.cyclic] allows; raise correction_limit_um and \
         correction_rate_um_per_s, or lower speed_max_mm_per_s",
        size.um(), rate.value() * 1e6
    )]
    CorrectionLimit {
        /// Which axis.
        axis: String,
        /// The largest deviation of its table.
        size: Metres,
        /// How fast the correction changes at the axis's full speed.
        rate: MetresPerSecond,
    },
    /// A target cannot be reached.
    #[error(transparent)]
    Motion(MotionError),
    /// An axis stopped answering.
    #[error(
        "axis {axis}: no position for {periods} SYNC periods; all drives were stopped at once; \
         check its cable and power{}",
        late_answers(*late)
    )]
    Missing {
        /// Which axis.
        axis: String,
        /// For so long.
        periods: u32,
        /// How many positions of any axis came, so far, after half of their period.
        late: u64,
    },
    /// An axis is not where it was sent.
    #[error(
        "axis {axis}: {:.3} um away from its set-points, the limit is {:.3} um; all drives were \
         stopped at once; is it blocked, too fast, or moving in the wrong direction?",
        lag.um(), limit.um()
    )]
    Deviates {
        /// Which axis.
        axis: String,
        /// How far.
        lag: Metres,
        /// How far it may be.
        limit: Metres,
    },
    /// So many SYNCs were missed that the drives reacted by themselves.
    #[error(
        "the loop was late by {} (the computer was held up), then: {then}; all drives were stopped at \
         once; give the computer less to do, or allow SCHED_FIFO",
        units::Several(*periods, "period")
    )]
    HeldUp {
        /// How many SYNCs were missed.
        periods: u32,
        /// What came of it.
        then: String,
    },
    /// A frame could not leave before its SYNC.
    #[error(
        "set-points could not be sent before their SYNC ({why}); all drives were stopped at \
         once; raise txqueuelen, or lower the bus load"
    )]
    NotSent {
        /// What the port said.
        why: String,
    },
    /// No way to stop within the limits was found.
    #[error("no controlled stop was found; all drives were stopped at once")]
    NoStop,
    /// The engine takes no more commands.
    #[error("the engine has ended, or too many commands are waiting")]
    NotTaken,
}

/// A few are the rest of what came before the loop began.
fn late_answers(late: u64) -> String {
    if late < 3 {
        return String::new();
    }
    format!(
        "; {late} positions arrived in the second half of their SYNC period, too late to be used \
         in it: is the bus, an adapter or the computer too slow for this period?"
    )
}

impl EngineFailure {
    /// As [`crate::Failure::exit_code`].
    pub const fn exit_code(&self) -> u8 {
        match self {
            Self::Axes { .. }
            | Self::NotConfigured { .. }
            | Self::Twice { .. }
            | Self::Periods { .. }
            | Self::CorrectionLimit { .. } => 2,
            Self::Outside { .. } | Self::Motion(_) => 3,
            Self::NotAtRest { .. }
            | Self::NotCyclic { .. }
            | Self::Missing { .. }
            | Self::Deviates { .. }
            | Self::HeldUp { .. }
            | Self::NotSent { .. }
            | Self::NoStop
            | Self::NotTaken => 4,
        }
    }
}
