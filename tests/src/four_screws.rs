//! The alignment platform with a fourth screw: a second one along y, opposite the first.

use truestage::for_tests::Edit;

const AXIS: &str = "[axis.r]
device = \"cia402\"
bus = \"can0\"
node_id = 4
resolution_nm = 10.0
soft_min_mm = -4.5
soft_max_mm = 4.5
speed_mm_per_s = 10.0
speed_max_mm_per_s = 20.0
acceleration_mm_per_s2 = 50.0
quick_stop_deceleration_mm_per_s2 = 500.0
following_error_limit_um = 200.0
following_error_timeout_ms = 20
position_window_um = 0.1
position_window_time_ms = 20
move_timeout_s = 10.0
heartbeat_producer_ms = 50
heartbeat_consumer_ms = 150
watch_master_ms = 500
synchronous_start = true

[axis.r.identity]
device_type = 0x0002_0192
vendor_id = 0x7FF
product_code = 0x42_0001
revision = 0x1_0000
serial_number = 3004

# The job";

const ACTUATOR: &str = "[[platform.actuator]]
axis = \"r\"
point_mm = [0.0, 80.0]
direction = [0.0, 1.0]
lead_mm = 2.0
index_mm = -4.0

[platform.zero]";

const NODE: &str = "[[nodes]]
name = \"drive_r\"
port = \"can0\"
[nodes.device]
kind = \"cia402_drive\"
node_id = 4
axis = 3
encoder_resolution_nm = 10.0
identity = { vendor_id = 0x7FF, product_code = 0x42_0001, revision = 0x1_0000, serial_number = 3004 }
has_index = true
following_error_window_um = 200.0
homing_search_limit_mm = 20.0
max_profile_velocity_mm_per_s = 50.0

[[nodes]]
name = \"image_controller\"";

const PLACE: &str = "[[plant.platform.actuators]]
point_mm = [0.0, 80.0]
direction = [0.0, 1.0]

[plant.platform.screw]";

/// What limits each axis when it follows cyclic set-points.
const CYCLIC: &str = "jerk_mm_per_s3 = 1000.0\ndeviation_limit_um = 200.0\n";

/// The platform's configuration with the fourth screw `r`, and how far its screws may contradict
/// each other.
pub fn with_fourth_screw(text: String, limit_um: Option<f64>) -> String {
    let limit = limit_um.map_or(String::new(), |um| {
        format!("inconsistency_limit_um = {um:.3}\n")
    });
    text.edit("# The job", AXIS)
        .edit("[platform.zero]", ACTUATOR)
        .edit("[platform.zero]", "[platform.zero]\nlone_homing = true")
        .edit("exposures = 4", &format!("{limit}exposures = 4"))
}

/// The platform's emulation with the fourth screw and its drive.
pub fn with_fourth_drive(text: String) -> String {
    text.edit("[[nodes]]\nname = \"image_controller\"", NODE)
        .edit("[plant.platform.screw]", PLACE)
}

/// The configuration of four screws whose axes follow a set-point every two milliseconds.
pub fn four_cyclic_axes(text: String) -> String {
    let text = with_fourth_screw(text, Some(1.0));
    let text = text.edit("sync_period_ms = 10.0", "sync_period_ms = 2.0");
    // These machines are zeroed in real time.
    let text = text.edit("search_speed_mm_per_s = 2.0", "search_speed_mm_per_s = 8.0");
    ["u", "v", "w", "r"].iter().fold(text, |text, axis| {
        let identity = format!("[axis.{axis}.identity]");
        text.edit(
            &identity,
            &format!("[axis.{axis}.cyclic]\n{CYCLIC}\n{identity}"),
        )
    })
}
