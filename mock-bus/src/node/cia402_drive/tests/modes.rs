//! Modes, factor objects, strings, defaults.

use super::{AbortCode, Bench};
use crate::node::cia402_drive::{Cia402DriveConfig, objects};
use wire::canopen::NodeId;

#[test]
fn the_mode_display_lags_behind_the_mode() {
    let mut bench = Bench::new();
    bench.write(0x6060, &[6]);
    assert_eq!(bench.read(0x6061), 1);
    let _ = bench.wait_ms(2);
    assert_eq!(bench.read(0x6061), 1);
    let _ = bench.wait_ms(1);
    assert_eq!(bench.read(0x6061), 6);
}

#[test]
fn modes_that_it_does_not_have_are_refused() {
    let mut bench = Bench::new();
    assert_eq!(
        bench.try_write(0x6060, 0, &[3]),
        Err(AbortCode::InvalidValue)
    );
    assert_eq!(bench.read(0x6502), 0xA1);
}

#[test]
fn a_mode_change_while_moving_stops_the_motion() {
    let mut bench = Bench::new();
    bench.enable();
    bench.set_point(10_000_000, 0);
    let _ = bench.wait_ms(200);
    bench.write(0x6060, &[6]);
    let _ = bench.wait_ms(150);
    let stopped = bench.axis.counts;
    let _ = bench.wait_ms(150);
    assert_eq!(bench.axis.counts, stopped);
}

#[test]
fn the_factor_objects_say_how_long_a_count_is() {
    let mut bench = Bench::new();
    assert_eq!(bench.read(0x60A8), 0xF801_0000, "10 nm: 10^-8 m");
    assert_eq!(bench.read(0x60A9), 0xF801_0300);
    let odd = Cia402DriveConfig {
        encoder_resolution_nm: 4.88,
        ..Cia402DriveConfig::default()
    };
    assert_eq!(Bench::with(odd).read(0x60A8), 0x00B5_0000);
}

#[test]
fn default_pdos_are_those_of_a_real_drive() {
    let config = Cia402DriveConfig::default();
    let node = NodeId::new(1).unwrap();
    let device = objects::description(&config, node);
    let cob_ids = |pdos: &[crate::node::canopen_server::PdoDefault]| -> Vec<u32> {
        pdos.iter().map(|pdo| pdo.cob_id).collect()
    };
    assert_eq!(
        cob_ids(&device.rpdos),
        [0x201, 0x8000_0301, 0x8000_0401, 0x8000_0501]
    );
    assert_eq!(device.tpdos[0].cob_id, 0x4000_0181);
    assert_eq!(device.tpdos[2].mapping[1].raw(), 0x6064_0020);
    assert!(
        device
            .tpdos
            .iter()
            .all(|pdo| pdo.inhibit_100us == 10 && pdo.transmission == 255)
    );
}

#[test]
fn the_demand_follows_the_axis_while_there_is_no_torque() {
    let mut bench = Bench::new();
    bench.axis.counts = 4321;
    let _ = bench.wait_ms(20);
    assert_eq!(bench.read(0x6062), 4321);
    assert_eq!(bench.read(0x60F4), 0);
    bench.enable();
    assert_eq!(bench.axis.counts, 4321, "enabling moves nothing");
}

#[test]
fn parameters_that_make_no_sense_are_refused() {
    let mut bench = Bench::new();
    assert_eq!(
        bench.try_write(0x6081, 0, &[0; 4]),
        Err(AbortCode::ValueTooLow)
    );
    assert_eq!(
        bench.try_write(0x605A, 0, &[9, 0]),
        Err(AbortCode::InvalidValue)
    );
    assert_eq!(
        bench.try_write(0x6064, 0, &[0; 4]),
        Err(AbortCode::ReadOnly)
    );
}
