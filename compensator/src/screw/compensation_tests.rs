use proptest::prelude::*;

use super::super::rig::{Noise, Nut, Screw};
use super::super::{Harmonic, patent};
use super::*;

fn um(value: f64) -> Metres {
    Metres::from_um(value)
}

fn limits() -> Limits {
    Limits {
        size: um(50.0),
        slope: 0.05,
        extrapolation: Metres::from_mm(1.0),
        resolution: Metres(0.0),
    }
}

/// The model that belongs to a screw of the tests, known without doubt.
fn model_of(screw: &Screw) -> ScrewModel {
    let harmonic = |&(number, amplitude, phase): &(u32, f64, f64)| Harmonic {
        number,
        sine: um(amplitude * phase.cos()),
        cosine: um(amplitude * phase.sin()),
    };
    ScrewModel {
        offset: um(screw.offset_um),
        slope: screw.slope_um_per_mm * 1e-3,
        lost_motion: um(screw.play_um),
        lead: Some(Metres::from_mm(screw.lead_mm)),
        harmonics: screw.waves.iter().map(harmonic).collect(),
        first: Metres::from_mm(-5.0),
        last: Metres::from_mm(5.0),
        covariance: None,
        scatter: None,
    }
}

fn wavy() -> Screw {
    Screw::with_waves(&[(1, 1.5, 0.3), (2, 0.4, 2.0)])
}

fn made(screw: &Screw) -> ScrewCompensation {
    ScrewCompensation::new(model_of(screw), limits(), Rule::Engagement).unwrap()
}

/// The covariance of a model without harmonics, from standard uncertainties.
fn with_u(mut model: ScrewModel, u: [f64; 3]) -> ScrewModel {
    model.covariance = Some(
        (0..9)
            .map(|k| if k % 4 == 0 { u[k / 4] * u[k / 4] } else { 0.0 })
            .collect(),
    );
    model
}

fn forward_at(mm: f64) -> ScrewMemory {
    ScrewMemory {
        set_point: Metres::from_mm(mm),
        engagement: Engagement::Forward,
    }
}

#[track_caller]
fn check_um(seen: Metres, expected: f64) {
    assert!(
        (seen.um() - expected).abs() < 1e-6,
        "{} um, not {expected}",
        seen.um()
    );
}

/// The patent's golden numbers by its own rule, from a nut that leans forward at zero: a
/// forward move to +1600 µm and a reverse one to −1600 µm are made longer by 0.96 and 3.25 µm.
#[test]
fn the_patents_rule_makes_moves_longer_by_its_golden_numbers() {
    let golden = patent::PatentRule::of_errors(um(500.0), um(1500.0), um(2.02), um(2.62), um(2.29));
    let (slope, lost_motion) = golden.slope_and_lost_motion();
    let model = ScrewModel {
        slope,
        lost_motion,
        ..model_of(&Screw {
            offset_um: 0.0,
            ..Screw::PLAIN
        })
    };
    let c = ScrewCompensation::new(model, limits(), Rule::Patent).unwrap();
    let there = c.correct(um(1600.0), &forward_at(0.0)).unwrap();
    check_um(there.set_point, 1600.96);
    let back = c.correct(um(-1600.0), &forward_at(0.0)).unwrap();
    check_um(back.set_point, -1603.25);
    // Every reverse move gets all of it, also one that follows another.
    let further = c.correct(um(-1700.0), &back.after).unwrap();
    check_um(further.set_point, -1700.0 - 1.02 - 2.29);
    // And every forward move nothing, also one too short to bring the nut along.
    let short = c.correct(um(-1699.0), &further.after).unwrap();
    check_um(short.set_point, -1699.0 - 1.0194);
}

#[test]
fn lost_motion_is_taken_up_on_reversals_only() {
    let plain = Screw {
        offset_um: 0.0,
        slope_um_per_mm: 0.0,
        ..Screw::PLAIN
    };
    let c = made(&plain);
    let mut memory = forward_at(0.0);
    let mut check = |target: f64, set_point: f64, engagement: Engagement| {
        let correction = c.correct(um(target), &memory).unwrap();
        check_um(correction.set_point, set_point);
        check_um(correction.actual.0, target);
        check_um(correction.actual.1, target);
        assert_eq!(correction.after.engagement, engagement);
        memory = correction.after;
    };
    check(100.0, 100.0, Engagement::Forward);
    check(200.0, 200.0, Engagement::Forward);
    check(150.0, 150.0 - 2.3, Engagement::Reverse);
    check(50.0, 50.0 - 2.3, Engagement::Reverse);
    check(50.0, 50.0 - 2.3, Engagement::Reverse);
    check(50.1, 50.1, Engagement::Forward);
    check(50.0, 50.0 - 2.3, Engagement::Reverse);
}

