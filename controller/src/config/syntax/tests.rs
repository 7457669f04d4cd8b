use crate::Edit;
use crate::config::diagnostic::Diagnostic;
use crate::config::{ConfigError, parse};

const LINEAR: &str = include_str!("../../../../configs/machines/linear.toml");

#[track_caller]
fn check(from: &str, to: &str, key: &str, says: [&str; 2]) {
    let found = match parse(&LINEAR.edit_first(from, to), "m.toml") {
        Err(ConfigError::Invalid { findings }) => findings,
        other => panic!("{other:?}"),
    };
    let [one] = &found[..] else {
        panic!("{found:#?}")
    };
    assert_eq!(one.key, key);
    assert!(one.cause.contains(says[0]), "{one}");
    assert!(one.help.contains(says[1]), "{one}");
}

#[test]
fn a_number_with_a_unit_says_how_it_is_written() {
    let says = [
        "`0.2 mm` is no number",
        "write 200.0, which is 0.2 mm in the key's unit",
    ];
    let from = "standard_uncertainty_limit_um = 0.2";
    let key = "axis.x.zero.standard_uncertainty_limit_um";
    check(from, "standard_uncertainty_limit_um = 0.2 mm", key, says);
    let says = ["`200mm/s` is no number", "write 200 without `mm/s`"];
    let (from, key) = ("speed_mm_per_s = 200.0", "axis.x.speed_mm_per_s");
    check(from, "speed_mm_per_s = 200mm/s    # fast", key, says);
}

#[test]
fn text_without_quotes_is_shown_in_them() {
    let says = ["`slcan` is text without quotes", "\"slcan\""];
    let (from, key) = ("transport = \"slcan\"", "can.can0.transport");
    check(from, "transport = slcan", key, says);
    let says = ["`/dev/ttyACM0`", "\"/dev/ttyACM0\""];
    check(
        "path = \"/dev/ttyACM0\"",
        "path = /dev/ttyACM0",
        "serial.laser.path",
        says,
    );
}

#[test]
fn what_stands_there_twice_is_named_with_both_places() {
    let first = LINEAR.lines().position(|it| it.starts_with("node_id = 1"));
    let line = format!("line {} has it first", first.expect("it is there") + 1);
    let (key, says) = ("axis.x.node_id", [line.as_str(), "leave one"]);
    check("node_id = 1\n", "node_id = 1\nnode_id = 2\n", key, says);
    let says = ["the section stands here a second time", "leave one"];
    check(
        "[axis.x.verify]",
        "[axis.x.calibrate]\n[axis.x.verify]",
        "axis.x.calibrate",
        says,
    );
}

#[test]
fn a_section_that_is_there_twice_may_be_that_of_another_name_which_has_only_parts() {
    const UVW: &str = include_str!("../../../../configs/machines/uvw.toml");
    let text = UVW.edit("[axis.v]\n", "[axis.u]\n");
    let Err(ConfigError::Invalid { findings }) = parse(&text, "m.toml") else {
        panic!("it stands there twice")
    };
    let help = "did you mean [axis.v] by one of them? It is missing";
    assert!(findings.iter().any(|it| it.help == help), "{findings:#?}");
    assert_eq!(findings.len(), 1, "{findings:#?}");
}

#[test]
fn a_section_under_the_name_of_its_neighbour_is_known_by_its_keys() {
    for (right, wrong) in [
        ("axis.x.identity", "axis.x.zero"),
        ("axis.x.zero", "axis.x.identity"),
        ("axis.x.verify", "axis.x.compensation"),
    ] {
        let text = LINEAR.edit(&format!("[{right}]\n"), &format!("[{wrong}]\n"));
        let Err(ConfigError::Invalid { findings }) = parse(&text, "m.toml") else {
            panic!("it stands there twice")
        };
        assert_eq!(findings.len(), 1, "{right}: {findings:#?}");
        let says = format!("write [{right}] ");
        assert!(findings[0].help.starts_with(&says), "{findings:#?}");
    }
}

#[test]
fn brackets_without_a_name_lose_no_key() {
    let text = LINEAR.edit("soft_min_mm = -3.0", "[]\nsoft_min_mm = -3.0");
    let Err(ConfigError::Invalid { findings }) = parse(&text, "m.toml") else {
        panic!("it is no section")
    };
    assert_eq!(findings.len(), 1, "{findings:#?}");
    assert!(findings[0].help.starts_with("remove it"), "{findings:#?}");
}

