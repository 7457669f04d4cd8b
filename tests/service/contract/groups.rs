//! A machine of several groups: three axes that follow paths, and a table beside them.

use core::time::Duration;
use std::path::Path;

use service::{
    AxisState, Code, Coordinate, MotionState, MoveRequest, RunKind, RunRequest, RunState, RunView,
    StopMode, WayName,
};
use tests::{Shipped, VOLUMETRIC};
use units::Radians;

use super::together::path;
use super::{Bed, SEED, anna, bert, each_here, to};
use crate::client::PATIENCE;
use crate::stage::Stage;

/// The shipped three axes, and a small table on the same bus.
const THREE_AND_A_TABLE: Shipped = Shipped {
    emulated: concat!(
        include_str!("../../../configs/emulated/volumetric.toml"),
        r#"
[[nodes]]
name = "drive_c"
port = "can0"
[nodes.device]
kind = "cia402_drive"
node_id = 4
axis = 3
identity = { vendor_id = 0x7FF, product_code = 0x42_0002, revision = 0x1_0000, serial_number = 4004 }
has_index = true
[nodes.device.rotary]
counts_per_turn = 129600000
upper_limit_is_a_position = true
following_error_window_arcsec = 600.0
max_profile_velocity_deg_per_s = 360.0
[plant.table.encoder]
counts_per_turn = 129600000
"#
    ),
    ..VOLUMETRIC
};

const TABLE: &str = r#"
[rotary.c]
device = "cia402"
bus = "can0"
node_id = 4
counts_per_turn = 129600000
position_range = "to_last_count"
speed_deg_per_s = 30.0
speed_max_deg_per_s = 180.0
acceleration_deg_per_s2 = 180.0
quick_stop_deceleration_deg_per_s2 = 720.0
following_error_limit_arcsec = 600.0
following_error_timeout_ms = 50
position_window_arcsec = 1.0
position_window_time_ms = 10
move_timeout_s = 600.0
heartbeat_producer_ms = 50
heartbeat_consumer_ms = 150
watch_master_ms = 500
[rotary.c.identity]
device_type = 0x00020192
vendor_id = 0x7FF
product_code = 0x42_0002
[rotary.c.zero]
index_direction = "forward"
index_speed_deg_per_s = 60.0
index_deg = 0.0
"#;

fn with_a_table(body: impl Fn(&Bed<'_>)) {
    let new = |rig, folder: &Path| {
        Stage::new(rig, (THREE_AND_A_TABLE, SEED), folder, |text| text + TABLE)
    };
    each_here(new, |bed| {
        let nobody = bed
            .client
            .plan(&anna(), &RunRequest::of(RunKind::Zero, None));
        let nobody = nobody.unwrap_err().to_string();
        assert!(nobody.contains("c, volume"), "{nobody}");
        for group in ["volume", "c"] {
            bed.client.zero(&anna(), Some(group));
        }
        body(bed);
    });
}

/// At 30° a second.
fn turned(degrees: f64) -> MoveRequest {
    MoveRequest {
        way: Some(WayName::Turns),
        uncompensated: true,
        ..MoveRequest::of("c", Coordinate::Angle(Radians::from_degrees(degrees)))
    }
}

impl Bed<'_> {
    /// Along x, by the encoders alone.
    fn follows(&self, seconds: f64, from_mm: f64, to_mm: f64) -> String {
        let asked = RunRequest {
            uncompensated: true,
            start: true,
            ..path(&format!("0,{from_mm},10,10\n{seconds},{to_mm},10,10\n"))
        };
        let id = self.client.plan(&anna(), &asked);
        id.unwrap_or_else(|problem| panic!("{problem}"))
    }

    /// Waits until the tool is on its way.
    fn on_the_path(&self, id: &str, beyond_mm: f64) -> RunView {
        for _ in 0..5000 {
            let run = self.client.run(id, Duration::ZERO).expect("it was planned");
            if run.state != RunState::Running || self.encoder_mm("x") > beyond_mm {
                return run;
            }
            self.let_time_pass(0.05);
        }
        panic!("it does not move");
    }
}