#[test]
fn a_reversal_shorter_than_the_play_does_not_move_the_nut() {
    let plain = Screw {
        offset_um: 0.0,
        slope_um_per_mm: 0.0,
        ..Screw::PLAIN
    };
    let c = made(&plain);
    let back = c.expected(um(99.0), &forward_at(0.1));
    check_um(back.actual.0, 100.0);
    let Engagement::Between { least, most } = back.after.engagement else {
        panic!("{back:?}")
    };
    check_um(least, 1.0);
    check_um(most, 1.0);
    // What is left of the play is taken up by the next reverse travel: 1.3 of 2 µm.
    let on = c.expected(um(97.0), &back.after);
    check_um(on.actual.0, 99.3);
    assert_eq!(on.after.engagement, Engagement::Reverse);
    // From in between, a target ahead is reached forward after 1 µm without effect.
    let ahead = c.correct(um(105.0), &back.after).unwrap();
    check_um(ahead.set_point, 105.0);
    assert_eq!(ahead.after.engagement, Engagement::Forward);
    // The nut is at its target already: nothing moves.
    let there = c.correct(um(100.0), &back.after).unwrap();
    assert_eq!((there.approach, there.after), (None, back.after));
}

#[test]
fn targets_within_the_resolution_are_not_chased() {
    let mut coarse = limits();
    coarse.resolution = um(0.05);
    let c = ScrewCompensation::new(model_of(&wavy()), coarse, Rule::Engagement).unwrap();
    let first = c.correct(um(500.0), &forward_at(0.0)).unwrap();
    let second = c.correct(um(499.96), &first.after).unwrap();
    assert_eq!(second.after, first.after);
    let third = c.correct(um(499.94), &first.after).unwrap();
    assert_eq!(third.approach, Some(Approach::Reverse));
}

#[test]
fn an_unknown_engagement_is_taken_up_or_owned_up_to() {
    let u = [0.0, 0.0, 0.1e-6];
    let c = ScrewCompensation::new(
        with_u(model_of(&Screw::PLAIN), u),
        limits(),
        Rule::Engagement,
    )
    .unwrap();
    let memory = ScrewMemory::unknown_at(um(0.0));
    let (low, high) = c.nut_at(&memory);
    check_um(high - low, 2.3);
    // Beyond all doubt in either direction.
    for (target, engagement) in [(10.0, Engagement::Forward), (-10.0, Engagement::Reverse)] {
        let sure = c.correct(um(target), &memory).unwrap();
        check_um(sure.actual.0, target);
        assert_eq!(sure.after.engagement, engagement);
    }
    // Where the nut may be already: short by what is left in doubt, and saying so.
    let unsure = c.correct(um(0.3 + 0.7), &memory).unwrap();
    check_um(unsure.actual.0, 0.3);
    check_um(unsure.actual.1, 1.0);
    check_um(
        unsure.standard_uncertainty.unwrap(),
        0.1_f64.hypot(0.35 / 3.0_f64.sqrt()),
    );
    // A planned take-up leaves no doubt: beyond the play by three of its uncertainties.
    for towards in [Approach::Forward, Approach::Reverse] {
        let goal = c.take_up_move(&memory, towards).unwrap();
        let travel = goal.um() * (1.0 + 0.6e-3);
        assert!((travel * towards.sign() - 2.6).abs() < 0.01, "{travel}");
        let taken = c.expected(goal, &memory).after;
        assert_eq!(c.take_up_move(&taken, towards), None);
        let sure = c.correct(um(1.0), &taken).unwrap();
        check_um(sure.actual.0, 1.0);
        check_um(sure.actual.1, 1.0);
    }
}

#[test]
fn a_take_up_goes_only_as_far_as_the_play_is_still_open() {
    let plain = Screw {
        offset_um: 0.0,
        slope_um_per_mm: 0.0,
        ..Screw::PLAIN
    };
    let c = made(&plain);
    // 1.0 of 2.3 µm are taken up in reverse.
    let memory = c.expected(um(99.0), &forward_at(0.1)).after;
    check_um(
        c.take_up_move(&memory, Approach::Reverse).unwrap(),
        99.0 - 1.3,
    );
    check_um(
        c.take_up_move(&memory, Approach::Forward).unwrap(),
        99.0 + 1.0,
    );
    check_um(
        c.take_up_move(&forward_at(0.1), Approach::Reverse).unwrap(),
        100.0 - 2.3,
    );
    assert_eq!(c.take_up_move(&forward_at(0.1), Approach::Forward), None);
}