#[test]
fn a_key_that_is_called_like_a_section_is_named_with_both_places() {
    let header = LINEAR.lines().position(|it| it == "[axis.x]");
    let header = header.expect("it is there") + 1;
    let says = format!("a section here, and a key on line {}", header + 1);
    let to = "[axis.x]\nzero = 400.0\n";
    check("[axis.x]\n", to, "axis.x.zero", [&says, "wrong name"]);
    let says = format!("a key here, and a section on line {header}");
    let to = "[axis.x.soft]\n[axis.x]\nsoft = 3\n";
    check("[axis.x]\n", to, "axis.x.soft", [&says, "wrong name"]);
}

#[test]
fn a_number_or_a_word_that_is_nearly_right_is_told_as_what_it_is() {
    let (from, key) = ("correct_air = true", "instrument.laser.correct_air");
    check(from, "correct_air = True", key, ["`True`", "write true"]);
    check(from, "correct_air = off", key, ["`off`", "write false"]);
    let from = "device_type = 0x00020192";
    let key = "axis.x.identity.device_type";
    check(
        from,
        "device_type = 0x0002019G",
        key,
        ["cannot be read", "give a whole number"],
    );
}

#[test]
fn in_a_list_of_sections_the_same_section_is_searched() {
    const UVW: &str = include_str!("../../../../configs/machines/uvw.toml");
    let third = UVW.rfind("lead_mm").expect("it is there");
    let text = format!("{}lead_mm = 2.0\n{}", &UVW[..third], &UVW[third..]);
    let Err(ConfigError::Invalid { findings }) = parse(&text, "m.toml") else {
        panic!("it stands there twice")
    };
    let first = text[..third].matches('\n').count() + 1;
    assert!(
        findings[0]
            .cause
            .contains(&format!("line {first} has it first")),
        "{findings:?}"
    );
}

#[test]
fn a_list_over_several_lines_is_no_section() {
    let from = "channels = [0, 1] ";
    let to = "channels = [\n  0,\n  1\n]\nwatch_master_ms = 5 mm #";
    let text = LINEAR.edit_first(from, to);
    let Err(ConfigError::Invalid { findings }) = parse(&text, "m.toml") else {
        panic!("it has a unit")
    };
    let one = &findings[0];
    assert_eq!(one.key, "analog.hall.watch_master_ms", "{findings:#?}");
    assert!(one.cause.contains("`5 mm`"), "{one}");
    // Of another quantity's unit nobody knows how much was meant.
    assert!(
        one.help.contains("in the unit that the key ends with"),
        "{one}"
    );
}

#[test]
fn a_key_and_its_value_without_what_parts_them_say_so() {
    let says = ["no `=`", "write `node_id = 1`"];
    check("\nnode_id = 1\n", "\nnode_id 1\n", "axis.x.node_id", says);
}

/// With each `from` become its `to`, these lines are told, in this order.
#[track_caller]
fn told(edits: &[(&str, &str)], wanted: &[&str]) -> Vec<Diagnostic> {
    let text = edits.iter().fold(LINEAR.to_owned(), |text, (from, to)| {
        text.edit_first(from, to)
    });
    let Err(ConfigError::Invalid { findings }) = parse(&text, "m.toml") else {
        panic!("it is wrong")
    };
    let line = |at: usize| text.lines().nth(at - 1).unwrap_or_default();
    let lines: Vec<_> = findings.iter().map(|it| line(it.line)).collect();
    assert_eq!(lines, wanted, "{findings:#?}");
    findings
}

#[test]
fn all_that_is_wrong_is_told_at_once_whatever_it_is() {
    let edits = [
        ("sync_period_ms = 5.0", "sync_period_ms = 5,0"),
        ("resolution_nm = 10.0", "resolution_mn = 10.0"),
        ("node_id = 2", "node_id = 1"),
        ("[axis.x.verify]", "[axis.x.verify"),
        ("targets = 8", "targets: 1"),
    ];
    let wanted = [
        "sync_period_ms = 5,0",
        "resolution_mn = 10.0           # one encoder count",
        "node_id = 1",
        "[axis.x.verify",
        "targets: 1",
    ];
    told(&edits, &wanted);
}

