//! The emulation of three axes whose beams are seen by cameras.

use crate::Edit;

/// A camera in the place of a detector of four channels.
const CAMERA: &str = r#"
[[ports]]
kind = "serial"
name = "NAME_AXIS"
latency_us = 1000.0

[[nodes]]
name = "NAME_AXIS"
port = "NAME_AXIS"
[nodes.device]
kind = "in_sight_controller"
job = "spot.job"
looks_at = { beam = { axis = NUMBER, at = "NAME" } }
"#;

/// The shipped emulation with cameras, on the slide and at the end, that see the beams along `axes`.
///
/// # Panics
/// When one of them is no axis.
pub fn with_emulated_spot_cameras(text: &str, axes: &[&str]) -> String {
    let mut cameras = String::new();
    for axis in axes {
        let number = ["x", "y", "z"].iter().position(|it| it == axis);
        let number = number.expect("an axis").to_string();
        for name in ["slide", "end"] {
            cameras += &CAMERA
                .edit("NAME", name)
                .edit("AXIS", axis)
                .edit("NUMBER", &number);
        }
    }
    let plant = "\n[plant.volumetric]\n";
    text.edit(plant, &format!("{cameras}{plant}"))
}
