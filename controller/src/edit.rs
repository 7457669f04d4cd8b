//! Edits of the text of a machine's file that must not miss their place.

/// A text in which a passage is replaced. An edit that matches nothing would leave the text as it
/// is, and the caller would then use a machine that was not meant.
pub trait Edit {
    /// The text with every `from` become `to`.
    ///
    /// # Panics
    /// When there is no `from` in it.
    #[must_use]
    #[track_caller]
    fn edit(&self, from: &str, to: &str) -> String;

    /// The text with the first `from` become `to`.
    ///
    /// # Panics
    /// When there is no `from` in it.
    #[must_use]
    #[track_caller]
    fn edit_first(&self, from: &str, to: &str) -> String;
}

impl Edit for str {
    fn edit(&self, from: &str, to: &str) -> String {
        assert!(self.contains(from), "`{from}` is not in the text");
        self.replace(from, to)
    }

    fn edit_first(&self, from: &str, to: &str) -> String {
        assert!(self.contains(from), "`{from}` is not in the text");
        self.replacen(from, to, 1)
    }
}

/// The text of a machine file with the shipped heartbeats made rare: hours without SYNC cost little in
/// virtual time then.
///
/// # Panics
/// When one of them is not in the text.
pub fn with_rare_heartbeats(text: &str) -> String {
    text.edit("master_heartbeat_ms = 50", "master_heartbeat_ms = 2000")
        .edit("heartbeat_producer_ms = 50", "heartbeat_producer_ms = 2000")
        .edit(
            "heartbeat_consumer_ms = 150",
            "heartbeat_consumer_ms = 7000",
        )
        .edit("watch_master_ms = 500", "watch_master_ms = 7000")
}

/// An analog module for the roll detectors of two slides more, before the instrument.
const ROLLS_OF_TWO: &str = r#"
[analog.roll_more]
device = "cia404"
bus = "can0"
node_id = 15
channels = [0, 1, 2, 3]
full_scale_v = [3.2, 3.2, 3.2, 3.2]
every_syncs = 10
heartbeat_producer_ms = 50
heartbeat_consumer_ms = 150
watch_master_ms = 500

[analog.roll_more.identity]
device_type = 0x0002_0194
vendor_id = 0x7FF
product_code = 0x40_0004
revision = 0x1_0000
serial_number = 4015

[instrument.laser]
"#;

/// The text of the shipped machine file of three axes with roll detectors on each slide.
///
/// # Panics
/// When the section of the one slide, or what it says, is not in the text.
pub fn with_three_rolls(text: &str) -> String {
    let start = text.find("[volumetric.roll]").expect("it has one");
    let end = start + text[start..].find("\n\n").expect("it ends");
    let own = &text[start..end];
    let first = own.edit("[volumetric.roll]", "[[volumetric.roll]]");
    let on = |axis: &str, channels: &str| {
        first
            .edit("axis = \"x\"", &format!("axis = \"{axis}\""))
            .edit("roll_and_heat", "roll_more")
            .edit("channels = [0, 1]", &format!("channels = {channels}"))
    };
    let all = [first.clone(), on("z", "[2, 3]"), on("y", "[0, 1]")].join("\n\n");
    text.edit(own, &all)
        .edit("\n[instrument.laser]\n", ROLLS_OF_TWO)
}

/// A detector's voltage at an analog module in place of the touch probe, and a plate whose lines are 1500 arcsec wide.
const LINE_SIGNAL: &str = r#"[rotary.c.line_signal]
analog = "photo"
channel = 2
level_v = 2.2
line = "above"
width_arcsec = 1500.0

[analog.photo]
device = "cia404"
bus = "can0"
node_id = 15
channels = [0, 2]
full_scale_v = [5.0, 5.0]
every_syncs = 1
heartbeat_producer_ms = 50
heartbeat_consumer_ms = 150
watch_master_ms = 500

[analog.photo.identity]
device_type = 0x0002_0194
vendor_id = 0x7FF
product_code = 0x40_0004
revision = 0x1_0000
serial_number = 4015

