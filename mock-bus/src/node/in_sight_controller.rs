//! An In-Sight vision system in Native Mode over the plant's cameras.
//!
//! Sources: those of [`wire::in_sight`]. It does one thing after the other: what is
//! said while it takes and judges a picture waits in its input buffer, and what does not fit
//! into that is lost. Its job looks for all marks, or for the spots of a beam, of which it tells the brightest, works out the pose that takes them from
//! where they were taught to where they are (the rigid motion of least squares: S. Umeyama,
//! IEEE Trans. PAMI 13 (1991) 376, without scale), and puts count, judgement, pose and score
//! into one cell of text.
//!
//! Absent: loading jobs, images, Extended Native Mode, users.

use core::time::Duration;
use serde::{Deserialize, Deserializer, de::Error};
use std::collections::VecDeque;
use wire::Payload;
use wire::in_sight::{
    ACQUIRE, CELL_ERROR, COUNT_MAX, Cell, Command, Inspection, Status, TERMINATOR,
};

use units::Time;
use units::portable::{atan2, sin_cos};

use super::{Node, Section};
use crate::config::error::{ConfigError, positive};
use crate::plant::config::PlantConfig;
use crate::plant::{Mark, Plant, Scene};
use crate::random::Stream;

/// How the system and its job are set.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct InSightControllerConfig {
    /// What `GI` says.
    pub serial_number: String,
    /// What `GI` says.
    pub application_version: String,
    /// The active job.
    pub job: String,
    /// The cell of text with the result.
    #[serde(deserialize_with = "checked_cell")]
    pub result_cell: Cell,
    /// The job's unit of x and y.
    pub length_unit_um: f64,
    /// The job's unit of the angle.
    pub angle_unit_arcsec: f64,
    /// What its cameras look at.
    pub looks_at: Scene,
    /// Whether it goes online by itself when it has booted.
    pub online_at_start: bool,
    /// From power-on until it listens.
    pub boot_ms: f64,
    /// From a command's end to its answer's start; the answer varies by up to the jitter.
    pub reply_ms: f64,
    /// See there.
    pub reply_jitter_ms: f64,
    /// From a trigger to the opening of the shutters.
    pub trigger_delay_ms: f64,
    /// How long the shutters are open.
    pub exposure_ms: f64,
    /// From their closing to the result, which varies by up to the jitter.
    pub processing_ms: f64,
    /// See there.
    pub processing_jitter_ms: f64,
    /// How many marks or spots the job looks for at most.
    pub number_to_find: usize,
    /// A mark with a lower score (0 to 100) is not found.
    pub find_threshold: f64,
    /// A picture with a lower score is judged bad.
    pub accept_threshold: f64,
    /// How it misbehaves.
    pub quirks: InSightQuirks,
}

/// What real systems and those around them do; the default is nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct InSightQuirks {
    /// Somebody has set it offline by hand: `SO1` answers -5.
    pub held_offline: bool,
    /// Triggers have no effect, and no answer.
    pub triggers_ignored: bool,
    /// A light barrier triggers, too: every picture is followed by another one.
    pub triggered_twice: bool,
    /// The result cell shows an error.
    pub cell_broken: bool,
}

impl Default for InSightControllerConfig {
    fn default() -> Self {
        Self {
            serial_number: "1A1801XX000001".to_owned(),
            application_version: "6.01.01".to_owned(),
            job: "platform.job".to_owned(),
            result_cell: Cell::new('C', 7).expect("C7 is a cell"),
            length_unit_um: 1.0,
            angle_unit_arcsec: 1.0,
            looks_at: Scene::Marks,
            online_at_start: true,
            boot_ms: 1500.0,
            reply_ms: 2.0,
            reply_jitter_ms: 1.0,
            trigger_delay_ms: 0.5,
            exposure_ms: 8.0,
            processing_ms: 35.0,
            processing_jitter_ms: 6.0,
            number_to_find: 10,
            find_threshold: 25.0,
            accept_threshold: 60.0,
            quirks: InSightQuirks::default(),
        }
    }
}

