//! Measured deviations become an error table, and a target becomes the set-point that brings the
//! stage there: the mathematics alone, with no machine.
//!
//! `cargo run --example fit`
#![expect(clippy::print_stdout, reason = "an example shows what it computed")]
use std::fmt::Write as _;

use compensator::error_table::{
    Compensation, EndPolicy, FitOptions, Interpolation, Limits, LinearSeries, fit,
};
use compensator::iso230;
use units::{Approach, Metres, MetresPerSecond};

/// A stage that is 1 µm too long in each millimetre and has 2 µm of lost motion, measured in five
/// runs from both sides.
fn measured() -> String {
    let mut rows = "run,approach,target_mm,measured_mm\n".to_owned();
    for run in 1..=5 {
        for (approach, lag_mm) in [("+", 0.0), ("-", 0.002)] {
            for step in 0..=10 {
                let step = if approach == "+" { step } else { 10 - step };
                let target_mm = 5.0 * f64::from(step);
                let measured_mm = target_mm * 1.001 + lag_mm + 1e-5 * f64::from(run);
                let row = writeln!(rows, "{run},{approach},{target_mm},{measured_mm:.6}");
                row.expect("a text takes everything");
            }
        }
    }
    rows
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let series = LinearSeries::from_csv(&measured(), "measured.csv")?;
    let figures = iso230::evaluate(&series)?;
    println!(
        "as found: A = {:.3} um",
        figures.accuracy.bidirectional.um()
    );
    let table = fit(&series, &FitOptions::default())?;
    let limits = Limits {
        size: Metres::from_um(100.0),
        slope: 0.01,
        rate: MetresPerSecond(1.0),
    };
    // Proves that the table can be undone everywhere before it is ever used.
    let ends = EndPolicy::Refuse;
    let compensation = Compensation::new(table.clone(), Interpolation::Linear, limits, ends)?;
    for approach in [Approach::Forward, Approach::Reverse] {
        let target = Metres::from_mm(30.0);
        let set_point = compensation.set_point(target, approach)?;
        println!("from {approach:?} to 30 mm: {:.6} mm", set_point.mm());
        // The stage adds 30 um on its way, and 2 um more in reverse.
        let arrives_mm = set_point.mm() * 1.001
            + if approach == Approach::Reverse {
                0.002
            } else {
                0.0
            };
        assert!((arrives_mm - 30.0).abs() < 1e-4);
    }
    let too_small = Limits {
        size: Metres::from_um(10.0),
        ..limits
    };
    let refused = Compensation::new(table, Interpolation::Linear, too_small, ends);
    println!("within 10 um: {}", refused.expect_err("50 um are more"));
    Ok(())
}
