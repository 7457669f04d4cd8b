//! Why a calibration makes an axis worse: by how what is left looks like what the calibration takes away.

/// So alike two curves are one and the same, but for a factor.
const ALIKE: f64 = 0.95;

/// What probably is wrong, for a person: of each place what the calibration says of it, and what is left there.
pub(crate) fn likely_cause(pairs: &[(f64, f64)]) -> String {
    told(likeness(pairs))
}

/// The same where what is left can follow from what the calibration says in several ways: by that which it follows most
/// closely.
pub(crate) fn likeliest_cause(ways: &[Vec<(f64, f64)>]) -> String {
    let likenesses = ways.iter().filter_map(|it| likeness(it));
    told(likenesses.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())))
}

/// By which factor what is left follows what the calibration says, and how closely (their correlation); `None` where
/// either has no shape.
fn likeness(pairs: &[(f64, f64)]) -> Option<(f64, f64)> {
    let count = pairs.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>() / count;
    let (used, left) = (mean(|it| it.0), mean(|it| it.1));
    let (mut of_used, mut of_left, mut of_both) = (0.0, 0.0, 0.0);
    for pair in pairs {
        let (x, y) = (pair.0 - used, pair.1 - left);
        of_used += x * x;
        of_left += y * y;
        of_both += x * y;
    }
    let correlation = of_both / (of_used * of_left).sqrt();
    correlation
        .is_finite()
        .then_some((of_both / of_used, correlation))
}

/// With a right calibration nothing of it is left (factor 0). One with the wrong sign leaves twice the deviation, −2 of
/// what it says; one of deviations that the axis has not leaves these, −1; one in too small a unit leaves them nearly
/// whole, many times what it says.
fn told(likeness: Option<(f64, f64)>) -> String {
    let follows = likeness.filter(|(_, correlation)| correlation.abs() > ALIKE);
    match follows.map(|(factor, _)| factor) {
        Some(-2.5..=-1.5) => "what is left is twice what it takes away: its SIGN is wrong, or the axis or the \
                              instrument counts the other way round"
            .into(),
        Some(-1.3..=-0.7) => "what is left is what it takes away: the axis has no such deviations. It is of ANOTHER \
                              stage or axis, or in a unit that is too large (mm taken for inches, µm for mm)"
            .into(),
        Some(factor @ 3.0..) => format!(
            "what is left is {factor:.0} times what it takes away: it is in a UNIT that is too small (inches taken for \
             mm, mm for µm)"
        ),
        _ => "what is left does not look like what it takes away: it is of another place, axis or stage, or the \
              stage has changed since"
            .into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The deviations of a stage, by its places.
    fn curve(at: u32) -> f64 {
        let x = f64::from(at);
        3.0 * (x / 3.0).sin() + 0.2 * x
    }

    /// What is told of a table that says `says` of each place, on the stage above.
    #[track_caller]
    fn check(says: impl Fn(u32) -> f64, cause: &str) {
        let pairs = (0..20).map(|at| {
            let noise = 0.05 * (f64::from(at * 7919 % 11) - 5.0);
            let (used, left) = (says(at), curve(at) - says(at) + noise);
            (used, left)
        });
        let told = told(likeness(&pairs.collect::<Vec<_>>()));
        assert!(told.contains(cause), "{told}");
    }

    #[test]
    fn a_wrong_sign_unit_or_stage_is_told_by_what_is_left() {
        check(|at| -curve(at), "its SIGN is wrong");
        check(
            |at| 25.4 * curve(at),
            "of ANOTHER stage or axis, or in a unit that is too large",
        );
        check(
            |at| curve(at) / 25.4,
            "24 times what it takes away: it is in a UNIT that is too small",
        );
        check(
            |at| 30.0 * (f64::from(at) / 2.0).cos(),
            "of ANOTHER stage or axis",
        );
        check(|at| 3.0 * (1.7 * f64::from(at)).cos(), "does not look like");
        assert!(told(None).contains("does not look like"));
    }

    #[test]
    fn of_several_ways_the_one_that_is_followed_most_closely_tells() {
        let way = |says: fn(f64) -> f64| (0..20).map(move |at| (says(curve(at)), curve(at)));
        let unlike = (0..20).map(|at| ((1.7 * f64::from(at)).cos(), curve(at)));
        let ways = [unlike.collect(), way(|it| -0.5 * it).collect::<Vec<_>>()];
        assert!(likeliest_cause(&ways).contains("its SIGN is wrong"));
        assert!(likeliest_cause(&ways[..1]).contains("does not look like"));
        assert!(likeliest_cause(&[]).contains("does not look like"));
    }
}
