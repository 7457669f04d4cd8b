use super::*;

/// What is said of a line, and how it was meant.
#[track_caller]
fn check(line: &str, cause: &str, help: &str, meant: Option<&str>) {
    assert!(!is_toml(line), "{line}");
    let slip = of_line(line, 0);
    assert!(slip.cause.contains(cause), "{line}: {slip:?}");
    assert!(slip.help.contains(help), "{line}: {slip:?}");
    let read = |text: &str| text.parse::<Table>().expect("it is TOML");
    assert_eq!(slip.meant.as_deref().map(read), meant.map(read), "{slip:?}");
}

#[test]
fn numbers_say_how_they_are_written() {
    for (value, cause, meant) in [
        ("10,5", "has a comma", "10.5"),
        ("-0,25", "has a comma", "-0.25"),
        ("5.", "no number as it is written", "5.0"),
        (".5", "no number as it is written", "0.5"),
        ("-.5", "no number as it is written", "-0.5"),
        ("007.5", "no number as it is written", "7.5"),
        ("1'000.0", "no number as it is written", "1000.0"),
        ("1 000", "no number as it is written", "1000"),
        ("0X1f", "no number as it is written", "0x1f"),
        ("7FF", "no number as it is written", "0x7FF"),
        ("25c", "the unit is in the key's name", "25"),
        ("10 mm", "the unit is in the key's name", "10"),
        ("7FFh", "no number as it is written", "0x7FF"),
        ("$7FF", "no number as it is written", "0x7FF"),
        ("12.5 mm", "the unit is in the key's name", "12.5"),
        ("−3.0", "a dash and no minus", "-3.0"),
        ("–3.0", "a dash and no minus", "-3.0"),
        ("１０.0", "not the `1` of the keyboard", "10.0"),
        ("\u{a0}3.0", "not seen stands here (U+00A0)", "3.0"),
        ("10.0,", "no line ends with `,`", "10.0"),
        ("10.0;", "no line ends with `;`", "10.0"),
    ] {
        let line = format!("x_mm = {value}   # why");
        check(&line, cause, "", Some(&format!("x_mm = {meant}")));
    }
    check("x = 1.2.3", "no number", "one point", None);
    check(
        "x = 99999999999999999999",
        "larger than any",
        "smaller",
        None,
    );
    // Of hours nobody knows how many millimetres they are.
    check(
        "x_mm = 10h",
        "the unit is in the key's name",
        "in the unit",
        None,
    );
    check("x = NaN", "`NaN` is no value here", "give a value", None);
    check("x = ...", "`...` is no value here", "give a value", None);
}

#[test]
fn words_say_which_quotation_marks_they_need() {
    for (value, cause) in [
        ("slcan", "text without quotes"),
        ("“slcan”", "a quotation mark of printed text"),
        ("„slcan“", "a quotation mark of printed text"),
        ("‘slcan’", "a quotation mark of printed text"),
        ("\"slcan", "do not match"),
        ("slcan\"", "do not match"),
        ("\"slcan'", "do not match"),
        ("\"\"slcan\"", "do not match"),
    ] {
        let line = format!("x = {value}");
        check(&line, cause, "\"slcan\"", Some("x = \"slcan\""));
    }
    let meant = Some("path = 'C:\\data\\x'");
    check(
        "path = \"C:\\data\\x\"",
        "`\\` has a meaning",
        "'C:\\data\\x'",
        meant,
    );
    check(
        "on = True",
        "`True` is not known",
        "write true",
        Some("on = true"),
    );
    check(
        "on = no # yet",
        "`no` is not known",
        "write false",
        Some("on = false"),
    );
}

#[test]
fn lists_say_what_parts_their_entries() {
    for value in [
        "(0, 1)", "0, 1]", "{0, 1}", "[0 1]", "[0; 1]", "[0,, 1]", "[, 0, 1]",
    ] {
        let line = format!("channels = {value} # both");
        check(&line, "list", "write [0, 1]", Some("channels = [0, 1]"));
    }
    check("x = [one, 1]", "cannot be read", "texts in quotes", None);
    let slip = of_lines("x = [0, 1 # both", "x = [0, 1 # both", End::List, 1);
    assert!(slip.cause.contains("does not end"), "{slip:?}");
    assert!(slip.meant.is_some_and(|it| is_toml(&it)));
}

#[test]
fn keys_and_what_parts_them_from_values_say_how_they_are_written() {
    let meant = Some("node_id = 1");
    for line in [
        "node_id: 1",
        "node_id 1",
        "node_id == 1",
        "node_id := 1",
        "- node_id: 1",
        "node id = 1",
    ] {
        check(line, "", "node_id", meant);
    }
    check(
        "name: linear",
        "`:` stands where",
        "name = \"linear\"",
        Some("name = \"linear\""),
    );
    check("node_id", "`node_id` has no value", "node_id = value", None);
    check("node_id =", "no value behind", "write a value", None);
    check("= 1", "no key before", "key = value", None);
    check(
        "window_µm = 1",
        "not the `u`",
        "window_um",
        Some("window_um = 1"),
    );
    check("nоde = 1", "`о` is not the `o`", "node", Some("node = 1"));
    let (cause, help) = ("the key `b` begins in the middle", "new line before `b`");
    for between in [" ", ", ", "; ", "\t"] {
        check(&format!("a = 1{between}b = 2"), cause, help, Some("a = 1"));
    }
    for line in ["path = “a=b”", "a = 1\u{a0}b = 2", "x = 20 // 20°=max"] {
        // Whatever is said of it.
        of_line(line, 0);
    }
}

#[test]
fn headings_say_where_their_brackets_stand() {
    for line in [
        "[axis.x", "axis.x]", "(axis.x)", "{axis.x}", "[axis x]", "[axis/x]", "[axis.x)",
    ] {
        check(
            line,
            "names no section",
            "write `[axis.x]`",
            Some("[axis.x]"),
        );
    }
    check(
        "[[point]",
        "names no section",
        "`[[point]]`",
        Some("[[point]]"),
    );
}

#[test]
fn what_is_no_line_of_a_configuration_says_so() {
    for sign in ["//", ";", "--", "%", "/*", "<!--"] {
        check(&format!("{sign} old"), "begins no comment", "#", Some(""));
        let line = format!("a = 1.5 {sign} old");
        check(&line, "begins no comment", "#", Some("a = 1.5"));
    }
    for line in ["<<<<<<< HEAD", "=======", ">>>>>>> other"] {
        check(line, "two versions", "keep one version", Some(""));
    }
    check("a = 1\u{7}", "(U+0007)", "remove it", Some("a = 1"));
    check(
        "Hello Tom, please look",
        "cannot be read",
        "`key = value`",
        None,
    );
}

#[test]
fn a_message_shows_no_more_than_can_be_read_and_nothing_that_a_terminal_obeys() {
    assert_eq!(shown(&"x".repeat(70)).chars().count(), 61);
    assert_eq!(shown("a\u{1b}[31m"), "a\\u{1b}[31m");
}