"#;

/// The text of the shipped machine file of a rotary table whose plate of 72 lines passes a photodiode.
///
/// # Panics
/// When the section of its detector, or what it says, is not in the text.
pub fn with_line_signal(text: &str) -> String {
    let start = text.find("[rotary.c.line_detector]").expect("it has one");
    let end = start
        + text[start..]
            .find("[rotary.c.calibrate]")
            .expect("it follows");
    text.edit(&text[start..end], LINE_SIGNAL)
        .edit("lines = 360", "lines = 72")
        .edit(
            "placement\nspeed_deg_per_s = 60.0",
            "placement\nspeed_deg_per_s = 10.0",
        )
        .edit("offset_lines = 200.5", "offset_lines = 40.5")
}

/// A camera in the place of a detector of four channels; AXIS, NAME, KEY, ROTATION and PLACE are filled in.
const SPOT_CAMERA: &str = r#"
[serial.NAME_AXIS]
path = "/dev/NAME_AXIS"
baud_bit_per_s = 115200

[camera.NAME_AXIS]
device = "in_sight"
line = "NAME_AXIS"
job = "spot.job"
result_cell = "C7"
length_um_per_unit = 1.0
angle_arcsec_per_unit = 1.0
rotation_deg = ROTATION
targets = 1
score_min_percent = 60.0
rejects_max = 0
inspection_timeout_ms = 200.0
standard_uncertainty_um = 0.1
standard_uncertainty_arcsec = 0.0

[volumetric.beam.AXIS.KEY_camera]
camera = "NAME_AXIS"
PLACE
field_um = [250.0, 250.0]
age_max_ms = 450.0
speed_max_um_per_s = 100.0
noise_max_um = 3.0
"#;

/// The text of the shipped machine file of three axes with cameras, on the slide and at the end, that see the beams along
/// `axes`.
///
/// # Panics
/// When one of their detectors is not in the text.
pub fn with_spot_cameras(text: &str, axes: &[&str]) -> String {
    let mut text = text.to_owned();
    for axis in axes {
        // A picture is noisier than the mean of as many samples as there are meanwhile.
        let section = format!("\n[volumetric.beam.{axis}]\n");
        let start = text.find(&section).expect("it has one");
        let (before, rest) = text.split_at(start);
        let own = "standard_uncertainty_um = 0.1";
        text = before.to_owned() + &rest.edit_first(own, "standard_uncertainty_um = 0.2");
        // A slide that goes one way sees its spot go the other way.
        for (key, name, rotation) in [("slider", "slide", "180.0"), ("end", "end", "0.0")] {
            let head = format!("\n[volumetric.beam.{axis}.{key}]\n");
            let start = text.find(&head).expect("it has one");
            let rest = &text[start + 1..];
            let own = &text[start..start + 1 + rest.find("\n[").unwrap_or(rest.len())];
            let place = own.lines().find(|line| line.starts_with("place_mm"));
            let camera = SPOT_CAMERA
                .edit("AXIS", axis)
                .edit("NAME", name)
                .edit("KEY", key)
                .edit("ROTATION", rotation)
                .edit("PLACE", place.unwrap_or_default());
            text = text.edit(own, "") + &camera;
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::Edit;

    #[test]
    fn every_passage_or_the_first_is_exchanged() {
        assert_eq!("a = 1, b = 1".edit("= 1", "= 2"), "a = 2, b = 2");
        assert_eq!("a = 1, b = 1".edit_first("= 1", "= 2"), "a = 2, b = 1");
    }

    #[test]
    #[should_panic(expected = "`= 3` is not in the text")]
    fn an_edit_that_matches_nothing_fails() {
        let _ = "a = 1, b = 1".edit("= 3", "= 2");
    }

    #[test]
    #[should_panic(expected = "`= 3` is not in the text")]
    fn an_edit_of_the_first_that_matches_nothing_fails() {
        let _ = "a = 1, b = 1".edit_first("= 3", "= 2");
    }
}