#[test]
fn a_table_turns_while_three_axes_follow_a_path_and_each_ends_by_itself() {
    with_a_table(|bed| {
        // It turns before the path begins, and after its end.
        let turning = bed.begin(&turned(3600.0));
        let id = bed.follows(2.0, 10.0, 14.0);
        bed.on_the_path(&id, 10.1);
        let states = ["c", "x"].map(|it| bed.client.axis(it).unwrap().state);
        let expected = [AxisState::DiscreteMotion, AxisState::SynchronizedMotion];
        assert_eq!(states, expected);
        let run = bed.client.run(&id, PATIENCE).unwrap();
        assert_eq!((run.state, run.of.as_str()), (RunState::Done, "volume"));
        assert_eq!(bed.now(&turning).state, MotionState::Moving);
        assert!((bed.encoder_mm("x") - 14.0).abs() < 0.01);
        assert_eq!(bed.ended(&turning).state, MotionState::Done);
        assert!((bed.encoder_mm("c") - 3600.0).abs() < 0.01);

        // It turns while the path goes on, and what needs the path's axes or the machine's thread is refused.
        let id = bed.follows(60.0, 14.0, 44.0);
        bed.on_the_path(&id, 14.1);
        let turning = bed.begin(&turned(3630.0));
        bed.refused(&to("x", 10.0), Code::AxisBusy);
        let zero = bed
            .client
            .plan(&anna(), &RunRequest::of(RunKind::Zero, Some("c")));
        assert_eq!(zero.unwrap_err().code, Code::AxisBusy);
        assert_eq!(bed.ended(&turning).state, MotionState::Done);
        let run = bed.client.run(&id, Duration::ZERO).unwrap();
        assert_eq!(run.state, RunState::Running, "{run:?}");

        // The end of one is not the end of the other.
        let turning = bed.begin(&turned(3960.0));
        bed.client.abort(&bert(), &id).unwrap();
        let run = bed.client.run(&id, PATIENCE).unwrap();
        assert_eq!(run.state, RunState::Stopped, "{run:?}");
        assert_eq!(bed.client.axis("x").unwrap().state, AxisState::Standstill);
        assert_eq!(bed.now(&turning).state, MotionState::Moving);
        assert_eq!(bed.ended(&turning).state, MotionState::Done);
    });
}

#[test]
fn a_stop_ends_the_path_of_one_group_and_the_motion_of_another() {
    with_a_table(|bed| {
        let of_the_table = RunRequest {
            axis: Some("c".to_owned()),
            ..path("0,10,10,10\n2,14,10,10\n")
        };
        let refused = bed.client.plan(&anna(), &of_the_table).unwrap_err();
        assert_eq!(refused.code, Code::NotOffered, "{refused}");
        let id = bed.follows(60.0, 10.0, 44.0);
        bed.on_the_path(&id, 10.1);
        let turning = bed.begin(&turned(3600.0));
        bed.let_time_pass(0.5);
        bed.client.stop(&bert(), StopMode::Controlled).unwrap();
        let run = bed.client.run(&id, PATIENCE).unwrap();
        assert_eq!(run.state, RunState::Stopped, "{run:?}");
        let motion = bed.ended(&turning);
        assert_eq!(motion.state, MotionState::Stopped, "{motion:?}");
        let by = [run.stopped, motion.stopped].map(|it| it.expect("somebody did").by);
        assert_eq!(by, ["bert", "bert"]);
        for axis in ["x", "y", "z", "c"] {
            let axis = bed.client.axis(axis).unwrap();
            assert_eq!((axis.state, axis.homed), (AxisState::Standstill, true));
        }
        // Both go on without a reset.
        let turning = bed.begin(&turned(0.0));
        let x_mm = bed.encoder_mm("x");
        let id = bed.follows(1.0, x_mm, x_mm + 1.0);
        let run = bed.client.run(&id, PATIENCE).unwrap();
        assert_eq!(run.state, RunState::Done, "{run:?}");
        assert_eq!(bed.ended(&turning).state, MotionState::Done);
    });
}
