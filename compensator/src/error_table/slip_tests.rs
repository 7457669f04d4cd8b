use super::*;
use crate::noise::Noise;

/// Half a wavelength of a helium-neon laser.
const COUNT: Metres = Metres(316.4e-9);

/// What is read at the datum between two runs, in reverse and forward.
const SHARED: usize = 2;

fn is_reverse(at: usize, size: usize) -> bool {
    at == 0 || at + 2 == size || (at >= size / 2 && at + 2 < size)
}

/// Of a run forward and in reverse between a datum read from both sides: the datum's readings, the first one
/// and the one in the middle come after a turn.
fn nm(changes: &[f64]) -> Vec<Change> {
    let size = changes.len();
    let is_after_turn = |at: usize| at < 3 || at + 2 >= size || at == size / 2;
    let change = |(at, nm): (usize, &f64)| Change {
        size: Metres(nm * 1e-9),
        approach: [Approach::Forward, Approach::Reverse][usize::from(is_reverse(at, size))],
        is_after_turn: is_after_turn(at),
    };
    changes.iter().enumerate().map(change).collect()
}

/// Changes of a stage that repeats to `sd` nanometres, `slipped` counts more in some readings.
fn changes(
    noise: &mut Noise,
    size: usize,
    sd: f64,
    shifted: &Range<usize>,
    slipped: f64,
) -> Vec<Change> {
    let scatter = sd * f64::sqrt(2.0);
    let change = |it: usize| {
        let is_shifted = shifted.contains(&it);
        let jump = if is_shifted { slipped * 316.4 } else { 0.0 };
        scatter * noise.normal() + jump
    };
    nm(&(0..size).map(change).collect::<Vec<_>>())
}

#[track_caller]
fn check(changes: &[f64], expected: Option<(usize, i64, bool)>) {
    let seen = find_slip(&nm(changes), SHARED, COUNT);
    let seen = seen.map(|it| (it.at, it.counts, it.is_in_the_earlier_run));
    assert_eq!(seen, expected);
}

#[test]
fn a_step_of_whole_counts_is_found_where_it_is() {
    let s = 316.4;
    let quiet = [5.0, -9.0, 12.0, 7.0, -2.0, 3.0, -4.0, 8.0, -6.0, 1.0];
    let with = |at: usize, jump: f64| -> Vec<f64> {
        let change = |(it, value): (usize, &f64)| value + if it < at { 0.0 } else { jump };
        quiet.iter().enumerate().map(change).collect()
    };
    check(&with(3, s), Some((3, 1, false)));
    check(&with(8, -2.0 * s), Some((8, -2, false)));
    check(&with(2, 5.0 * s), Some((2, 5, false)));
    check(&with(5, 0.5 * s), None);
    check(&with(11, s), None);
    // What the earlier run read too much goes away.
    let earlier: Vec<f64> = with(4, s).iter().map(|it| it - s).collect();
    check(&earlier, Some((4, -1, true)));
}

#[test]
fn what_drifts_bends_or_is_off_once_is_no_slip() {
    let mut noise = Noise(3);
    for trial in 0..200 {
        let size = 12 + trial % 40;
        let off = trial % size;
        let shapes: [&dyn Fn(usize, f64) -> f64; 5] = [
            &|_, x| 2000.0 * x,
            &|_, x| 3164.0 * x * x,
            &|_, x| 2000.0 * (-3.0 * x).exp(),
            &|it, _| if it == off { 3164.0 } else { 0.0 },
            &|it, _| 316.4 * f64::from(u8::from(is_reverse(it, size))),
        ];
        for (kind, shape) in shapes.iter().enumerate() {
            let change = |it: usize| shape(it, it as f64 / size as f64) + 10.0 * noise.normal();
            let changes: Vec<f64> = (0..size).map(change).collect();
            let seen = find_slip(&nm(&changes), SHARED, COUNT);
            assert_eq!(seen, None, "shape {kind}, {size} readings, {off}");
        }
    }
}

