//! A gantry as a user zeroes it.

use std::fs;

use tests::{Edit, GANTRY};

use crate::programs::{Bench, check_says, live_rigs, number, text};

#[test]
fn a_gantry_is_zeroed_compared_with_its_acceptance_and_shown() {
    for rig in live_rigs() {
        let bench = Bench::of(rig, GANTRY, |text| text);
        bench.configure("machine.toml", |text| text);
        let zero = bench.run(&["zero"]).with_code(0);
        assert_eq!(zero["gantry"], "beam");
        let told = &zero["rotation"];
        assert!(number(&told["angle_urad"]).abs() < 400.0, "{told}");
        let u = number(&told["standard_uncertainty_urad"]);
        assert!((0.01..1.0).contains(&u), "{told}");
        assert!(told["angle_at_acceptance_urad"].is_null() && told["within_limit"] == true);
        let sides = zero["sides"].as_array().expect("both");
        assert_eq!(
            (&sides[0]["axis"], &sides[1]["axis"]),
            (&"x1".into(), &"x2".into())
        );

        let alone = bench.run(&["zero", "--axis", "x1"]).with_code(2);
        assert!(
            text(&alone["error"]).contains("zero both sides together"),
            "{alone}"
        );

        bench.configure("machine.toml", |text| {
            let keys = "turn_limit_mrad = 10.0\nangle_at_acceptance_urad = 5000.0\nangle_limit_urad = 100.0";
            text.edit("turn_limit_mrad = 10.0", keys)
        });
        let checked = bench.run_plainly(&["check"]).with_code(0);
        assert!(
            checked["notes"]
                .to_string()
                .contains("switches alone change"),
            "{checked}"
        );
        let off = bench.run(&["zero", "--axis", "beam"]).with_code(5);
        assert_eq!(off["rotation"]["within_limit"], false);
        assert!(
            text(&off["error"]).contains("the limit is 100.00 µrad"),
            "{off}"
        );
        let since = number(&off["rotation"]["change_since_last_urad"]);
        assert!(since.abs() < 400.0, "{off}");

        let report = ["report", text(&off["journal"]), "--output", "page.html"];
        bench.run_plainly(&report).with_code(0);
        let html = fs::read_to_string(bench.folder().join("page.html")).expect("it was written");
        check_says(
            &html,
            &[
                "zero of gantry beam",
                "Rotation of the stage",
                "at acceptance",
                "x2",
            ],
        );
        assert_eq!(bench.stop(), Some(0));
    }
}
