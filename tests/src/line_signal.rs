//! The emulation of a rotary table whose plate passes a photodiode.

use crate::Edit;

/// The module that samples the photodiode, and what that shows.
const NODE: &str = r#"[[nodes]]
name = "photo"
port = "can0"
[nodes.device]
kind = "cia404_analog"
node_id = 15
identity = { vendor_id = 0x7FF, product_code = 0x40_0004, revision = 0x1_0000, serial_number = 4015 }
plant_channels = [1, 2, 0, 3]
full_scale_v = 5.0
resolution_bits = 16

[plant.table.signal]
width_arcsec = 1500.0
latency_us = 400.0

[plant.table.motion]"#;

/// The shipped emulation with a photodiode over a plate of 72 lines, on a table without harmonics that these cannot see.
///
/// # Panics
/// When what is changed is not in the text.
pub fn with_emulated_line_signal(text: String) -> String {
    with_few_lines(&text).edit("[plant.table.motion]", NODE)
}

/// The shipped emulation with a plate of 72 lines, on a table without harmonics that these cannot see.
///
/// # Panics
/// When what is changed is not in the text.
pub fn with_few_lines(text: &str) -> String {
    text.edit("lines = 360", "lines = 72")
        .edit("    { order = 36, amplitude_arcsec = 0.4 },\n", "")
        .edit("    { order = 72, amplitude_arcsec = 0.2 },\n", "")
}
