use super::rig::{Measured, Rig};
use super::*;

/// Of lengths that are known to 1 ppm, on all lines alike.
fn stretched() -> Rig {
    Rig {
        in_common: 1e-6,
        ..Rig::default()
    }
}

/// `observations` where one error of the instrument is `by` of its standard uncertainties more.
fn off(observations: &[Observation], by: f64) -> Vec<Observation> {
    let each = observations.iter().map(|it| {
        let reading = match it.reading {
            Reading::Length {
                along,
                deviation,
                u,
            } => Reading::Length {
                along,
                deviation: deviation + Metres(by * it.common),
                u,
            },
            angle @ Reading::Angle { .. } => angle,
        };
        Observation { reading, ..*it }
    });
    each.collect()
}

fn largest_squareness(a: &Identified, b: &Identified) -> f64 {
    let each = |it: &Identified| {
        [
            it.squareness.y_to_x,
            it.squareness.z_to_x,
            it.squareness.z_to_y,
        ]
    };
    let pairs = each(a).into_iter().zip(each(b));
    pairs
        .map(|(a, b)| (a - b).value().abs())
        .fold(0.0, f64::max)
}

/// All lines longer by one and the same share: the volume is larger, and no squarer or less square.
#[test]
fn what_all_lengths_have_in_common_stretches_and_leans_nothing() {
    let Measured {
        plan, observations, ..
    } = stretched().measured(11);
    let usual = plan.identify(&observations).unwrap();
    let longer = plan.identify(&off(&observations, 1.0)).unwrap();
    assert!(largest_squareness(&usual, &longer) < 1e-10);
    let (before, after) = (usual.birge_ratio.unwrap(), longer.birge_ratio.unwrap());
    assert!((before - after).abs() < 1e-6, "{before}, {after}");
    let end = |it: &Identified| {
        let axes = it.axis_errors(Shape::Spline).unwrap();
        axes[0].along[0].as_ref().unwrap().at(Metres(0.5)).um()
    };
    assert!((end(&longer) - end(&usual) - 0.5).abs() < 1e-3);
}

/// As independent as the readings themselves it would make the squarenesses uncertain, and the lengths surer than they are.
#[test]
fn what_all_lengths_have_in_common_makes_the_size_uncertain_and_no_squareness() {
    let Measured {
        plan, observations, ..
    } = stretched().measured(12);
    let known = plan.identify(&observations).unwrap();
    let apart: Vec<_> = observations
        .iter()
        .map(|it| Observation { common: 0.0, ..*it })
        .collect();
    let apart = plan.identify(&apart).unwrap();
    let Measured {
        plan: same,
        observations,
        ..
    } = Rig::default().measured(12);
    let without = same.identify(&observations).unwrap();
    for k in 0..3 {
        let [known, apart, without] =
            [&known, &apart, &without].map(|it| it.squareness.u[k].value());
        assert!(
            known < 1.05 * without && known < 0.7 * apart,
            "{known} {apart} {without}"
        );
    }
    let corner = Point::from_mm(500.0, 400.0, 300.0);
    let u = |it: &Identified| {
        let u = it.standard_uncertainty(corner, super::rig::TOOL, &[]);
        u.unwrap().x.um()
    };
    let expected = u(&without).hypot(0.5);
    assert!(
        (u(&known) / expected - 1.0).abs() < 0.1,
        "{} um, not {expected}",
        u(&known)
    );
}

/// What a line's readings are off by where one error of its detector is `by` of its standard uncertainties, each a
/// tenth of what it read.
fn scaled(observations: &[Observation], run: usize, by: f64) -> Vec<Observation> {
    let each = observations.iter().map(|it| match it.reading {
        Reading::Length {
            along,
            deviation,
            u,
        } if it.run == run => {
            let scale = deviation * 0.1;
            let reading = Reading::Length {
                along,
                deviation: deviation + scale * by,
                u: Metres(units::portable::hypot(u.value(), scale.value())),
            };
            let common_of_run = scale.value();
            Observation {
                reading,
                common_of_run,
                ..*it
            }
        }
        _ => *it,
    });
    each.collect()
}

/// What a laser of its own stretches a line by, off by three times what is stated of it. Counted as independent from
/// reading to reading, that looks like readings that are wrong.
#[test]
fn what_the_detector_of_a_line_does_to_all_of_it_blames_no_reading() {
    let mut told = 0;
    for seed in 0..10 {
        let Measured {
            design,
            plan,
            observations,
            ..
        } = Rig::default().measured(seed);
        let purpose = Purpose::Positioning(Axis::X);
        let lines = &design.lines;
        let run = lines.iter().position(|it| it.purpose == purpose);
        let observations = scaled(&observations, run.unwrap(), 3.0);
        let found = plan.snoop(&observations).unwrap().found;
        assert!(found.is_empty(), "seed {seed}: {found:?}");
        let apart = observations.iter().map(|it| Observation {
            common_of_run: 0.0,
            ..*it
        });
        let apart: Vec<_> = apart.collect();
        told += usize::from(!plan.snoop(&apart).unwrap().found.is_empty());
    }
    assert!(told > 0, "none of ten: that is no test of it");
}