/// Refuses what is no cell where the file is read.
fn checked_cell<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Cell, D::Error> {
    let text = String::deserialize(deserializer)?;
    Cell::parse(&text).ok_or_else(|| {
        D::Error::custom(format_args!(
            "result_cell {text} is not a cell; cells are A0 to Z399"
        ))
    })
}

/// So much is kept of what is said while it is busy.
const BUFFER_BYTES: usize = 128;

/// What it is at.
#[derive(Clone, Debug, PartialEq)]
enum Doing {
    Nothing,
    Answering { at: Time, answer: String },
    Triggered { shutters_open: Time },
    Exposing { shutters_close: Time },
    Judging { done: Time, picture: Inspection },
}

/// The emulated vision system.
///
/// # Example
///
/// ```
/// use mock_bus::node::Node;
/// use mock_bus::node::in_sight_controller::{InSightControllerConfig, InSightControllerNode};
/// use mock_bus::plant::Plant;
/// use units::Time;
/// use wire::Payload;
///
/// let (config, mut plant) = (InSightControllerConfig::default(), Plant::default());
/// let mut camera = InSightControllerNode::new(&config, 1, "eye");
/// camera.power_on(Time::ZERO, &mut plant);
/// let asked = Payload::Bytes(b"GF\r".to_vec());
/// camera.handle(Time::from_seconds(2.0), &asked, &mut plant);
/// camera.advance(camera.next_event(), &mut plant);
/// let answer = b"1\rplatform.job\r".to_vec();
/// assert_eq!(camera.poll_transmit(), Some(Payload::Bytes(answer)));
/// ```
#[derive(Clone, Debug)]
pub struct InSightControllerNode {
    config: InSightControllerConfig,
    listens_from: Time,
    buffer: VecDeque<u8>,
    online: bool,
    doing: Doing,
    /// Pictures taken since it was switched on, and what the last one showed.
    result: Inspection,
    outbox: VecDeque<Payload>,
    jitter: Stream,
}

impl InSightControllerNode {
    /// A system without power; `seed` and `name` choose its jitter.
    pub fn new(config: &InSightControllerConfig, seed: u64, name: &str) -> Self {
        Self {
            config: config.clone(),
            listens_from: Time::NEVER,
            buffer: VecDeque::new(),
            online: false,
            doing: Doing::Nothing,
            result: NO_PICTURE,
            outbox: VecDeque::new(),
            jitter: Stream::new(seed, &format!("{name} timing")),
        }
    }

    /// How it misbehaves from now on.
    pub fn quirks_mut(&mut self) -> &mut InSightQuirks {
        &mut self.config.quirks
    }

    /// Somebody loads another job: its count begins anew.
    pub fn load_job(&mut self, name: &str) {
        name.clone_into(&mut self.config.job);
        self.result = NO_PICTURE;
    }

    /// Somebody sets it offline, or online again.
    pub fn set_online(&mut self, online: bool) {
        self.online = online;
        self.config.quirks.held_offline = !online;
    }

    /// How many pictures it has taken: for judges.
    pub const fn pictures(&self) -> u32 {
        self.result.count
    }

    fn after(&mut self, now: Time, ms: f64, jitter_ms: f64) -> Time {
        let ms = ms + jitter_ms * self.jitter.uniform();
        now + Duration::from_secs_f64(ms * 1e-3)
    }

    /// Goes on with what is in the buffer.
    fn look_for_work(&mut self, now: Time) {
        while self.doing == Doing::Nothing {
            let Some(end) = self.buffer.iter().position(|byte| *byte == TERMINATOR) else {
                return;
            };
            let line: Vec<u8> = self.buffer.drain(..=end).collect();
            let line = String::from_utf8_lossy(&line[..end]).into_owned();
            if !line.is_empty() {
                self.obey(now, &line);
            }
        }
    }

