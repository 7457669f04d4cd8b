//! The cameras of a machine that are detectors, all together.

use compensator::volumetric::online::Spot;
use units::Time;

use crate::devices::Devices;
use crate::lookout::Lookout;
use crate::notices::Notices;

impl Devices {
    /// The numbers, among all devices, of the cameras that are detectors.
    pub(crate) fn detector_cameras(&self) -> Vec<usize> {
        let cameras = self.cameras.iter().enumerate();
        let detectors = cameras.filter(|(_, camera)| camera.is_detector);
        detectors.map(|(at, _)| self.camera_device(at)).collect()
    }

    /// These have been started, and have shown nothing yet.
    pub(crate) fn open_lookouts(&mut self) {
        let cameras = self.cameras.iter().zip(&mut self.lookouts);
        for (_, lookout) in cameras.filter(|(camera, _)| camera.is_detector) {
            *lookout = Lookout::opened();
        }
    }

    /// Takes what pictures have shown by now, and asks for the next ones where they are `wanted`; a camera that fails is
    /// told once.
    pub(crate) fn keep_looking(&mut self, now: Time, wanted: bool, notices: &mut Notices) {
        for (camera, lookout) in self.cameras.iter_mut().zip(&mut self.lookouts) {
            let unit = &mut camera.unit;
            if let Some(error) = lookout.keep_looking(&mut *unit.device, now, wanted) {
                notices.warn(format!("{}: {error}; it is started again", unit.name));
            }
        }
    }

    /// Puts what each camera that is a detector showed last into its place, in the order of the cameras' names;
    /// those that are none keep theirs empty.
    pub fn hear_spots(&self, spots: &mut [Option<Spot>]) {
        for (place, lookout) in spots.iter_mut().zip(&self.lookouts) {
            *place = lookout.newest();
        }
    }

    /// When the newest picture of each camera that is a detector was asked for; `None` before the first.
    pub fn newest_spots(&self) -> impl Iterator<Item = Option<Time>> {
        let cameras = self.cameras.iter().zip(&self.lookouts);
        let detectors = cameras.filter(|(camera, _)| camera.is_detector);
        detectors.map(|(_, lookout)| lookout.newest().map(|it| it.at))
    }
}
