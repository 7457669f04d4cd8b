//! Cyclic synchronous position.

use std::time::Duration;

use super::Bench;
use crate::plant::Servo;

/// RPDO 1 with controlword and target, taken over at SYNC.
const MAPPING: [(u16, u8, &[u8]); 6] = [
    (0x1400, 1, &[0x01, 0x02, 0x00, 0x80]),
    (0x1600, 0, &[0]),
    (0x1600, 1, &[0x10, 0x00, 0x40, 0x60]),
    (0x1600, 2, &[0x20, 0x00, 0x7A, 0x60]),
    (0x1600, 0, &[2]),
    (0x1400, 2, &[1]),
];
const ENABLE: u16 = 0x0F;

impl Bench {
    /// Mode 8 at `period_ms`, RPDO 1 mapped, operation enabled; no SYNC so far.
    fn cyclic(period_ms: u8) -> Self {
        let mut bench = Self::new();
        for (index, sub, data) in MAPPING {
            bench.try_write(index, sub, data).unwrap();
        }
        bench
            .try_write(0x1400, 1, &[0x01, 0x02, 0x00, 0x00])
            .unwrap();
        bench.try_write(0x60C2, 1, &[period_ms]).unwrap();
        bench.write(0x6060, &[8]);
        let _ = bench.wait_ms(5);
        for controlword in [0x06, 0x07, ENABLE] {
            bench.control(controlword);
            let _ = bench.wait_ms(5);
        }
        assert!(matches!(bench.axis.servo, Servo::Follow { .. }));
        bench
    }

    fn command(&mut self, controlword: u16, target: i32) -> Vec<String> {
        let mut data = controlword.to_le_bytes().to_vec();
        data.extend(target.to_le_bytes());
        self.send(0x201, &data)
    }

    fn sync(&mut self) -> Vec<String> {
        self.send(0x80, &[])
    }

    /// One period: the set-point, SYNC, and what comes until the next one.
    fn cycle(&mut self, target: i32, period_ms: u64) -> Vec<String> {
        let mut sent = self.command(ENABLE, target);
        sent.extend(self.sync());
        sent.extend(self.wait_ms(period_ms));
        sent
    }
}

/// 1 mm/s at a SYNC of 1 ms: 100 counts per SYNC.
#[test]
fn set_points_are_taken_at_every_sync() {
    let mut bench = Bench::cyclic(1);
    for step in 1..=50 {
        let _ = bench.cycle(step * 100, 1);
    }
    assert_eq!(bench.position(), 5000);
    assert_eq!(bench.status() & 0x1000, 0x1000, "drive follows");
}

#[test]
fn between_two_set_points_the_drive_goes_straight() {
    let mut bench = Bench::cyclic(4);
    let _ = bench.cycle(0, 4);
    let _ = bench.command(ENABLE, 400);
    let _ = bench.sync();
    let mut seen = Vec::new();
    for _ in 0..4 {
        let _ = bench.wait_ms(1);
        seen.push(bench.position());
    }
    assert_eq!(seen, [100, 200, 300, 400]);
}

#[test]
fn a_set_point_without_a_sync_changes_nothing() {
    let mut bench = Bench::cyclic(2);
    let _ = bench.cycle(0, 2);
    let _ = bench.command(ENABLE, 200);
    let _ = bench.wait_ms(1);
    assert_eq!(bench.position(), 0);
    let _ = bench.sync();
    let _ = bench.wait_ms(2);
    assert_eq!(bench.position(), 200);
}

#[test]
fn a_missing_set_point_leaves_the_drive_at_the_last_one() {
    let mut bench = Bench::cyclic(1);
    let _ = bench.cycle(100, 1);
    for _ in 0..20 {
        let _ = bench.sync();
        let _ = bench.wait_ms(1);
    }
    assert_eq!(bench.position(), 100);
    assert_eq!(bench.status() & 0x106F, 0x1027);
}

#[test]
fn the_drive_follows_only_once_a_sync_has_come() {
    let mut bench = Bench::cyclic(1);
    assert_eq!(bench.status() & 0x1000, 0);
    let _ = bench.wait_ms(500);
    assert_eq!(bench.status() & 0x6F, 0x27, "nothing is missed before");
    let _ = bench.cycle(0, 1);
    assert_eq!(bench.status() & 0x1000, 0x1000);
}

#[test]
fn sync_that_stays_away_is_a_fault() {
    let mut bench = Bench::cyclic(2);
    let _ = bench.cycle(0, 2);
    let before = bench.wait_ms(2);
    assert!(before.iter().all(|frame| !frame.starts_with("081")));
    let sent = bench.wait_ms(2);
    assert!(
        sent.iter().any(|frame| frame.starts_with("081#008711")),
        "{sent:?}"
    );
    let _ = bench.wait_ms(20);
    bench.check_status(0x0218);
    assert_eq!(bench.axis.servo, Servo::Off);
}