    fn obey(&mut self, now: Time, line: &str) {
        let lines = match Command::parse(line) {
            Err(status) => vec![status.emit()],
            Ok(Command::SetOnline(online)) => vec![self.go_online(online).emit()],
            Ok(Command::GetOnline) => vec![u8::from(self.online).to_string()],
            Ok(Command::GetFile) => vec![Status::Done.emit(), self.config.job.clone()],
            Ok(Command::GetInfo) => self.information(),
            Ok(Command::GetValue(cell)) => self.value(cell),
            Ok(Command::SetEventAndWait(ACQUIRE)) if self.online => return self.trigger(now),
            // The job has no soft events: there is nothing to wait for.
            Ok(Command::SetEventAndWait(event)) if event < ACQUIRE && self.online => {
                vec![Status::Done.emit()]
            }
            Ok(Command::SetEventAndWait(_)) => vec![Status::NotExecuted.emit()],
        };
        let at = self.after(now, self.config.reply_ms, self.config.reply_jitter_ms);
        let answer = lines.into_iter().map(|line| line + "\r").collect();
        self.doing = Doing::Answering { at, answer };
    }

    fn go_online(&mut self, online: bool) -> Status {
        if online && self.config.quirks.held_offline {
            return Status::HeldOffline;
        }
        self.online = online;
        Status::Done
    }

    fn information(&self) -> Vec<String> {
        vec![
            Status::Done.emit(),
            format!("Serial Number: {}", self.config.serial_number),
            format!("Application Version: {}", self.config.application_version),
        ]
    }

    fn value(&self, cell: Cell) -> Vec<String> {
        let text = if cell != self.config.result_cell {
            String::new()
        } else if self.config.quirks.cell_broken {
            CELL_ERROR.to_owned()
        } else {
            self.result.emit()
        };
        vec![Status::Done.emit(), text]
    }

    fn trigger(&mut self, now: Time) {
        if !self.config.quirks.triggers_ignored {
            let shutters_open = self.after(now, self.config.trigger_delay_ms, 0.0);
            self.doing = Doing::Triggered { shutters_open };
        }
    }

    /// What was begun has come to its end.
    fn go_on(&mut self, now: Time, plant: &mut Plant) {
        match core::mem::replace(&mut self.doing, Doing::Nothing) {
            Doing::Nothing => {}
            Doing::Answering { answer, .. } => self.say(answer),
            Doing::Triggered { .. } => {
                plant.open_shutter(self.config.looks_at);
                let shutters_close = self.after(now, self.config.exposure_ms, 0.0);
                self.doing = Doing::Exposing { shutters_close };
            }
            Doing::Exposing { .. } => {
                let picture = self.judge(&plant.close_shutter(self.config.looks_at));
                let (ms, jitter_ms) = (self.config.processing_ms, self.config.processing_jitter_ms);
                let done = self.after(now, ms, jitter_ms);
                self.doing = Doing::Judging { done, picture };
            }
            Doing::Judging { picture, .. } => {
                self.result = picture;
                if self.config.quirks.triggered_twice {
                    self.result.count = next_count(self.result.count);
                }
                self.say(Status::Done.emit() + "\r");
            }
        }
    }

    fn say(&mut self, text: String) {
        self.outbox.push_back(Payload::Bytes(text.into_bytes()));
    }

    fn judge(&self, marks: &[Option<Mark>]) -> Inspection {
        let found: Vec<Mark> = marks
            .iter()
            .flatten()
            .filter(|mark| mark.likeness * 100.0 >= self.config.find_threshold)
            .take(self.config.number_to_find)
            .copied()
            .collect();
        let count = next_count(self.result.count);
        let (all, told) = match self.config.looks_at {
            Scene::Marks => (marks.len(), found.len()),
            Scene::Beam { .. } => (1, 1),
        };
        let used = &found[..told.min(found.len())];
        let score = used.iter().map(|mark| mark.likeness * 100.0);
        let score = score.fold(100.0, f64::min);
        let least = self.config.looks_at.least();
        if found.len() < all || found.len() < least {
            return Inspection {
                count,
                found: found.len() as u32,
                score: if found.is_empty() { 0.0 } else { score },
                ..NO_PICTURE
            };
        }
        let [x_m, y_m, angle] = motion(used);
        Inspection {
            count,
            found: found.len() as u32,
            judged_ok: score >= self.config.accept_threshold,
            x: x_m * 1e6 / self.config.length_unit_um,
            y: y_m * 1e6 / self.config.length_unit_um,
            angle: angle.to_degrees() * 3600.0 / self.config.angle_unit_arcsec,
            score,
        }
    }

