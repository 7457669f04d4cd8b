//! A camera that is a detector: it takes one picture after the other as long as SYNC runs.
//!
//! A picture lasts some periods of SYNC, so nobody waits for one; whoever needs a place takes the newest there is and
//! judges its age. A camera that fails is started again after a pause: what it showed last grows old meanwhile.

use core::time::Duration;

use compensator::volumetric::online::{Spot, Unplaced};
use drivers::device::{DeviceError, PoseInstrument};
use units::Time;

/// How long a camera that failed is left alone: what it lacks is seldom there at once.
const PAUSE: Duration = Duration::from_secs(1);

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum State {
    /// Not started.
    #[default]
    Shut,
    /// Nobody wants a picture.
    Resting,
    Looking,
    /// It failed, and is started again then.
    Failed {
        again: Time,
    },
    /// It is started again.
    Starting,
}

/// What a camera that is a detector is at.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Lookout {
    state: State,
    newest: Option<Spot>,
    /// Whether it has been told that it fails.
    is_told: bool,
}

impl Lookout {
    /// Its camera has been started.
    pub(crate) const fn opened() -> Self {
        Self {
            state: State::Resting,
            newest: None,
            is_told: false,
        }
    }

    /// What the newest picture showed.
    pub(crate) const fn newest(&self) -> Option<Spot> {
        self.newest
    }

    /// Takes what `camera` has shown by now; asks for the next picture where one is `wanted`. Why it failed is told once,
    /// until it has shown something again.
    pub(crate) fn keep_looking(
        &mut self,
        camera: &mut dyn PoseInstrument,
        now: Time,
        wanted: bool,
    ) -> Option<DeviceError> {
        match self.state {
            State::Shut => return None,
            State::Failed { again } if now < again => return None,
            State::Failed { .. } => {
                self.state = State::Starting;
                camera.start(now);
                return None;
            }
            State::Resting => {}
            State::Looking | State::Starting => match camera.poll_outcome()? {
                Ok(()) if self.state == State::Starting => {}
                Ok(()) | Err(DeviceError::NoGoodPicture { .. }) => self.shown(camera),
                Err(error) => {
                    let again = now + PAUSE;
                    self.state = State::Failed { again };
                    let is_new = !core::mem::replace(&mut self.is_told, true);
                    return is_new.then_some(error);
                }
            },
        }
        self.state = State::Resting;
        if wanted {
            self.state = State::Looking;
            camera.begin_pose(now, 1);
        }
        None
    }

    /// Of several spots a job shows the one that it likes best, which need not be the beam's.
    fn shown(&mut self, camera: &dyn PoseInstrument) {
        let place = match (camera.found(), camera.pose()) {
            (spots @ 2.., _) => Err(Unplaced::Several(spots)),
            (_, Some(pose)) => Ok([pose.x, pose.y]),
            (_, None) => Err(Unplaced::NoSpot),
        };
        let at = camera.asked();
        self.newest = Some(Spot { at, place });
        self.is_told = false;
    }
}
