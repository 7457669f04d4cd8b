use super::*;

const LINES: usize = 12;

fn plan(offset: f64) -> SightedPlan {
    SightedPlan {
        offset,
        lines: LINES,
        passes: 1,
        range: Radians::from_arcsec(100.0),
    }
}

/// A placement in a file: all passes, each line at `value` of its pass, line and nominal angle in degrees.
fn file(offset: f64, header: &str, value: impl Fn(char, usize, f64) -> f64) -> String {
    let mut text = format!("{header}\n");
    for (pass, approach) in plan(offset).passes() {
        for line in 0..LINES {
            let nominal = (line as f64 + offset) * 30.0;
            let (sign, value) = (approach.symbol(), value(approach.symbol(), line, nominal));
            text.push_str(&format!("{offset},{pass},{sign},{line},{value}\n"));
        }
    }
    text
}

#[track_caller]
fn refused(offset: f64, text: &str, value: Sighted) -> String {
    let refused = plan(offset).from_csv(text, "p.csv", value);
    refused.expect_err("it cannot be used").to_string()
}

#[test]
fn all_passes_of_a_placement_are_read_in_each_of_the_three_ways() {
    let truth = |line: usize| 5.0 * line as f64 - 20.0;
    for (value, offset) in [
        (Sighted::ToLine, 0.0),
        (Sighted::Deviation, 7.0),
        (Sighted::Angle, 7.0),
        (Sighted::Angle, 2.5),
    ] {
        let text = file(offset, value.header(), |_, line, nominal| match value {
            // An encoder that starts again with every turn.
            Sighted::Angle => (nominal + truth(line) / 3600.0).rem_euclid(360.0),
            _ => truth(line),
        });
        let readings = plan(offset).from_csv(&text, "p.csv", value).unwrap();
        assert_eq!(readings.len(), 3 * LINES);
        for it in &readings {
            let apart = it.deviation.arcsec() - truth(it.line);
            assert!(apart.abs() < 1e-6, "{value:?}, line {}: {apart}", it.line);
        }
        let passes: Vec<_> = plan(offset).passes().collect();
        let of = |at: usize| (readings[at].pass, readings[at].approach);
        assert_eq!([of(0), of(12), of(24)], passes[..]);
    }
}

#[test]
fn a_file_of_another_placement_pass_line_or_kind_of_value_is_refused_where_it_is() {
    let good = file(7.0, Sighted::Deviation.header(), |_, _, _| 3.0);
    let with = |row: &str| format!("{good}{row}\n");
    for (row, says) in [
        (
            "8,1,+,0,3",
            "p.csv:38:1: `offset` is 8, and the placement that is due is the one at offset 7",
        ),
        (
            "7,2,-,0,3",
            "p.csv:38:3: pass 2- is none of those that are made; the passes of a placement are 1+, 1-, 2+",
        ),
        (
            "7,1,+,12,3",
            "p.csv:38:7: `line` is 12; the plate has 12 lines",
        ),
        (
            "7,1,+,5,3",
            "p.csv:38:7: line 5 of pass 1+ is already in row 7",
        ),
        ("7,1,up,5,3", "p.csv:38:5: `approach` is `up`"),
        ("7,1,+,5.5,3", "p.csv:38:7: `line` is `5.5`"),
    ] {
        let error = refused(7.0, &with(row), Sighted::Deviation);
        assert!(error.contains(says), "{row}: {error}");
    }
    let error = refused(7.0, &good, Sighted::Angle);
    assert!(
        error.contains("p.csv:1:27") && error.contains("angle_deg"),
        "{error}"
    );
}

#[test]
fn a_quarter_of_a_pass_may_be_missing_and_not_more() {
    let good = file(0.0, Sighted::ToLine.header(), |_, _, _| 1.0);
    let without = |lines: core::ops::Range<usize>| -> String {
        let missing = |row: &&str| {
            !lines
                .clone()
                .any(|it| row.starts_with(&format!("0,1,-,{it},")))
        };
        good.lines()
            .filter(missing)
            .map(|row| format!("{row}\n"))
            .collect()
    };
    let readings = plan(0.0).from_csv(&without(4..7), "p.csv", Sighted::ToLine);
    assert_eq!(readings.unwrap().len(), 3 * LINES - 3);
    let error = refused(0.0, &without(4..8), Sighted::ToLine);
    assert!(
        error.contains("pass 1- has 8 of 12 lines, at least 9 are needed"),
        "{error}"
    );
}

#[test]
fn a_value_with_a_slip_of_the_pen_is_refused_in_its_row() {
    for (slip, says) in [
        (-130.0, "p.csv:18:9: this line would be -130.000 arcsec"),
        (5400.0, "p.csv:18:9: this line would be +5400.000 arcsec"),
        (54_001.0, "half the line spacing is 54000.000 arcsec"),
    ] {
        let text = file(0.0, Sighted::ToLine.header(), |approach, line, _| {
            match (approach, line) {
                ('-', 4) => slip,
                _ => 13.0,
            }
        });
        let error = refused(0.0, &text, Sighted::ToLine);
        assert!(error.contains(says), "{slip}: {error}");
    }
}

#[test]
fn the_first_value_is_believed_within_half_a_spacing_and_the_others_beside_it() {
    let plan = plan(0.0);
    let arcsec = |values: &[f64]| -> Vec<f64> {
        values
            .iter()
            .map(|it| Radians::from_arcsec(*it).value())
            .collect()
    };
    let judge = |value, others: &[f64]| plan.judge(Radians::from_arcsec(value), &arcsec(others));
    assert_eq!(judge(3000.0, &[]), Ok(()));
    assert_eq!(judge(3099.0, &[3000.0]), Ok(()));
    assert!(matches!(
        judge(3101.0, &[3000.0]),
        Err(Implausible::FarFromOthers { .. })
    ));
    // One wild value among the others moves no limit.
    assert_eq!(judge(90.0, &[0.0, 1.0, 2.0, 5000.0]), Ok(()));
    assert!(matches!(
        judge(-60_000.0, &[]),
        Err(Implausible::OtherLine { .. })
    ));
}