#[test]
fn memory_survives_power_off_only_where_the_screw_was_left() {
    let left = forward_at(2.0);
    assert_eq!(left.found_at(um(2000.1), um(0.5)), left);
    let moved = left.found_at(um(2001.0), um(0.5));
    assert_eq!(moved, ScrewMemory::unknown_at(um(2001.0)));
    let nan = left.found_at(Metres(f64::NAN), um(0.5));
    assert_eq!(nan.engagement, Engagement::Unknown);
}

#[test]
fn uncertainty_grows_outside_the_strokes_measured_and_in_doubt() {
    let u = [0.1e-6, 0.1e-3, 0.2e-6];
    let c = ScrewCompensation::new(
        with_u(model_of(&Screw::PLAIN), u),
        limits(),
        Rule::Engagement,
    )
    .unwrap();
    let at = |mm: f64, memory: &ScrewMemory| {
        let correction = c.correct(Metres::from_mm(mm), memory).unwrap();
        correction.standard_uncertainty.unwrap().um()
    };
    let forward = forward_at(-5.0);
    assert!((at(0.0, &forward) - 0.1).abs() < 1e-3);
    assert!((at(5.0, &forward) - 0.1_f64.hypot(0.5)).abs() < 1e-3);
    let reverse = forward_at(5.9);
    assert!((at(0.0, &reverse) - 0.1_f64.hypot(0.2)).abs() < 1e-3);
}

#[track_caller]
fn check_refused(change: impl Fn(&mut ScrewModel, &mut Limits), says: &str) {
    let (mut model, mut limits) = (model_of(&wavy()), limits());
    change(&mut model, &mut limits);
    let error = ScrewCompensation::new(model, limits, Rule::Engagement).unwrap_err();
    let message = error.to_string();
    assert!(message.contains(says), "{message}");
}

#[test]
fn what_cannot_be_undone_within_the_limits_is_refused_when_loaded() {
    check_refused(|_, l| l.size = um(8.0), "the limit is 8.000 um");
    check_refused(
        |_, l| l.slope = 5e-3,
        "changes by up to 7.8 um/mm, the limit is 5.0 um/mm",
    );
    check_refused(|m, _| m.harmonics[0].sine = um(400.0), "no unique inverse");
    check_refused(|m, _| m.slope = -1.0, "no unique inverse");
    check_refused(
        |m, _| m.lost_motion = um(-0.5),
        "Are the approaches swapped",
    );
    check_refused(|m, _| m.lead = None, "harmonics need a positive lead");
    check_refused(
        |m, _| m.harmonics[1].number = 1,
        "twice or has the number 0",
    );
    check_refused(
        |m, _| m.harmonics[1].number = 0,
        "twice or has the number 0",
    );
    check_refused(|m, _| m.slope = f64::NAN, "not finite");
    check_refused(|m, _| m.last = m.first, "do not form a range");
    check_refused(|m, _| m.covariance = Some(vec![0.0; 9]), "covariance");
    check_refused(|_, l| l.slope = 1.0, "limit Slope is 1");
    check_refused(|_, l| l.size = Metres(f64::NAN), "limit Size is NaN");
    check_refused(|_, l| l.extrapolation = um(-1.0), "limit Extrapolation");
}

#[test]
fn noise_may_make_a_lost_motion_of_none_slightly_negative() {
    let mut model = with_u(model_of(&Screw::PLAIN), [1e-8, 1e-6, 0.1e-6]);
    model.lost_motion = um(-0.2);
    let c = ScrewCompensation::new(model.clone(), limits(), Rule::Engagement).unwrap();
    assert_eq!(c.nut_at(&ScrewMemory::unknown_at(um(0.0))).0, um(0.3));
    model.lost_motion = um(-0.31);
    assert!(ScrewCompensation::new(model, limits(), Rule::Engagement).is_err());
}

#[test]
fn nothing_beyond_the_strokes_measured_is_corrected_silently() {
    let c = made(&wavy());
    assert!(c.correct(Metres::from_mm(6.0), &forward_at(0.0)).is_ok());
    let error = c
        .correct(Metres::from_mm(6.001), &forward_at(0.0))
        .unwrap_err();
    assert!(
        error.to_string().contains("6.001 mm is outside -6 to 6 mm"),
        "{error}"
    );
    assert!(c.correct(Metres(f64::NAN), &forward_at(0.0)).is_err());
}

