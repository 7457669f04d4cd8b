//! The play of screws whose engagement is unknown: it is taken up before it can do harm.

use compensator::screw::{Engagement, ScrewCompensation, ScrewMemory};
use units::{Approach, Metres};

use crate::correction::Correction;
use crate::failure::Failure;
use crate::platform::handle::AlignmentPlatform;
use crate::platform::state::Screw;

/// A screw whose play was taken up.
#[derive(Clone, Debug, PartialEq)]
pub struct TakenUp {
    /// Its axis.
    pub axis: String,
    /// Standard uncertainty of where its nut was before, half the play over √3 included.
    pub standard_uncertainty: Option<Metres>,
}

impl AlignmentPlatform<'_> {
    /// Settles the engagement of every calibrated screw of which it is not known, and says which
    /// these were. Where the soft limits leave no room for it the doubt stays, in the uncertainty
    /// of the moves that follow.
    pub(super) fn take_up(&mut self) -> Result<Vec<TakenUp>, Failure> {
        let screws = self.state.screws.clone();
        let mut goals = Vec::new();
        let mut taken_up = Vec::new();
        for screw in screws {
            let memory = self.screw_memory(&screw.axis, screw.memory)?;
            let room = match &screw.compensation {
                Some(it) if is_in_doubt(memory.engagement) => self.room(&screw, it, &memory),
                _ => None,
            };
            if let (Some(_), Some(compensation)) = (room, &screw.compensation) {
                let here = compensation.expected(memory.set_point, &memory);
                taken_up.push(TakenUp {
                    axis: screw.axis,
                    standard_uncertainty: here.standard_uncertainty,
                });
            }
            goals.push(room.unwrap_or(memory.set_point));
        }
        if !taken_up.is_empty() {
            self.go_to_strokes(&goals, Correction::Off)?;
        }
        Ok(taken_up)
    }

    /// Where the screw must go, forward if the soft limits allow it, otherwise in reverse.
    fn room(
        &self,
        screw: &Screw,
        compensation: &ScrewCompensation,
        memory: &ScrewMemory,
    ) -> Option<Metres> {
        [Approach::Forward, Approach::Reverse]
            .into_iter()
            .filter_map(|towards| compensation.take_up_move(memory, towards))
            .find(|goal| self.core.check_soft_limits(&screw.axis, *goal).is_ok())
    }
}

fn is_in_doubt(engagement: Engagement) -> bool {
    match engagement {
        Engagement::Forward | Engagement::Reverse => false,
        Engagement::Between { least, most } => least != most,
        Engagement::Unknown => true,
    }
}
