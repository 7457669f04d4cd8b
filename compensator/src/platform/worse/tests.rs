use super::*;
use crate::noise::Noise;

/// What a sound platform is permitted: micrometres for x and y, the angle at its edge.
const TOLERANCES: [f64; 3] = [2e-6, 2e-6, 1e-5];
const DIMENSIONS: [Dimension; 3] = [Dimension::Length, Dimension::Length, Dimension::Angle];
const X: usize = 0;
const Y: usize = 1;
const THETA: usize = 2;

/// How large something is, evenly over the decades from `low` to `high`.
fn decades(noise: &mut Noise, low: f64, high: f64) -> f64 {
    (low.ln() + (high.ln() - low.ln()) * noise.uniform()).exp()
}

fn poses(noise: &mut Noise) -> usize {
    6 + (35.0 * noise.uniform()) as usize
}

/// x, y and the angle of a platform with errors of 3 to 3000 times their tolerances, each its own, seen with noise of
/// `share` of them and from a zero that may be far off; `said` makes of the errors what is said of them.
fn drawn(seed: u64, share: f64, said: impl Fn(usize, [f64; 3]) -> f64) -> Vec<Part> {
    let noise = &mut Noise(seed.wrapping_mul(0x9E37_79B9).wrapping_add(41));
    let count = poses(noise);
    let like = decades(noise, 3.0, 3e3);
    let sizes = TOLERANCES.map(|it| it * like * decades(noise, 0.5, 2.0));
    let offsets = sizes.map(|it| it * 20.0 * (noise.uniform() - 0.5));
    let errors: Vec<[f64; 3]> = (0..count)
        .map(|_| sizes.map(|it| it * noise.normal()))
        .collect();
    let part = |part: usize| Part {
        dimension: DIMENSIONS[part],
        tolerance: TOLERANCES[part],
        said: errors.iter().map(|it| said(part, *it)).collect(),
        was: Vec::new(),
    };
    let mut parts: Vec<Part> = (0..3).map(part).collect();
    for error in &errors {
        for part in 0..3 {
            let seen = error[part] + share * sizes[part] * noise.normal() + offsets[part];
            parts[part].was.push(seen);
        }
    }
    parts
}

/// How many of many platforms of all sizes are told rightly, and how many wrongly.
fn count(
    share: f64,
    said: impl Fn(usize, [f64; 3]) -> f64 + Copy,
    is_it: impl Fn(&[Mistake]) -> bool,
) -> (usize, usize) {
    let told = (0..500).map(|seed| mistakes(&drawn(seed, share, said)));
    let (right, other): (Vec<_>, Vec<_>) = told.partition(|it| is_it(it));
    let wrong = other.iter().filter(|it| !it.is_empty()).count();
    (right.len(), wrong)
}

/// With a tenth of noise nearly every one is told, with a third of it the most; hardly any wrongly.
#[track_caller]
fn check(said: impl Fn(usize, [f64; 3]) -> f64 + Copy, is_it: impl Fn(&[Mistake]) -> bool + Copy) {
    let (right, wrong) = count(0.1, said, is_it);
    assert!(right >= 490 && wrong <= 5, "{right} right, {wrong} wrong");
    let (right, wrong) = count(0.3, said, is_it);
    assert!(right >= 300 && wrong <= 50, "{right} right, {wrong} wrong");
}

#[test]
fn a_wrong_sign_of_one_coordinate_is_told_by_its_name_whatever_the_others_are() {
    for wrong in [X, Y, THETA] {
        check(
            |part, error| {
                if part == wrong {
                    -error[part]
                } else {
                    error[part]
                }
            },
            |told| told.contains(&Mistake::Sign { part: wrong }),
        );
    }
    let all = |told: &[Mistake]| {
        told.len() == 3 && told.iter().all(|it| matches!(it, Mistake::Sign { .. }))
    };
    let (right, _) = count(0.1, |part, error| -error[part], all);
    assert!(right >= 480, "{right}");
}