/// Of an emulated stage whose servo has a bandwidth of 15 to 20 Hz: it overshoots by some 20 um, and takes
/// up its lost motion of 1 um from the one side or the other.
#[test]
fn a_stage_that_overshoots_at_its_turns_has_not_lost_a_count() {
    let middle = |turn: f64| {
        let quiet = (0..40).map(|it| 40.0 * f64::sin(f64::from(it) * 2.4));
        let quiet = quiet.enumerate();
        quiet.map(move |(it, value)| if it == 19 { turn } else { value })
    };
    let with = |start: &[f64], turn: f64, end: &[f64]| -> Vec<f64> {
        let start = start.iter().copied();
        start.chain(middle(turn)).chain(end.to_vec()).collect()
    };
    check(&with(&[-386.0, -398.0, 8.0], 386.0, &[30.0, 367.0]), None);
    check(&with(&[318.0, 70.0, 26.0], 276.0, &[-334.0, -361.0]), None);
    check(&with(&[67.0, 321.0, 342.0], -274.0, &[36.0, -33.0]), None);
    check(&with(&[-350.0, -337.0, -50.0], -22.0, &[68.0, 281.0]), None);
    let slipped = with(&[-318.0, -310.0, 8.0], 38.0, &[36.0, 30.0]);
    check(&slipped, Some((2, -1, true)));
}

#[test]
fn too_few_readings_say_nothing() {
    check(&[], None);
    check(&[1.0, 0.0, 316.0, 315.0, 317.0], None);
    check(&[0.0; 20], None);
    check(&[f64::NAN; 20], None);
}

/// The rate beside the guard: of 30 000 comparisons of sound runs, noise may make one and a half.
#[test]
fn sound_runs_are_not_blamed_whatever_they_repeat_to() {
    let mut noise = Noise(11);
    let mut alarms = 0;
    for sd in [5.0, 30.0, 60.0, 100.0, 150.0, 300.0, 600.0, 1000.0] {
        for trial in 0..3750 {
            let size = [14, 24, 46, 86][trial % 4];
            let changes = changes(&mut noise, size, sd, &(0..size), 0.0);
            alarms += usize::from(find_slip(&changes, SHARED, COUNT).is_some());
        }
    }
    assert!(alarms <= 5, "{alarms} of 30 000");
}

/// The power beside the rate: one count, after any reading, in runs of 21 and of 11 targets both ways, those at the
/// datum between the runs included.
#[test]
fn one_count_is_found_at_a_repeatability_of_thirty_nanometres() {
    let mut noise = Noise(12);
    for (size, sd, trials, share) in [
        (46, 5.0, 4_000, 0.999),
        (46, 30.0, 10_000, 0.999),
        (26, 30.0, 10_000, 0.98),
        (46, 60.0, 4_000, 0.7),
    ] {
        let mut found = 0;
        for trial in 0..trials {
            let mut all = places(size, SHARED);
            let shifted = all.nth(trial % all.size_hint().0).unwrap();
            let readings = changes(&mut noise, size, sd, &shifted, 1.0);
            let seen = find_slip(&readings, SHARED, COUNT);
            // Noise may put it a reading beside.
            let is_found = |it: Slip| it.at.abs_diff(shifted.start) <= 2 && it.counts == 1;
            found += usize::from(seen.is_some_and(is_found));
        }
        let share_found = found as f64 / trials as f64;
        println!("{size} readings, {sd} nm: {share_found}");
        assert!(
            share_found >= share,
            "{size} readings, {sd} nm: {share_found}"
        );
    }
}

/// The count slips between both readings of the datum that end one run and begin the next.
#[test]
fn a_count_that_slips_between_two_runs_is_told_with_the_earlier_one() {
    let mut noise = Noise(13);
    let size = 20;
    for counts in [-3.0, -1.0, 1.0, 2.0] {
        let readings = changes(&mut noise, size, 20.0, &(1..size - 1), counts);
        let expected = Slip {
            at: 1,
            counts: counts as i64,
            is_in_the_earlier_run: true,
        };
        assert_eq!(find_slip(&readings, SHARED, COUNT), Some(expected));
        // Runs between which the datum was set anew share nothing.
        assert_eq!(find_slip(&readings, 0, COUNT), None);
    }
}
