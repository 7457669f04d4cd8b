use machine::records::{CalibrationRecord, Content};
use units::{Approach, Metres};

use crate::Edit;
use crate::linear::LinearContent;

/// The first calibration with an uncertainty budget.
const GOLDEN: &str = include_str!("../../../golden/linear_budget.json");

fn read(text: &str) -> CalibrationRecord<LinearContent> {
    serde_json::from_str(text).unwrap()
}

#[test]
fn a_calibration_with_a_budget_stays_as_it_is_written() {
    let record = read(GOLDEN);
    assert_eq!(String::from_utf8(record.bytes()).unwrap(), GOLDEN);
    record.content.judge().unwrap();
    let budget = record.content.axis_budget("id").unwrap().unwrap();
    let last = budget.at(Metres::from_mm(60.0), Approach::Forward).unwrap();
    let u_nm = last.standard_uncertainty.nm();
    assert!((u_nm - 99.43).abs() < 0.01, "{u_nm}");
}

/// A sum that is not that of its lines is refused, and says where.
#[test]
fn a_budget_whose_sums_do_not_follow_from_its_lines_is_refused() {
    let check = |from: &str, to: &str, expected: &str| {
        let record = read(&GOLDEN.edit_first(from, to));
        assert_eq!(record.content.judge().unwrap_err().place, expected);
    };
    let of_next = "budget.places[1].forward.u_m";
    check("\"value\": 0.1,", "\"value\": 0.01,", of_next);
    let factor = "budget.coverage_factor";
    check(
        "\"coverage_factor\": 2.0",
        "\"coverage_factor\": 3.0",
        factor,
    );
    let evaluation = "budget.contributions[0].evaluation";
    check("\"evaluation\": \"A\"", "\"evaluation\": \"C\"", evaluation);
    let node = "nodes[0].forward_u_m";
    check("\"forward_u_m\": ", "\"forward_u_m\": 1", node);
}