#[test]
fn one_lost_sync_is_ridden_out() {
    let mut bench = Bench::cyclic(2);
    for step in 1..=10 {
        let sent = bench.cycle(step * 100, if step == 5 { 4 } else { 2 });
        assert!(sent.iter().all(|frame| !frame.starts_with("081")));
    }
    assert_eq!(bench.position(), 1000);
}

/// 500 mm/s are 100 000 counts in 2 ms, the window is 50 000 counts.
#[test]
fn a_jump_beyond_the_speed_limit_is_a_following_error() {
    let mut bench = Bench::cyclic(2);
    let _ = bench.cycle(0, 2);
    let _ = bench.cycle(1_000_000, 2);
    assert!(bench.position() <= 100_001, "{}", bench.position());
    let mut sent = Vec::new();
    for _ in 0..8 {
        sent.extend(bench.cycle(3_000_000, 2));
    }
    assert!(
        sent.iter().any(|frame| frame.starts_with("081#118621")),
        "{sent:?}"
    );
    bench.wait_until("fault", |bench| bench.status() & 0x4F == 0x08);
}

#[test]
fn the_speed_limit_itself_is_no_jump() {
    let mut bench = Bench::cyclic(2);
    let _ = bench.cycle(0, 2);
    for step in 1..=50 {
        let _ = bench.cycle(step * 100_000, 2);
        assert_eq!(bench.status() & 0x286F, 0x0027);
    }
    assert_eq!(bench.position(), 5_000_000);
}

#[test]
fn without_an_interpolation_time_every_set_point_is_a_step() {
    let mut bench = Bench::cyclic(0);
    let _ = bench.command(ENABLE, 400);
    let _ = bench.sync();
    // The servo is told at the next beat of its own clock, not at SYNC.
    let _ = bench.wait_ms(1);
    assert_eq!(bench.axis.counts, 400);
    let _ = bench.wait_ms(200);
    assert_eq!(bench.status() & 0x6F, 0x27, "and SYNC is not watched");
}

#[test]
fn soft_limits_clip_a_set_point() {
    let mut bench = Bench::cyclic(1);
    bench.write(0x6060, &[6]);
    let _ = bench.wait_ms(5);
    bench.write(0x6098, &[37]);
    bench.control(0x1F);
    bench.wait_until("homed", |bench| bench.status() & 0x1400 == 0x1400);
    bench.control(0x0F);
    bench
        .try_write(0x607D, 1, &(-100_i32).to_le_bytes())
        .unwrap();
    bench.try_write(0x607D, 2, &100_i32.to_le_bytes()).unwrap();
    bench.write(0x6060, &[8]);
    let _ = bench.wait_ms(5);
    for step in 0..20 {
        let _ = bench.cycle(step * 10, 1);
    }
    assert_eq!(bench.position(), 100);
    assert_eq!(bench.status() & 0x0800, 0x0800, "internal limit");
}

#[test]
fn halt_slows_down_and_its_end_follows_again() {
    let mut bench = Bench::cyclic(1);
    for step in 0..20 {
        let _ = bench.cycle(step * 100, 1);
    }
    for step in 20..60 {
        let _ = bench.command(0x010F, step * 100);
        let _ = bench.sync();
        let _ = bench.wait_ms(1);
    }
    let stopped = bench.position();
    assert!((1900..2200).contains(&stopped), "{stopped}");
    assert_eq!(bench.status() & 0x1000, 0, "does not follow");
    let _ = bench.cycle(stopped + 50, 1);
    assert_eq!(bench.position(), stopped + 50);
}

#[test]
fn a_limit_switch_stops_the_following_outwards_only() {
    let mut bench = Bench::cyclic(1);
    bench.axis.switches.1 = 1000;
    for step in 1..=30 {
        let _ = bench.cycle(step * 100, 1);
    }
    let stopped = bench.position();
    assert!((1000..1200).contains(&stopped), "{stopped}");
    assert_eq!(bench.status() & 0x086F, 0x0827, "held at the switch");
    let _ = bench.cycle(stopped - 50, 1);
    assert_eq!(bench.position(), stopped - 50);
}

#[test]
fn a_blocked_axis_shows_its_following_error_and_faults() {
    let mut bench = Bench::cyclic(1);
    let _ = bench.cycle(0, 1);
    bench.axis.blocked = true;
    let mut shown = false;
    for step in 1..=200 {
        let _ = bench.cycle(step * 500, 1);
        shown |= bench.status() & 0x206F == 0x2027;
    }
    assert!(shown, "bit 13 before the fault");
    bench.check_status(0x0218);
}

#[test]
fn a_quick_stop_while_following_is_on_the_quick_stop_ramp() {
    let mut bench = Bench::cyclic(1);
    for step in 0..20 {
        let _ = bench.cycle(step * 100, 1);
    }
    let _ = bench.command(0x000B, 2000);
    let _ = bench.sync();
    let took = bench.wait_until("stopped", |bench| bench.status() & 0x0400 != 0);
    assert!(took < Duration::from_millis(50), "{took:?}");
    assert_eq!(bench.status() & 0x6F, 0x07);
}
