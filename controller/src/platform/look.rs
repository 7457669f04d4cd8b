//! What the camera says of the platform.

use compensator::platform::Pose;
use drivers::device::PoseReading;

use crate::failure::Failure;
use crate::platform::failure::PlatformFailure;
use crate::platform::handle::AlignmentPlatform;
use crate::platform::zero::DATUM_LOOKS;
use units::portable::hypot;
use units::{Metres, Radians};

/// Where the camera sees a platform, and how uncertain that is.
#[derive(Clone, Copy, Debug)]
pub(super) struct SeenPose {
    /// In the machine's frame.
    pub(super) pose: Pose,
    /// The standard uncertainty of each part, counted from the zero; `None` where a single picture does not tell it.
    pub(super) uncertainty: Option<Pose>,
}

/// What several pictures say of a pose.
pub(super) struct Seen {
    pub(super) pose: Pose,
    /// Covariance of their mean in x, y (m) and angle (rad), by what they do not repeat; `None` of a single one.
    pub(super) covariance: Option<[[f64; 3]; 3]>,
}

impl AlignmentPlatform<'_> {
    /// Where the platform is, seen from where its screws' zeros put it.
    ///
    /// # Errors
    /// Not zeroed, or the camera sees nothing it can judge.
    pub fn measure_pose(&mut self) -> Result<Pose, Failure> {
        self.state.datum.ok_or(PlatformFailure::NotZeroed)?;
        let seen = self.look()?;
        self.since_zero(seen)
    }

    /// Where the camera sees the platform now, in the machine's frame; the platform needs no zero for that.
    ///
    /// # Errors
    /// The camera sees nothing it can judge.
    pub fn look(&mut self) -> Result<Pose, Failure> {
        self.camera_pose(self.config.exposures)
    }

    /// The place that the camera has `seen`, from where the screws' zeros put the platform.
    ///
    /// # Errors
    /// Not zeroed.
    pub fn since_zero(&self, seen: Pose) -> Result<Pose, Failure> {
        let datum = self.state.datum.ok_or(PlatformFailure::NotZeroed)?;
        Ok(seen.since(datum))
    }

    /// Where the camera sees the platform, in the machine's frame.
    pub(super) fn camera_pose(&mut self, exposures: u32) -> Result<Pose, Failure> {
        Ok(self.camera_sees(exposures)?.pose)
    }

    /// The same, with what its pictures do not repeat.
    pub(super) fn camera_sees(&mut self, exposures: u32) -> Result<Seen, Failure> {
        let camera = self.config.camera.clone();
        let reading = self.core.look(&camera, exposures)?;
        let PoseReading { x, y, angle, .. } = reading;
        let pictures = f64::from(reading.samples);
        let of_mean = || reading.covariance.map(|row| row.map(|it| it / pictures));
        Ok(Seen {
            pose: Pose { x, y, angle },
            covariance: (reading.samples > 1).then(of_mean),
        })
    }

    /// How uncertain the camera's own scale and teaching make what it sees, by the configuration.
    pub(super) fn camera_u(&self) -> Pose {
        let camera = &self.core.config.camera[&self.config.camera];
        let length = Metres::from_um(camera.standard_uncertainty_um);
        Pose {
            x: length,
            y: length,
            angle: Radians::from_arcsec(camera.standard_uncertainty_arcsec),
        }
    }

    /// The same, with how uncertain it is: by the camera's own scale and teaching, and by what the pictures scatter,
    /// also those of the zero.
    pub(super) fn look_closely(&mut self) -> Result<SeenPose, Failure> {
        let Seen { pose, covariance } = self.camera_sees(self.config.exposures)?;
        let own = self.camera_u();
        let own = [own.x.value(), own.y.value(), own.angle.value()];
        let share = 1.0 + 1.0 / f64::from(DATUM_LOOKS);
        let uncertainty = covariance.map(|of_mean| {
            let u = |at: usize| hypot(own[at], (of_mean[at][at] * share).sqrt());
            Pose {
                x: Metres(u(0)),
                y: Metres(u(1)),
                angle: Radians(u(2)),
            }
        });
        Ok(SeenPose { pose, uncertainty })
    }
}