/// Where the slope comes so near to 1 that Newton's steps wander.
#[test]
fn the_inverse_is_exact_up_to_the_last_slope_that_has_one() {
    let steep = Screw {
        waves: vec![(1, 317.0, 0.4)],
        slope_um_per_mm: 0.0,
        ..Screw::PLAIN
    };
    let wide = Limits {
        size: um(1e3),
        slope: 0.999,
        ..limits()
    };
    let c = ScrewCompensation::new(model_of(&steep), wide, Rule::Engagement).unwrap();
    assert!(c.steepest_slope() > 0.99);
    for k in -5000..=5000 {
        let target = um(f64::from(k));
        let set_point = Metres(c.command(target.value()));
        let error = c.pushed(set_point.value()) - target.value();
        assert!(error.abs() < 3e-18, "{error:e} at {k} um");
    }
}

fn screws() -> impl Strategy<Value = Screw> {
    (
        -2.0..2.0_f64,
        -5.0..5.0_f64,
        0.0..4.0_f64,
        prop::collection::vec((0.0..1.5_f64, -3.0..3.0_f64), 0..4),
    )
        .prop_map(|(offset_um, slope_um_per_mm, play_um, waves)| Screw {
            offset_um,
            slope_um_per_mm,
            play_um,
            lead_mm: 2.0,
            waves: (1..).zip(waves).map(|(n, (a, p))| (n, a, p)).collect(),
        })
}

fn engagements() -> impl Strategy<Value = Engagement> {
    prop_oneof![
        Just(Engagement::Unknown),
        Just(Engagement::Forward),
        Just(Engagement::Reverse),
        (0.0..4.0_f64, 0.0..4.0_f64).prop_map(|(a, b)| Engagement::Between {
            least: um(a.min(b)),
            most: um(a.max(b)),
        }),
    ]
}

proptest! {
    /// deviation ∘ correct = identity, to rounding, for every screw, target and known state.
    #[test]
    fn the_correction_is_the_exact_inverse(
        screw in screws(),
        start in -5.0..5.0_f64,
        targets in prop::collection::vec(-5.0..5.0_f64, 1..20),
    ) {
        let c = made(&screw);
        let mut memory = forward_at(start);
        for mm in targets {
            let target = Metres::from_mm(mm);
            let correction = c.correct(target, &memory).unwrap();
            let side = match correction.after.engagement {
                Engagement::Forward => Approach::Forward,
                Engagement::Reverse => Approach::Reverse,
                other => panic!("{other:?}"),
            };
            let set_point = correction.set_point;
            let actual = set_point + c.model().deviation(set_point, side);
            prop_assert!((actual - target).abs().value() < 1e-17);
            prop_assert!((correction.actual.0 - target).abs().value() < 1e-17);
            memory = correction.after;
        }
    }

    /// Against a nut pushed by flanks in small steps: it arrives where it should, move after
    /// move, short reversals included.
    #[test]
    fn a_real_nut_goes_where_it_is_told(
        screw in screws(),
        moves in prop::collection::vec((-4.0..4.0_f64, prop::bool::ANY), 1..20),
    ) {
        let c = made(&screw);
        let mut memory = forward_at(0.0);
        let mut nut = Nut { nut_mm: screw.flank_mm(0.0), screw };
        for (mm, small) in moves {
            let (low, _) = c.nut_at(&memory);
            let target = if small { low + um(mm) } else { Metres::from_mm(mm) };
            let correction = c.correct(target, &memory).unwrap();
            nut.turn(memory.set_point.mm(), correction.set_point.mm());
            prop_assert!((nut.nut_mm - target.mm()).abs() < 1e-9, "mm");
            memory = correction.after;
        }
    }

    /// Whatever is commanded, compensated or not, and wherever the nut was: it is within the
    /// bounds told, and in no more doubt than before.
    #[test]
    fn the_bounds_hold_for_a_nut_that_may_be_anywhere(
        screw in screws(),
        share in 0.0..=1.0_f64,
        moves in prop::collection::vec((-4.0..4.0_f64, 0..3_u8), 1..20),
    ) {
        let c = made(&screw);
        let mut memory = ScrewMemory::unknown_at(Metres::ZERO);
        let mut nut = Nut {
            nut_mm: screw.flank_mm(0.0) + share * 1e-3 * screw.play_um,
            screw,
        };
        let mut doubt = f64::INFINITY;
        for (mm, kind) in moves {
            let here = memory.set_point;
            let next = match kind {
                0 => c.expected(here + um(mm), &memory),
                1 => c.correct(c.nut_at(&memory).0 + um(mm), &memory).unwrap(),
                _ => c.expected(Metres::from_mm(mm), &memory),
            };
            nut.turn(here.mm(), next.set_point.mm());
            let (low, high) = next.actual;
            prop_assert!(nut.nut_mm > low.mm() - 1e-8 && nut.nut_mm < high.mm() + 1e-8);
            prop_assert!((high - low).value() <= doubt + 1e-12);
            doubt = (high - low).value();
            memory = next.after;
        }
    }

    /// One travel divided into parts has the same effect as the whole.
    #[test]
    fn the_play_does_not_care_how_a_travel_is_divided(
        width in 0.0..4.0_f64,
        engagement in engagements(),
        travel in -6.0..6.0_f64,
        share in 0.0..1.0_f64,
    ) {
        let play = Play(width * 1e-6);
        let whole = play.after(engagement, travel * 1e-6);
        let part = play.after(engagement, share * travel * 1e-6);
        let parts = play.after(part, (1.0 - share) * travel * 1e-6);
        let (a, b) = (play.gaps(whole), play.gaps(parts));
        prop_assert!((a.0 - b.0).abs() < 3e-12 && (a.1 - b.1).abs() < 3e-12);
    }

    /// Any travel of more than the play engages; any travel there and back by less than what is
    /// free leaves the nut alone.
    #[test]
    fn the_play_is_crossed_or_not(width in 0.1..4.0_f64, engagement in engagements()) {
        let play = Play(width * 1e-6);
        let over = width * 1.001e-6;
        prop_assert_eq!(play.after(engagement, over), Engagement::Forward);
        prop_assert_eq!(play.after(engagement, -over), Engagement::Reverse);
        let inside = play.after(play.after(Engagement::Forward, -0.9 * width * 1e-6), 0.5e-6 * width);
        let (least, most) = play.gaps(inside);
        prop_assert!((least - 0.4e-6 * width).abs() < 1e-15 && least == most);
    }
}

