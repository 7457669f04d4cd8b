//! A rotary axis: positions that wrap, homing on the index pulse, the touch probe.

use wire::canopen::sdo::AbortCode;

use super::Bench;
use crate::node::cia402_drive::{Cia402DriveConfig, RotaryDriveConfig, TouchProbeConfig};
use crate::plant::ProbeEdge;
use units::Time;

const TURN: i64 = 360_000;

fn bench_with(touch_probe: TouchProbeConfig, upper_limit_is_a_position: bool) -> Bench {
    let rotary = RotaryDriveConfig {
        counts_per_turn: TURN as u32,
        upper_limit_is_a_position,
        // The ideal axis follows a whole servo period late.
        following_error_window_arcsec: 3600.0,
        profile_velocity_deg_per_s: 300.0,
        profile_acceleration_deg_per_s2: 1000.0,
        ..RotaryDriveConfig::default()
    };
    Bench::with(Cia402DriveConfig {
        rotary: Some(rotary),
        touch_probe: Some(touch_probe),
        has_index: true,
        ..Cia402DriveConfig::default()
    })
}

fn bench() -> Bench {
    bench_with(TouchProbeConfig::default(), true)
}

impl Bench {
    fn write_sub(&mut self, index: u16, sub: u8, value: i32) {
        self.try_write(index, sub, &value.to_le_bytes()).unwrap();
    }

    fn wraps(&mut self, direction: u16) {
        self.write_sub(0x607B, 1, 0);
        self.write_sub(0x607B, 2, TURN as i32 - 1);
        self.write(0x60F2, &(direction << 6).to_le_bytes());
    }

    #[track_caller]
    fn goes_to(&mut self, target: i32) {
        self.write_i32(0x607A, target);
        self.control(0x0F);
        self.control(0x3F);
        self.control(0x0F);
        let _ = self.wait_until("target reached", |bench| {
            let _ = bench.wait_ms(50);
            bench.status() & 0x0400 != 0
        });
    }

    fn edge(&mut self, rising: bool, count: i64) {
        let at = Time::ZERO;
        self.axis.edges.push_back(ProbeEdge { at, rising, count });
    }
}

#[test]
fn a_position_wraps_at_the_end_of_its_range() {
    for (upper_limit_is_a_position, last) in [(true, TURN - 1), (false, TURN)] {
        let mut bench = bench_with(TouchProbeConfig::default(), upper_limit_is_a_position);
        bench.axis.counts = TURN + 5;
        assert_eq!(i64::from(bench.position()), TURN + 5);
        bench.write_sub(0x607B, 2, last as i32);
        assert_eq!(bench.position(), 5);
        bench.axis.counts = -1;
        assert_eq!(i64::from(bench.position()), TURN - 1);
    }
}

#[test]
fn the_way_to_a_target_beyond_the_seam_is_what_0x60f2_says() {
    // From 350° to 10°: as on a linear axis, backwards, forwards, the shorter way.
    for (direction, expected) in [
        (0, 10_000),
        (1, 10_000),
        (2, TURN + 10_000),
        (3, TURN + 10_000),
    ] {
        let mut bench = bench();
        bench.enable();
        bench.wraps(0);
        bench.goes_to(350_000);
        bench.wraps(direction);
        bench.goes_to(10_000);
        assert_eq!(bench.axis.counts, expected, "{direction}");
        assert_eq!(bench.position(), 10_000);
    }
}

#[test]
fn homing_on_the_index_makes_the_marks_place_the_home() {
    for (method, from) in [(34_i8, 30_000), (33, 70_000)] {
        let mut bench = bench();
        bench.axis.counts = from;
        bench.enable();
        bench.write_i32(0x607C, 1_000);
        bench.write(0x6098, &method.to_le_bytes());
        bench.write_sub(0x6099, 2, 20_000);
        bench.write(0x6060, &[6]);
        let _ = bench.wait_ms(20);
        bench.control(0x1F);
        let _ = bench.wait_until("homed", |bench| bench.status() & 0x3400 == 0x1400);
        // One of the ideal axis's marks.
        let moved = bench.axis.counts - 50_000;
        assert_eq!(i64::from(bench.position()), 1_000 + moved, "{method}");
        // It stops beyond the mark.
        assert_ne!(moved, 0);
        assert!(moved.abs() < 5_000);
    }
}

#[test]
fn an_unarmed_probe_latches_nothing() {
    let mut bench = bench();
    bench.edge(true, 100);
    assert_eq!(bench.read(0x60B9), 0);
    bench.write(0x60B8, &0x13_u16.to_le_bytes());
    assert_eq!(bench.read(0x60B9), 1);
    assert_eq!(bench.read(0x60D5), 0);
}

#[test]
fn a_continuous_probe_keeps_the_last_edge_and_counts_them_all() {
    let mut bench = bench();
    bench.wraps(3);
    bench.write(0x60B8, &0x13_u16.to_le_bytes());
    for count in [100, 200, TURN + 300] {
        bench.edge(true, count);
        bench.edge(false, count + 10);
    }
    assert_eq!(bench.read(0x60B9), 0b011);
    assert_eq!(bench.read(0x60BA), 300);
    assert_eq!(bench.read(0x60D5), 3);
    // The negative edge was not asked for.
    assert_eq!((bench.read(0x60BB), bench.read(0x60D6)), (0, 0));
}

#[test]
fn a_single_probe_keeps_the_first_edge_until_it_is_armed_again() {
    let mut bench = bench();
    bench.write(0x60B8, &0x11_u16.to_le_bytes());
    bench.edge(true, 100);
    bench.edge(true, 200);
    assert_eq!(bench.read(0x60BA), 100);
    bench.write(0x60B8, &0_u16.to_le_bytes());
    assert_eq!(bench.read(0x60B9), 0);
    bench.write(0x60B8, &0x11_u16.to_le_bytes());
    bench.edge(true, 300);
    assert_eq!((bench.read(0x60B9), bench.read(0x60BA)), (0b011, 300));
}

#[test]
fn the_negative_edge_has_its_own_objects() {
    let mut bench = bench();
    bench.write(0x60B8, &0x23_u16.to_le_bytes());
    bench.edge(true, 100);
    bench.edge(false, 110);
    assert_eq!(bench.read(0x60B9), 0b101);
    assert_eq!((bench.read(0x60BB), bench.read(0x60D6)), (110, 1));
}

#[test]
fn a_drive_without_counters_may_toggle_its_status() {
    let probe = TouchProbeConfig {
        edge_counters: false,
        status_toggles: true,
    };
    let mut bench = bench_with(probe, true);
    bench.write(0x60B8, &0x13_u16.to_le_bytes());
    bench.edge(true, 100);
    assert_eq!(bench.read(0x60B9), 0b0100_0011);
    bench.edge(true, 100);
    assert_eq!(bench.read(0x60B9), 0b0000_0011);
    assert_eq!(
        bench.try_write(0x60D5, 0, &[0, 0]),
        Err(AbortCode::NoSuchObject)
    );
}

#[test]
fn an_input_that_nothing_is_wired_to_sees_no_edge() {
    let mut bench = bench();
    bench.try_write(0x60D0, 1, &2_i16.to_le_bytes()).unwrap();
    bench.write(0x60B8, &0x1B_u16.to_le_bytes());
    bench.edge(true, 100);
    assert_eq!(bench.read(0x60D5), 0);
    bench.try_write(0x60D0, 1, &1_i16.to_le_bytes()).unwrap();
    bench.edge(true, 100);
    assert_eq!(bench.read(0x60D5), 1);
}
