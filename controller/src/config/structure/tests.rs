use crate::Edit;
use crate::config::diagnostic::Diagnostic;
use crate::config::{ConfigError, parse};

const LINEAR: &str = include_str!("../../../../configs/machines/linear.toml");
const UVW: &str = include_str!("../../../../configs/machines/uvw.toml");
const VOLUMETRIC: &str = include_str!("../../../../configs/machines/volumetric.toml");

fn findings(text: &str) -> Vec<Diagnostic> {
    match parse(text, "m.toml") {
        Err(ConfigError::Invalid { findings }) => findings,
        other => panic!("{other:?}"),
    }
}

/// With the first `from` become `to`, one thing is found: at `key`, and what it says.
#[track_caller]
fn check(text: &str, from: &str, to: &str, key: &str, says: [&str; 2]) {
    let found = findings(&text.edit_first(from, to));
    let [one] = &found[..] else {
        panic!("{to}: {found:#?}")
    };
    assert_eq!(one.key, key);
    let [cause, help] = says;
    assert!(one.cause.contains(cause), "{one}");
    assert!(one.help.contains(help), "{one}");
}

#[test]
fn all_that_is_wrong_with_keys_types_and_values_is_told_at_once() {
    let text = LINEAR
        .edit_first("sync_period_ms = 5.0", "sync_period_ms = 0.1")
        .edit_first("speed_mm_per_s", "spede_mm_per_s")
        .edit_first("runs = 3", "runs = \"3\"");
    let found = findings(&text);
    let keys: Vec<_> = found.iter().map(|it| it.key.as_str()).collect();
    let expected = [
        "can.can0.sync_period_ms",
        "axis.x.spede_mm_per_s",
        "axis.x.calibrate.runs",
    ];
    assert_eq!(keys, expected, "{found:#?}");
}

#[test]
fn a_value_of_another_type_says_how_it_is_written() {
    let key = "axis.x.resolution_nm";
    let says = ["expected a number here, this is text", "without quotes: 10"];
    check(
        LINEAR,
        "resolution_nm = 10.0",
        "resolution_nm = \"10\"",
        key,
        says,
    );
    let says = ["expected text here, this is a whole number", "\"7\""];
    let (from, key) = ("name = \"linear\"", "machine.name");
    check(LINEAR, from, "name = 7", key, says);
    let says = ["expected a list here", "[...]"];
    let (from, key) = ("channels = [0, 1]", "analog.hall.channels");
    check(LINEAR, from, "channels = 0", key, says);
    let says = [
        "expected a whole number here, this is a number",
        "give a whole number",
    ];
    check(
        LINEAR,
        "node_id = 1\n",
        "node_id = 1.6\n",
        "axis.x.node_id",
        says,
    );
}

#[test]
fn a_word_that_is_not_known_says_which_are() {
    let says = ["`usb` is not known here", "\"socketcan\" or \"slcan\""];
    let from = "transport = \"slcan\"";
    check(
        LINEAR,
        from,
        "transport = \"usb\"",
        "can.can0.transport",
        says,
    );
    let says = ["`servo` is not known here", "\"cia402\" or \"copley\""];
    let from = "device = \"cia402\"";
    check(LINEAR, from, "device = \"servo\"", "axis.x.device", says);
}

#[test]
fn a_mistyped_key_is_told_once_with_the_one_that_was_meant() {
    for (from, to) in [
        ("soft_min_mm", "soft_min_um"),
        ("position_window_um", "postion_window_um"),
        ("move_timeout_s", "move_time_out_s"),
        ("following_error_limit_um", "folowing_eror_limit_um"),
    ] {
        let key = format!("axis.x.{to}");
        let help = format!("did you mean `{from}`?");
        check(LINEAR, from, to, &key, ["no such key here", &help]);
    }
    let says = ["no such key here", "known here, and not given yet: "];
    check(
        LINEAR,
        "[can.can0]",
        "[can.can0]\nqwertz = 1",
        "can.can0.qwertz",
        says,
    );
}

#[test]
fn a_list_of_another_length_and_a_section_of_a_list_are_found_where_they_stand() {
    let says = ["3 entries", "give 2"];
    let (from, key) = ("point_mm = [", "platform.actuator.0.point_mm");
    check(UVW, from, "point_mm = [0.0, ", key, says);
    let found = findings(&UVW.edit_first("lead_mm = ", "leed_mm = "));
    let line = UVW
        .lines()
        .position(|it| it.starts_with("lead_mm"))
        .map(|it| it + 1);
    assert_eq!(
        (Some(found[0].line), found[0].column),
        (line, 1),
        "{found:#?}"
    );
}