/// Seeds 0 to 9: a model fitted to noisy data keeps a real nut within the fit's noise, where an
/// uncompensated one is micrometres off and the patent's rule, on a screw with a periodic error,
/// somewhere between.
#[test]
fn a_fitted_screw_beats_the_patents_and_both_beat_none() {
    let mut worst = [0.0_f64; 3];
    for seed in 0..10 {
        let mut noise = Noise(seed);
        let screw = Screw {
            offset_um: 0.0,
            slope_um_per_mm: 0.6,
            ..Screw::with_waves(&[(1, 0.6, 0.0)])
        };
        let strokes: Vec<f64> = (0..23).map(|i| -5.0 + 0.45 * f64::from(i)).collect();
        let rows = screw.measured(&strokes, 10, 0.2, &mut noise);
        let options = super::super::FitOptions {
            lead: Some(Metres::from_mm(2.0)),
            ..Default::default()
        };
        let model = super::super::fit(&rows, &options).unwrap().model;
        let reverse: Vec<_> = rows
            .iter()
            .filter(|r| r.approach == Approach::Reverse)
            .copied()
            .collect();
        let patent = patent::estimate(&reverse).unwrap().model();
        let ways = [
            (model.clone(), Rule::Engagement, true),
            (patent, Rule::Patent, true),
            (model, Rule::Engagement, false),
        ];
        for (way, (model, rule, compensated)) in ways.into_iter().enumerate() {
            let c = ScrewCompensation::new(model, limits(), rule).unwrap();
            let mut memory = forward_at(0.0);
            let mut nut = Nut {
                nut_mm: 0.0,
                screw: screw.clone(),
            };
            for _ in 0..200 {
                let target = Metres::from_mm(noise.within(4.5));
                let next = if compensated {
                    c.correct(target, &memory).unwrap()
                } else {
                    c.expected(target, &memory)
                };
                nut.turn(memory.set_point.mm(), next.set_point.mm());
                worst[way] = worst[way].max((nut.nut_mm - target.mm()).abs() * 1e3);
                memory = next.after;
            }
        }
    }
    let [fitted, patent, none] = worst;
    assert!(fitted < 0.15, "{fitted} um");
    assert!(
        patent > 3.0 * fitted && none > 2.0 * patent,
        "{patent} {none} um"
    );
}