#[test]
fn exchanged_axes_are_told_and_which_of_them_is_turned() {
    for turned in [[false, false], [true, false], [false, true], [true, true]] {
        let sign = |it: bool| if it { -1.0 } else { 1.0 };
        check(
            move |part, error| match part {
                // What was of x follows what is said of y, and the other way round.
                Y => sign(turned[0]) * error[X],
                X => sign(turned[1]) * error[Y],
                _ => error[part],
            },
            |told| {
                let parts = [X, Y];
                told.contains(&Mistake::Exchanged { parts, turned })
            },
        );
    }
}

#[test]
fn a_wrong_unit_is_told_for_all_coordinates_that_have_it() {
    let units = [
        (25.4, Unit::MillimetresForInches),
        (1.0 / 25.4, Unit::InchesForMillimetres),
        (1e3, Unit::MicrometresForMillimetres),
        (1e-3, Unit::MillimetresForMicrometres),
    ];
    for (times, wanted) in units {
        check(
            |part, error| {
                if part == THETA {
                    error[part]
                } else {
                    times * error[part]
                }
            },
            |told| {
                // With few poses one of both may not follow closely enough.
                let is_it = |it: &Mistake| match it {
                    Mistake::Scale { parts, unit, .. } => {
                        !parts.contains(&THETA) && *unit == Some(wanted)
                    }
                    Mistake::Sign { .. } | Mistake::Exchanged { .. } => false,
                };
                !told.is_empty() && told.iter().all(is_it)
            },
        );
    }
    let scaled = |told: &[Mistake]| {
        let is_it = |it: &Mistake| match it {
            Mistake::Scale {
                parts,
                unit: None,
                factor,
            } => *parts == [Y] && is_about(*factor, 4.0, 1.3),
            _ => false,
        };
        told.iter().any(is_it)
    };
    let (right, _) = count(
        0.1,
        |part, error| {
            if part == Y {
                error[part] / 4.0
            } else {
                error[part]
            }
        },
        scaled,
    );
    assert!(right >= 480, "{right}");
}

/// Of right calibrations and of those that have nothing to do with what was, of any size: fewer than one in a thousand
/// is taken for a mistake.
#[test]
fn noise_is_hardly_ever_taken_for_a_mistake() {
    const SETS: usize = 20_000;
    let noise = &mut Noise(77);
    let mut told = 0;
    for _ in 0..SETS {
        let count = POSES_MIN + (40.0 * noise.uniform()) as usize;
        let parts: Vec<Part> = (0..3)
            .map(|part| {
                let [said, was] = [(); 2].map(|()| decades(noise, 1e-2, 1e3) * TOLERANCES[part]);
                Part {
                    dimension: DIMENSIONS[part],
                    tolerance: TOLERANCES[part],
                    said: (0..count).map(|_| said * noise.normal()).collect(),
                    was: (0..count).map(|_| was * noise.normal()).collect(),
                }
            })
            .collect();
        told += usize::from(!mistakes(&parts).is_empty());
    }
    assert!(told * 1000 <= SETS, "{told} of {SETS}");
    let (_, wrong) = self::count(0.3, |part, error| error[part], |_| false);
    assert!(wrong <= 1, "{wrong} of 500 right ones");
}

#[test]
fn too_few_poses_and_figures_that_are_none_tell_nothing() {
    let part = |said: &[f64], was: &[f64]| Part {
        dimension: Dimension::Length,
        tolerance: 1e-6,
        said: said.to_vec(),
        was: was.to_vec(),
    };
    let few = [1e-4, -2e-4, 3e-4, 5e-5];
    let turned = few.map(|it| -it);
    assert_eq!(mistakes(&[part(&turned, &few)]), []);
    assert_eq!(mistakes(&[part(&[], &[])]), []);
    assert_eq!(mistakes(&[]), []);
    let nan = [1e-4, f64::NAN, 3e-4, 5e-5, 1e-5, 2e-5];
    assert_eq!(mistakes(&[part(&nan.map(|it| -it), &nan)]), []);
    assert_eq!(mistakes(&[part(&[0.0; 9], &[1e-3; 9])]), []);
}
