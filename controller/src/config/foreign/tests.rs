use super::*;
use crate::Edit;
use crate::config::{ConfigError, parse, schema};

const LINEAR: &str = include_str!("../../../../configs/machines/linear.toml");

#[track_caller]
fn meant(text: &str, section: &str) -> Foreign {
    let lines: Vec<&str> = text.lines().collect();
    let around = Around {
        schema: schema::inline(),
        section,
        headings: &["axis.x", "axis.x.zero"],
    };
    of(&lines, &around).expect("it is a section")
}

#[test]
fn a_section_of_another_language_is_the_one_that_has_its_keys() {
    let cyclic = [
        "[axis.x.cyclic]",
        "jerk_mm_per_s3 = 20000.0",
        "deviation_limit_um = 500.0",
    ];
    for text in [
        "\"cyclic\": {\n  \"jerk_mm_per_s3\": 20000.0,\n  \"deviation_limit_um\": 500.0\n},",
        "Cyclic(\n    jerk_mm_per_s3=20000.0,\n    deviation_limit_um=500.0,\n)",
        "cyclic:\n  jerk_mm_per_s3: 20000.0   # steep\n  deviation_limit_um: 500.0\n",
        "<cyclic>\n  <jerk_mm_per_s3>20000.0</jerk_mm_per_s3>\n  <deviation_limit_um>500.0</deviation_limit_um>\n</cyclic>",
    ] {
        let found = meant(text, "axis.x");
        assert_eq!(found.path.as_deref(), Some("axis.x.cyclic"), "{text}");
        assert_eq!(found.meant[..3], cyclic, "{text}");
        assert!(found.help.contains("`[axis.x.cyclic]`"), "{}", found.help);
    }
}

#[test]
fn sections_within_sections_keep_their_lines() {
    let text = "axis:\n  x:\n    zero:\n      samples: 10\n    device: cia402\nother";
    assert!(
        of(
            &text.lines().collect::<Vec<_>>(),
            &Around {
                schema: schema::inline(),
                section: "",
                headings: &[]
            }
        )
        .is_none()
    );
    let text = "axis:\n  x:\n    device: cia402\n    zero:\n      samples: 10\nother";
    let found = meant(text, "");
    assert_eq!(
        found.meant,
        [
            "",
            "[axis.x]",
            "device = \"cia402\"",
            "[axis.x.zero]",
            "samples = 10"
        ]
    );
}

#[test]
fn lists_over_several_lines_and_in_round_brackets_are_lists() {
    let text = "analog_hall = {\n  \"device\": \"cia401\",\n  \"channels\": [\n    0,\n    1\n  ],\n  \"full_scale_v\": (5.0, 5.0)\n}";
    let found = meant(text, "axis.x.identity");
    let said: Vec<&String> = found.meant.iter().filter(|it| !it.is_empty()).collect();
    assert_eq!(
        said,
        [
            "[analog.hall]",
            "device = \"cia401\"",
            "channels = [0, 1]",
            "full_scale_v = [5.0, 5.0]"
        ]
    );
}

#[test]
fn what_is_no_section_is_left_to_be_told_line_by_line() {
    for text in [
        "see below (",
        "speed_mm_per_s = 5.0,",
        "a:\nb = 5",
        "x {",
        "{",
        "",
        "note: (\nmore of it\n)",
    ] {
        let around = Around {
            schema: schema::inline(),
            section: "axis.x",
            headings: &[],
        };
        let lines: Vec<&str> = text.split('\n').collect();
        assert!(
            of(&lines, &around).is_none_or(|it| it.path.is_none()),
            "{text}"
        );
    }
}

#[test]
fn a_file_with_one_is_told_once() {
    let text = crate::Edit::edit(LINEAR, "[machine]\n", "\"machine\": {\n");
    let text = crate::Edit::edit(text.as_str(), "\n[can.can0]", "}\n[can.can0]");
    let Err(ConfigError::Invalid { findings }) = parse(&text, "m.toml") else {
        panic!("it is no TOML")
    };
    let [one] = &findings[..] else {
        panic!("{findings:#?}")
    };
    assert!(one.help.starts_with("write `[machine]`"), "{one}");
}

#[test]
fn two_versions_of_a_part_are_told_once_and_the_first_is_read_on() {
    let from = "following_error_limit_um = 500.0\n";
    let to = "<<<<<<< HEAD\nfollowing_error_limit_um = 500.0\n=======\nfollowing_error_limit_um = 900.0\n>>>>>>> other\n";
    let text = LINEAR.edit(from, to);
    let Err(ConfigError::Invalid { findings }) = parse(&text, "m.toml") else {
        panic!("nobody chose")
    };
    assert_eq!(findings.len(), 1, "{findings:#?}");
    assert!(
        findings[0].help.starts_with("keep one version"),
        "{findings:#?}"
    );
}
