//! What the thermometers of rotary tables and platforms show while these are measured.

use machine::records::{ThermometersEntry, read_journal};
use tests::{Bench, Edit, UVW, with_few_lines};
use truestage::platform::PlatformLog;
use truestage::rotary::PlateLog;

use super::rotary::{hand_of, started};

/// A module with a thermometer of the air and one of the machine.
const EMULATED: &str = r#"[[nodes]]
name = "heat"
port = "can0"
[nodes.device]
kind = "cia404_analog"
node_id = 16
identity = { vendor_id = 0x7FF, product_code = 0x40_0004, revision = 0x1_0000, serial_number = 4016 }
plant_channels = [0, 6, 7]

"#;
const MODULE: &str = r#"
[analog.heat]
device = "cia404"
bus = "can0"
node_id = 16
temperature_channels = [1, 2]
every_syncs = 20
heartbeat_producer_ms = 50
heartbeat_consumer_ms = 150
watch_master_ms = 500

[analog.heat.identity]
device_type = 0x0002_0194
vendor_id = 0x7FF
product_code = 0x40_0004
"#;
/// A hundredth is what the module resolves, and the room does not become warmer faster than that in a run.
const OFF_MAX_K: f64 = 0.05;

#[track_caller]
fn check(bench: &Bench, entries: &[ThermometersEntry]) {
    let air = bench.emulated.simulation().truth().environment();
    let truth = [air.air_temperature, air.stage_temperature];
    for entry in entries {
        assert_eq!(entry.names, ["heat 1", "heat 2"]);
        for (shown, truth) in entry.temperatures_c.iter().zip(truth) {
            let shown = shown.expect("it is wired");
            let off = (shown - truth.value()).abs();
            assert!(off < OFF_MAX_K, "{entry:?} and {truth:?}");
        }
    }
}

fn verified_table(machine: impl Fn(String) -> String, is_wired: bool) -> (Bench, PlateLog) {
    let mut bench = Bench::rotary(
        31,
        |text| {
            let few = text.edit("lines = 360", "lines = 72");
            machine(few.edit("offset_lines = 200.5", "offset_lines = 40.5"))
        },
        |text| {
            let few = with_few_lines(&text);
            match is_wired {
                true => few.edit(
                    "[plant.table.motion]",
                    &(EMULATED.to_owned() + "[plant.table.motion]"),
                ),
                false => few,
            }
        },
    );
    started(&mut bench);
    let mut hand = hand_of(&bench.emulated);
    let store = bench.store.clone();
    let mut table = bench.machine.rotary("c").expect("it is one");
    let verified = table.verify(&store, false, &mut hand);
    let journal = verified
        .unwrap_or_else(|failure| panic!("{failure}"))
        .journal;
    let log = read_journal::<PlateLog>(&journal)
        .expect("it was written")
        .log;
    (bench, log)
}

#[test]
fn what_thermometers_of_a_rotary_table_show_is_written_down_and_nothing_where_there_are_none() {
    let (bench, log) = verified_table(|text| text + MODULE, true);
    assert_eq!(log.thermometers.len(), 2, "before and behind the placement");
    check(&bench, &log.thermometers);
    let (_, log) = verified_table(|text| text, false);
    assert_eq!(log.thermometers, []);
}

#[test]
fn what_thermometers_of_a_platform_show_is_written_down_from_beginning_to_end() {
    let mut bench = Bench::shaped(
        &UVW,
        32,
        |text| text.edit("poses = 20", "poses = 3") + MODULE,
        |text| {
            text.edit(
                "[plant.platform.screw]",
                &(EMULATED.to_owned() + "[plant.platform.screw]"),
            )
        },
    );
    let store = bench.store.clone();
    bench.machine.start().expect("it starts");
    let mut platform = bench.machine.platform().expect("it is one");
    platform.zero(&store).expect("it finds its zero");
    let verified = platform.verify(&store, false).expect("it is looked at");
    let log = read_journal::<PlatformLog>(&verified.journal)
        .expect("it was written")
        .log;
    let [first, last] = log.thermometers.as_slice() else {
        panic!("{:?}", log.thermometers)
    };
    assert!(first.at_s < log.poses[0].at_s && last.at_s >= log.poses[2].at_s);
    check(&bench, &log.thermometers);
}