#[test]
fn an_axis_beside_a_platform_is_not_called_like_a_part_of_its_pose() {
    let text = UVW
        .edit("[axis.w", "[axis.y")
        .edit("axis = \"w\"", "axis = \"y\"");
    let found = findings(&text);
    let [one] = &found[..] else {
        panic!("{found:#?}")
    };
    assert_eq!(one.key, "axis.y");
    assert!(one.cause.contains("part of the platform's pose"), "{one}");
    assert!(one.help.contains("x, y, theta"), "{one}");
}

#[test]
fn a_section_that_is_missing_is_named() {
    let begin = UVW.find("[platform.zero]").expect("it is there");
    let end = begin + UVW[begin + 1..].find("\n[").expect("another follows") + 1;
    let text = format!("{}{}", &UVW[..begin], &UVW[end..]);
    let found = findings(&text);
    assert!(
        found[0].cause.contains("the section `platform.zero`"),
        "{found:#?}"
    );
}

#[test]
fn each_number_of_a_list_is_judged() {
    let from = "mm_per_v = [0.1, 0.1]";
    let key = "volumetric.roll.mm_per_v";
    let says = ["0 is impossible", "0.000000001 to 1000"];
    check(VOLUMETRIC, from, "mm_per_v = [0.1, 0.0]", key, says);
    let from = "expansion_ppm_per_k = [5.0,";
    let key = "volumetric.temperature.0.expansion_ppm_per_k";
    for (to, says) in [
        ("1500.0", ["1500 is impossible", "0 to 1000"]),
        ("-1500.0", ["-1500 is impossible", "0 to 1000"]),
        ("nan", ["NaN is impossible", "give -1000 to 1000"]),
    ] {
        let to = format!("expansion_ppm_per_k = [{to},");
        check(VOLUMETRIC, from, &to, key, says);
    }
    let to = "gain = [1.0, 1.0, 0.0, 1.0]\nlayout = ";
    let says = ["0 is impossible", "more than 0"];
    let key = "volumetric.beam.x.slider.gain";
    check(VOLUMETRIC, "layout = ", to, key, says);
}

#[test]
fn a_mistyped_part_of_a_sections_name_is_told_with_the_one_that_others_have_right() {
    for (from, to, key, help) in [
        (
            "[axis.x.verify]",
            "[axsi.x.verify]",
            "axsi",
            "did you mean `axis`?",
        ),
        (
            "[instrument.laser]",
            "[instrumnet.laser]",
            "instrumnet",
            "did you mean `instrument`?",
        ),
    ] {
        let found = findings(&LINEAR.edit_first(from, to));
        let told = found.iter().find(|it| it.key == key);
        let told = told.unwrap_or_else(|| panic!("{found:#?}"));
        assert!(told.help.contains(help), "{told}");
    }
}

#[test]
fn a_number_that_is_too_large_for_its_key_says_what_fits() {
    let from = "bitrate_bit_per_s = 1000000";
    let key = "can.can0.bitrate_bit_per_s";
    let says = ["1000000000000 is impossible", "give 0 to 4294967295"];
    check(LINEAR, from, "bitrate_bit_per_s = 1000000000000", key, says);
}

#[test]
fn a_number_in_quotes_is_told_as_it_was_meant_or_not_at_all() {
    let from = "vendor_id = 0x000007FF";
    let key = "axis.x.identity.vendor_id";
    let says = ["expected a whole number", "without quotes: 0x000007FF"];
    check(LINEAR, from, "vendor_id = \"0x000007FF\"", key, says);
    let (from, key) = ("speed_mm_per_s = 200.0", "axis.x.speed_mm_per_s");
    let says = ["expected a number", "give a number"];
    check(LINEAR, from, "speed_mm_per_s = \"12,5\"", key, says);
    let says = ["expected a number", "without quotes and unit: 200"];
    check(LINEAR, from, "speed_mm_per_s = \"200 mm/s\"", key, says);
}

#[test]
fn a_word_that_was_mistyped_is_told_with_the_one_that_was_meant() {
    for seen in ["sclan", "SLCAN", "slcan "] {
        let to = format!("transport = \"{seen}\"");
        let says = ["is not known here", "did you mean \"slcan\"?"];
        let from = "transport = \"slcan\"";
        check(LINEAR, from, &to, "can.can0.transport", says);
    }
    let says = ["there is no CAN bus `cna0`", "did you mean `can0`?"];
    check(
        LINEAR,
        "bus = \"can0\"",
        "bus = \"cna0\"",
        "axis.x.bus",
        says,
    );
}