    fn reset(&mut self) {
        self.buffer.clear();
        self.outbox.clear();
        self.doing = Doing::Nothing;
        self.result = NO_PICTURE;
        self.online = false;
    }
}

const NO_PICTURE: Inspection = Inspection {
    count: 0,
    found: 0,
    judged_ok: false,
    x: 0.0,
    y: 0.0,
    angle: 0.0,
    score: 0.0,
};

const fn next_count(count: u32) -> u32 {
    if count >= COUNT_MAX { 0 } else { count + 1 }
}

/// The displacement of the frame's origin and the turn that take the marks nearest to where
/// they are.
fn motion(marks: &[Mark]) -> [f64; 3] {
    let number = marks.len() as f64;
    let middle = |place: fn(&Mark) -> [f64; 2]| {
        [0, 1].map(|i| marks.iter().map(|mark| place(mark)[i]).sum::<f64>() / number)
    };
    let (was, is) = (middle(|mark| mark.built_m), middle(|mark| mark.place_m));
    let (mut cosines, mut sines) = (0.0, 0.0);
    for mark in marks {
        let [ax, ay] = [0, 1].map(|i| mark.built_m[i] - was[i]);
        let [bx, by] = [0, 1].map(|i| mark.place_m[i] - is[i]);
        cosines += ax * bx + ay * by;
        sines += ax * by - ay * bx;
    }
    let angle = atan2(sines, cosines);
    let (sin, cos) = sin_cos(angle);
    [
        is[0] - (cos * was[0] - sin * was[1]),
        is[1] - (sin * was[0] + cos * was[1]),
        angle,
    ]
}

impl Section for InSightControllerConfig {
    fn check(&self, plant: &PlantConfig) -> Result<(), ConfigError> {
        plant.check_scene(self.looks_at)?;
        positive("length_unit_um", self.length_unit_um)?;
        positive("angle_unit_arcsec", self.angle_unit_arcsec)?;
        positive("exposure_ms", self.exposure_ms)
    }

    fn build(&self, seed: u64, name: &str) -> Box<dyn Node> {
        Box::new(InSightControllerNode::new(self, seed, name))
    }
}

impl Node for InSightControllerNode {
    fn handle(&mut self, now: Time, payload: &Payload, _plant: &mut Plant) {
        let Payload::Bytes(bytes) = payload else {
            return;
        };
        if now < self.listens_from {
            return;
        }
        for byte in bytes {
            if self.buffer.len() < BUFFER_BYTES {
                self.buffer.push_back(*byte);
            }
        }
        self.look_for_work(now);
    }

    fn advance(&mut self, now: Time, plant: &mut Plant) {
        while self.next_event() <= now {
            self.go_on(now, plant);
            self.look_for_work(now);
        }
    }

    fn next_event(&self) -> Time {
        match &self.doing {
            Doing::Nothing => Time::NEVER,
            Doing::Answering { at, .. } => *at,
            Doing::Triggered { shutters_open } => *shutters_open,
            Doing::Exposing { shutters_close } => *shutters_close,
            Doing::Judging { done, .. } => *done,
        }
    }

    fn poll_transmit(&mut self) -> Option<Payload> {
        self.outbox.pop_front()
    }

    fn power_off(&mut self, _now: Time, _plant: &mut Plant) {
        self.reset();
        self.listens_from = Time::NEVER;
    }