#[test]
fn what_cannot_be_read_is_not_told_as_missing() {
    let found = told(&[("\nnode_id = 1\n", "\nnode_id =\n")], &["node_id ="]);
    assert_eq!(found[0].key, "axis.x.node_id");
    told(
        &[("channels = [0, 1]", "channels = [0, one]")],
        &[
            "channels = [0, one]              # converter channels, in the order \"peak\", \"slope\"",
        ],
    );
}

#[test]
fn a_list_that_does_not_end_is_told_where_it_begins() {
    let found = told(
        &[("full_scale_v = [5.0, 5.0]", "full_scale_v = [5.0,\n  5.0")],
        &["full_scale_v = [5.0,"],
    );
    assert!(found[0].cause.contains("does not end"), "{}", found[0]);
    let whole = LINEAR.edit_first("[5.0, 5.0]", "[\n  5.0, # peak\n  5.0,\n]");
    parse(&whole, "m.toml").unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn a_section_that_is_there_twice_is_told_once_and_its_keys_are_no_others() {
    let verify = LINEAR.find("[axis.x.verify]").expect("it has one");
    let calibrate = LINEAR.find("[axis.x.calibrate]").expect("it has one");
    let section = &LINEAR[calibrate..verify];
    let text = format!("{LINEAR}\n{section}");
    let Err(ConfigError::Invalid { findings }) = parse(&text, "m.toml") else {
        panic!("it is there twice")
    };
    assert_eq!(findings.len(), 1, "{findings:#?}");
    let (from, to) = (
        "[axis.x.identity]",
        "[[axis.x.identity]]\n[axis.x.identity]",
    );
    let found = told(&[(from, to)], &["[axis.x.identity]"]);
    let cause = &found[0].cause;
    assert!(cause.contains("`[[axis.x.identity]]` on line"), "{cause}");
}

#[test]
fn a_file_without_a_line_that_is_right_is_told_in_short() {
    let text: String = (0..200)
        .map(|at| format!("word {at} of a letter\n"))
        .collect();
    let Err(ConfigError::Invalid { findings }) = parse(&text, "m.toml") else {
        panic!("it is a letter")
    };
    assert!(findings.len() < 40, "{}", findings.len());
    let says = |it: &Diagnostic| it.help.contains("175 more places");
    assert!(findings.iter().any(says), "{findings:#?}");
}

/// One finding, whose help ends with what was there before.
#[track_caller]
fn check_meant(text: &str, from: &str, to: &str, meant: &str) {
    let found = match parse(&text.edit_first(from, to), "m.toml") {
        Err(ConfigError::Invalid { findings }) => findings,
        other => panic!("{to}: {other:?}"),
    };
    let [one] = &found[..] else {
        panic!("{to}: {found:#?}")
    };
    let is_told = one.help.contains("write ") && one.help.contains(meant);
    assert!(is_told, "{to}: {one}");
}

#[test]
fn what_is_proposed_is_a_line_that_the_section_takes() {
    let key = "standard_uncertainty_limit_um = ";
    for value in [
        "O.2",
        "0.2 (checked)",
        "~0.2",
        "0.2 +/- 0.05",
        "0.2 0.2",
        "0..2",
        "0.2.",
        "0.2^M",
        "0.0002 mm",
        "″0.2″",
    ] {
        check_meant(
            LINEAR,
            &format!("{key}0.2"),
            &format!("{key}{value}"),
            "0.2",
        );
    }
    let (from, rate) = ("baud_bit_per_s = 115200", "baud_bit_per_s = ");
    for value in ["115,200", "115.200,0", "115 200", "1l5200", "0115200"] {
        check_meant(LINEAR, from, &format!("{rate}{value}"), "115200");
    }
    for value in ["- 3.0", "--3.0", "+-3.0", "−3,0", "-3.0 (below)"] {
        let to = format!("soft_min_mm = {value}");
        check_meant(LINEAR, "soft_min_mm = -3.0", &to, "-3.0");
    }
    let text = "device = \"cia402\"";
    for line in [
        "set device = \"cia402\"",
        "- device = \"cia402\"",
        "12: device = \"cia402\"",
        "dev#ice = \"cia402\"",
        "device = \"cia402\"q",
        "device = \"cia\n402\"",
        "device =\n  \"cia402\"",
    ] {
        let meant = match line.find("device") {
            Some(0) if line.ends_with('q') => "\"cia402\"",
            _ => text,
        };
        check_meant(LINEAR, text, line, meant);
    }
    check_meant(
        LINEAR,
        text,
        "device = \"cia402\"   the x axis",
        "\"cia402\"; a remark begins with #",
    );
    for value in [
        "[5.0, 5.0]  (checked)",
        "[5.0, 5.0)",
        "5.0, 5.0",
        "(5.0; 5.0)",
    ] {
        let line = format!("full_scale_v = {value}");
        check_meant(LINEAR, "full_scale_v = [5.0, 5.0]", &line, "[5.0, 5.0]");
    }
}

#[test]
fn a_heading_is_proposed_that_is_there() {
    for (from, to) in [
        ("[axis.x.identity]", "[axis,x.identity]"),
        ("[axis.x.identity]", "[axis..x.identity]"),
        ("[axis.x.identity]", "[axis.x.identity] ="),
        ("[axis.x.identity]", "axis.x.identity:"),
        ("[axis.x.identity]", "- [axis.x.identity]"),
        ("[axis.x.identity]", "axis.x.identity = {"),
        ("[axis.x.identity]", "identity:"),
        ("[axis.x.identity]", "[axis.x.\nidentity]"),
        ("[axis.x.identity]", "\"[axis.x.identity]\""),
        ("[axis.x.identity]", "［axis.x.identity］"),
        ("[axis.x.identity]", "[axis.x.ident"),
        ("[axis.x.identity]", "[[axis.x.identity]]"),
        ("[machine]", "machine:"),
    ] {
        check_meant(LINEAR, from, to, from);
    }
    const UVW: &str = include_str!("../../../../configs/machines/uvw.toml");
    let actuator = "[[platform.actuator]]";
    check_meant(UVW, actuator, "(platform.actuator)", actuator);
}

#[test]
fn a_section_within_a_line_is_proposed_as_a_whole() {
    let wanted = "{ by = \"mark\", object = \"0x2F00:01\" }";
    for value in [
        "{ by = mark, object = 0x2F00:01 }",
        "{ by: \"mark\", object: \"0x2F00:01\" }",
        "{ \"by\": \"mark\", \"object\": \"0x2F00:01\" }",
        "{ by = \"mark\"; object = \"0x2F00:01\" ]",
        "by = \"mark\", object = \"0x2F00:01\"",
        "{ by = “mark”, object = “0x2F00:01” }",
    ] {
        let to = format!("[axis.x]\nkept_zero = {value}\n");
        let found = match parse(&LINEAR.edit("[axis.x]\n", &to), "m.toml") {
            Err(ConfigError::Invalid { findings }) => findings,
            other => panic!("{value}: {other:?}"),
        };
        let [one] = &found[..] else {
            panic!("{value}: {found:#?}")
        };
        assert!(one.help.contains(wanted), "{value}: {one}");
    }
}

#[test]
fn no_value_is_proposed_that_was_not_meant() {
    let key = "standard_uncertainty_limit_um = ";
    for value in [
        "0.4/2",
        "0.2 0.3",
        "2 x 10^-1",
        "0.S2",
        "0.1+0.1",
        "0.2 and more = 3",
        "±0.2",
    ] {
        let to = format!("{key}{value}");
        let found = match parse(
            &LINEAR.edit_first("standard_uncertainty_limit_um = 0.2", &to),
            "m.toml",
        ) {
            Err(ConfigError::Invalid { findings }) => findings,
            other => panic!("{to}: {other:?}"),
        };
        for it in &found {
            let proposed = it.help.split("write ").nth(1).unwrap_or_default();
            assert!(
                !proposed.starts_with(|it: char| it.is_ascii_digit()),
                "{to}: {it}"
            );
        }
    }
    // In any alphabet, and of whatever length.
    for line in [
        "• device = 1",
        "“device” = 1",
        "［axis］",
        "é",
        "′",
        "-",
        "[",
        "]",
        "=",
        "\"",
        "ß = ß",
        "…: 5",
    ] {
        let text = LINEAR.edit_first("device = \"cia402\"", line);
        assert!(
            matches!(parse(&text, "m.toml"), Err(ConfigError::Invalid { .. })),
            "{line}"
        );
    }
}
