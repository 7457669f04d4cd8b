//! How an image controller is used.

use core::time::Duration;
use units::portable::sin_cos;
use units::{Metres, Radians};
use wire::in_sight::Cell;

/// How the controller's axes lie against the machine's.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CameraFrame {
    /// Turn of its x axis against the machine's, counter-clockwise.
    pub rotation: Radians,
    /// Whether its y axis goes the other way, as in a camera that looks from below; its angles
    /// then do too.
    pub mirrored: bool,
}

impl CameraFrame {
    /// A displacement and a turn in the machine's frame.
    pub(super) fn to_machine(self, [x, y, angle]: [f64; 3]) -> [f64; 3] {
        let sign = if self.mirrored { -1.0 } else { 1.0 };
        let (sin, cos) = sin_cos(self.rotation.value());
        let y = sign * y;
        [cos * x - sin * y, sin * x + cos * y, sign * angle]
    }
}

/// How an image controller is used.
///
/// # Example
///
/// ```
/// use drivers::device::{Device, in_sight::{InSight, InSightSettings}};
/// use units::Time;
/// use wire::in_sight::Cell;
/// use wire::{Input, Payload};
///
/// let cell = Cell::parse("C7").expect("a letter and up to three digits");
/// let mut camera = InSight::new(InSightSettings::new("uvw.job", cell));
/// camera.start(Time::ZERO);
/// camera.poll_transmit();
/// assert_eq!(camera.poll_transmit(), Some(Payload::Bytes(b"GF\r".to_vec())), "which job?");
/// let other = Input::Payload(Payload::Bytes(b"1\rother.job\r".to_vec()));
/// camera.handle(Time::from_seconds(0.01), &other);
/// assert!(matches!(camera.poll_outcome(), Some(Err(_))));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct InSightSettings {
    /// The job that must be active: `GF` answers with its name.
    pub job: String,
    /// What `GI` must name as its serial number; `None`: anything.
    pub serial_number: Option<String>,
    /// The cell of text that holds the inspection.
    pub result_cell: Cell,
    /// Length of one unit of the job's x and y.
    pub length_unit: Metres,
    /// Angle of one unit of the job's angle.
    pub angle_unit: Radians,
    /// How its axes lie against the machine's.
    pub frame: CameraFrame,
    /// How many marks a picture must show.
    pub targets: u32,
    /// A picture with a lower score (0 to 1) is bad, whatever the job says of it.
    pub score_min: f64,
    /// So many bad pictures may be left out of one pose.
    pub rejects_max: u32,
    /// How long the start may take, the system's own boot included.
    pub start_timeout: Duration,
    /// How often a system that may still boot is asked for its job.
    pub start_period: Duration,
    /// How long an answer may take.
    pub answer_timeout: Duration,
    /// How long taking and judging a picture may take.
    pub inspection_timeout: Duration,
    /// From one look at the result to the next while it is still that of the picture before.
    pub result_period: Duration,
    /// How often a step of a measurement is tried again.
    pub retries: u32,
    /// This many damaged lines in a row raise an alarm.
    pub garbage_lines_max: u64,
}

impl InSightSettings {
    /// Usual settings for a job in micrometres and seconds of arc that looks for two marks.
    pub fn new(job: &str, result_cell: Cell) -> Self {
        Self {
            job: job.to_owned(),
            serial_number: None,
            result_cell,
            length_unit: Metres::from_um(1.0),
            angle_unit: Radians::from_arcsec(1.0),
            frame: CameraFrame::default(),
            targets: 2,
            score_min: 0.5,
            rejects_max: 3,
            start_timeout: Duration::from_secs(10),
            start_period: Duration::from_millis(500),
            answer_timeout: Duration::from_millis(500),
            inspection_timeout: Duration::from_secs(3),
            result_period: Duration::from_millis(20),
            retries: 3,
            garbage_lines_max: 20,
        }
    }
}