#[test]
fn a_key_that_stands_in_another_section_says_where_it_belongs() {
    let from = "vendor_id = 0x000007FF";
    let to = "vendor_id = 0x000007FF\nsynchronous_start = true";
    let says = ["no such key here", "a key of [axis.x]: write it there"];
    check(LINEAR, from, to, "axis.x.identity.synchronous_start", says);
    let says = [
        "no such key here",
        "`plate` is a key of [rotary.NAME.calibrate]",
    ];
    let (from, to) = ("[serial.laser]", "[serial.laser]\nplate = \"x\"");
    check(LINEAR, from, to, "serial.laser.plate", says);
}

#[test]
fn a_section_of_one_axis_without_its_name_is_told_with_it() {
    let says = ["says not of which", "write [axis.x.verify]"];
    check(
        LINEAR,
        "[axis.x.verify]",
        "[axis.verify]",
        "axis.verify",
        says,
    );
}

#[test]
fn a_part_of_a_section_whose_name_was_mistyped_is_told_alone() {
    let says = ["no such key here", "did you mean `axis`?"];
    check(LINEAR, "[axis.x]", "[axes.x]", "axes", says);
}

#[test]
fn what_stands_between_keys_is_judged_beside_what_is_wrong_with_one() {
    let text = LINEAR
        .edit_first("speed_mm_per_s = 200.0", "speed_mm_per_s = \"200 mm/s\"")
        .edit_first("soft_min_mm", "soft_mim_mm")
        .edit_first("node_id = 2", "node_id = 1");
    let found = findings(&text);
    let keys: Vec<_> = found.iter().map(|it| it.key.as_str()).collect();
    let expected = [
        "axis.x.soft_mim_mm",
        "axis.x.speed_mm_per_s",
        "analog.hall.node_id",
    ];
    assert_eq!(keys, expected, "{found:#?}");
}

#[test]
fn sections_are_found_again_whose_names_were_lost_or_mistyped() {
    for (from, to, key, help) in [
        // Of another axis, of none, of one with a point in its name, and commented out.
        (
            "[axis.x.identity]",
            "[axis.x1.identity]",
            "axis.x1",
            "did you mean [axis.x]?",
        ),
        ("[axis.x]", "[axis]", "axis", "write [axis.x]"),
        (
            "[axis.x.identity]",
            "[\"axis.x.identity\"]",
            "axis.x.identity",
            "write `[axis.x.identity]`",
        ),
        (
            "[axis.x.identity]",
            "#[axis.x.identity]",
            "axis.x.device_type",
            "write the line [axis.x.identity] above",
        ),
        (
            "stage_serial",
            "stage.serial",
            "machine.stage",
            "write `stage_serial`",
        ),
    ] {
        check(LINEAR, from, to, key, ["", help]);
    }
}

#[test]
fn what_stands_in_the_file_is_what_is_proposed() {
    let proof = "[axis.x]\nkept_zero = { by = \"mark\", object = 0x2F00 }\n";
    let says = ["this is a whole number", "write it in quotes: \"0x2F00\""];
    check(LINEAR, "[axis.x]\n", proof, "axis.x.kept_zero.object", says);
    let says = ["this is a list", "without brackets: 0x000007FF"];
    let to = "vendor_id = [0x000007FF]";
    check(
        LINEAR,
        "vendor_id = 0x000007FF",
        to,
        "axis.x.identity.vendor_id",
        says,
    );
}

#[test]
fn a_list_in_a_list_is_told_with_one_pair_of_brackets() {
    let says = ["a list in a list", "brackets: [0, 1]"];
    for to in ["channels = [[0], [1]]", "channels = [[0, 1]]"] {
        check(
            LINEAR,
            "channels = [0, 1]",
            to,
            "analog.hall.channels",
            says,
        );
    }
}

#[test]
fn decimal_commas_are_told_of_lists_of_whole_numbers_of_no_channels() {
    let from = "channels = [0, 1]";
    let to = "channels = [0, 1, 2, 3]";
    let found = findings(&LINEAR.edit_first(from, to));
    assert!(
        found.iter().all(|it| !it.help.contains("0.1")),
        "{found:#?}"
    );
}

#[test]
fn a_list_of_sections_that_have_names_is_told_with_a_place_for_the_name() {
    let found = findings(&LINEAR.edit_first("[serial.laser]", "[[serial]]"));
    assert_eq!(
        found[0].help, "write `[serial.NAME]`, once for each of them",
        "{found:#?}"
    );
}

#[test]
fn a_place_in_a_template_is_told_as_that() {
    let text = LINEAR.edit_first("delta1_mv = 20.0", "delta1_mv = {{ value }}");
    let found = findings(&text);
    assert_eq!(found.len(), 1, "{found:#?}");
    assert!(
        found[0].cause.contains("nothing filled it in"),
        "{found:#?}"
    );
}