    fn power_on(&mut self, now: Time, _plant: &mut Plant) {
        self.reset();
        self.online = self.config.online_at_start && !self.config.quirks.held_offline;
        self.listens_from = now + Duration::from_secs_f64(self.config.boot_ms * 1e-3);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::Target;
    use crate::plant::config::PlantConfig;
    use crate::plant::platform::config::PlatformConfig;

    struct Rig {
        node: InSightControllerNode,
        plant: Plant,
        now: Time,
    }

    impl Rig {
        fn new() -> Self {
            let config = PlantConfig {
                platform: Some(PlatformConfig::default()),
                ..PlantConfig::default()
            };
            let mut rig = Self {
                node: InSightControllerNode::new(&InSightControllerConfig::default(), 1, "eye"),
                plant: Plant::new(&config, 1),
                now: Time::ZERO,
            };
            rig.node.power_on(rig.now, &mut rig.plant);
            assert_eq!(rig.ask("GF"), "", "it boots");
            rig.now = Time::from_seconds(2.0);
            rig
        }

        fn say(&mut self, line: &str) {
            let payload = Payload::Bytes(format!("{line}\r").into_bytes());
            self.node.handle(self.now, &payload, &mut self.plant);
        }

        /// Everything it says until it rests.
        fn listen(&mut self) -> String {
            let mut said = Vec::new();
            loop {
                while let Some(Payload::Bytes(bytes)) = self.node.poll_transmit() {
                    said.extend(bytes);
                }
                let next = self.node.next_event();
                if next == Time::NEVER {
                    return String::from_utf8(said).unwrap().replace('\r', "|");
                }
                self.now = next;
                self.plant.advance(next);
                self.node.advance(next, &mut self.plant);
            }
        }

        fn ask(&mut self, line: &str) -> String {
            self.say(line);
            self.listen()
        }

        fn result(&mut self) -> Inspection {
            let said = self.ask("GVC007");
            let text = said.strip_prefix("1|").unwrap().trim_end_matches('|');
            Inspection::parse(text).unwrap_or_else(|error| panic!("{said}: {error}"))
        }
    }

    #[test]
    fn it_answers_in_native_mode() {
        let mut rig = Rig::new();
        assert_eq!(rig.ask("GF"), "1|platform.job|");
        assert_eq!(rig.ask("go"), "1|");
        assert!(rig.ask("GI").starts_with("1|Serial Number: 1A"));
        assert_eq!(rig.ask("SO0"), "1|");
        assert_eq!(rig.ask("SW8"), "-2|");
        assert_eq!(rig.ask("SO1"), "1|");
        assert_eq!(rig.ask("XX"), "0|");
        assert_eq!(rig.ask("SW9"), "-1|");
        assert_eq!(rig.ask("GVA001"), "1||");
        assert_eq!(rig.ask(""), "");
        rig.node.set_online(false);
        assert_eq!(rig.ask("SO1"), "-5|");
    }

    #[test]
    fn a_picture_takes_its_time_and_shows_where_the_platform_is() {
        let mut rig = Rig::new();
        assert_eq!(rig.result().count, 0);
        let from = rig.now;
        assert_eq!(rig.ask("SW8"), "1|");
        let took = (rig.now - from).as_secs_f64();
        assert!((0.043..0.051).contains(&took), "{took} s");
        let seen = rig.result();
        assert_eq!((seen.count, seen.found, seen.judged_ok), (1, 2, true));
        let truth = rig.plant.truth();
        let pose = truth.platform().unwrap().pose();
        assert!((seen.x - pose.x.um()).abs() < 0.6, "{seen:?} {pose:?}");
        assert!((seen.y - pose.y.um()).abs() < 0.6, "{seen:?} {pose:?}");
        let turn = seen.angle - pose.angle.arcsec();
        assert!(turn.abs() < 2.0, "{seen:?} {pose:?}");
        rig.ask("SW8");
        assert_eq!(rig.result().count, 2);
    }

    /// The brighter one is the job's first: with a reflection that is brighter than the beam it is the wrong one, and a
    /// job that looks for one spot only does not even say so.
    #[test]
    fn of_several_spots_the_job_tells_the_brightest_and_how_many_there_are() {
        let spot = |um: f64, likeness: f64| {
            Some(Mark {
                place_m: [um * 1e-6, 0.0],
                built_m: [0.0; 2],
                likeness,
            })
        };
        let mut config = InSightControllerConfig {
            looks_at: Scene::Beam {
                axis: 0,
                at: crate::plant::BeamPlace::Slide,
            },
            ..InSightControllerConfig::default()
        };
        let judge = |config: &InSightControllerConfig, marks: &[Option<Mark>]| {
            let it = InSightControllerNode::new(config, 1, "eye").judge(marks);
            (it.found, it.judged_ok, it.x)
        };
        let both = [spot(80.0, 0.97), spot(3.0, 0.9)];
        assert_eq!(judge(&config, &both), (2, true, 80.0));
        assert_eq!(judge(&config, &[both[1]]), (1, true, 3.0));
        assert_eq!(judge(&config, &[both[0], spot(3.0, 0.2)]), (1, true, 80.0));
        assert_eq!(judge(&config, &[]), (0, false, 0.0));
        config.number_to_find = 1;
        assert_eq!(judge(&config, &both), (1, true, 80.0));
    }

    #[test]
    fn what_is_said_meanwhile_waits_in_a_buffer_that_can_run_over() {
        let mut rig = Rig::new();
        rig.say("SW8");
        rig.say("GO");
        rig.say("GF");
        assert_eq!(rig.listen(), "1|1|1|platform.job|");
        rig.say("SW8");
        for _ in 0..100 {
            rig.say("GO");
        }
        let answers = rig.listen().matches("1|").count();
        assert_eq!(answers, 1 + BUFFER_BYTES / 3);
    }

    #[test]
    fn a_target_that_is_absent_or_covered_is_judged_bad() {
        let mut rig = Rig::new();
        rig.plant.set_target(Target::Absent);
        rig.ask("SW8");
        let seen = rig.result();
        assert_eq!((seen.count, seen.found, seen.judged_ok), (1, 0, false));
        assert_eq!((seen.x, seen.score), (0.0, 0.0));
        rig.plant.set_target(Target::Covered);
        rig.ask("SW8");
        let seen = rig.result();
        assert_eq!((seen.found, seen.judged_ok), (2, false));
        assert!((30.0..45.0).contains(&seen.score), "{seen:?}");
    }

    #[test]
    fn its_quirks_are_those_of_the_field() {
        let mut rig = Rig::new();
        rig.node.quirks_mut().triggers_ignored = true;
        assert_eq!(rig.ask("SW8"), "");
        *rig.node.quirks_mut() = InSightQuirks::default();
        rig.node.quirks_mut().triggered_twice = true;
        rig.ask("SW8");
        assert_eq!(rig.result().count, 2);
        rig.node.quirks_mut().cell_broken = true;
        assert_eq!(rig.ask("GVC007"), "1|#ERR|");
        rig.node.quirks_mut().cell_broken = false;
        rig.node.load_job("other.job");
        assert_eq!(rig.ask("GF"), "1|other.job|");
        assert_eq!(rig.result().count, 0);
    }

    #[test]
    fn power_loss_forgets_everything() {
        let mut rig = Rig::new();
        rig.ask("SW8");
        rig.say("SW8");
        rig.node.power_off(rig.now, &mut rig.plant);
        assert_eq!(rig.listen(), "");
        rig.node.power_on(rig.now, &mut rig.plant);
        assert_eq!(rig.ask("GF"), "", "it boots");
        rig.now += Duration::from_secs(2);
        assert_eq!(rig.result().count, 0);
    }

    #[test]
    fn the_motion_of_marks_is_found_exactly() {
        let turn = 0.01_f64;
        let (sin, cos) = turn.sin_cos();
        let marks: Vec<Mark> = [[-0.06, 0.01], [0.06, -0.02], [0.03, 0.05]]
            .map(|[x, y]: [f64; 2]| Mark {
                built_m: [x, y],
                place_m: [cos * x - sin * y + 1e-3, sin * x + cos * y - 2e-3],
                likeness: 0.9,
            })
            .into();
        let [x, y, angle] = motion(&marks);
        assert!((x - 1e-3).abs() < 1e-15 && (y + 2e-3).abs() < 1e-15);
        assert!((angle - turn).abs() < 1e-14);
    }
}
