use units::Celsius;

use super::tests::{Chance, OFFSET, machine, model, nodes, plan, um};
use super::*;
use crate::volumetric::function::Shape;
use crate::volumetric::model::{Seen, Thermal, ThermalBend, ThermalChannel, VolumetricModel};
use crate::volumetric::online::{DetectorLever, MovingState};

/// Cold, and two hours later: over and under the neutral plane.
const COLD: [f64; 2] = [20.4, 20.3];
const WARM: [f64; 2] = [22.6, 21.3];

/// 100 mm below x's slide, as where it works.
fn tool() -> Point {
    Point::from_mm(0.0, 0.0, -100.0)
}

fn channel(reference: f64, half: f64) -> ThermalChannel {
    ThermalChannel {
        reference: Celsius(reference),
        low: Celsius(15.0),
        high: Celsius(30.0),
        expansion: [half, 0.0, 0.0],
        u_expansion: [0.0; 3],
        growth: Point::ZERO,
        squareness: [Radians::ZERO; 3],
        u: 0.0,
    }
}

/// A machine whose x grows by 10 ppm/K and bows by 4 µm/K, as no detector sees it.
fn warm_machine(chain: &str, chance: &mut Chance) -> VolumetricModel {
    let mut machine = machine(chain, chance);
    machine.thermal = Thermal {
        channels: COLD.map(|cold| channel(cold, 5e-6)).to_vec(),
        bends: vec![ThermalBend {
            axis: Axis::X,
            towards: Axis::Z,
            over: 0,
            under: Some(1),
            bow: um(4.0),
            u: um(0.0),
            low: Metres(0.0),
            high: Metres(0.6),
            gradient_max: 5.0,
            is_watched: false,
        }],
        fixed: Point::ZERO,
    };
    model(machine)
}

fn at_warmth(model: &VolumetricModel, warmth: [f64; 2], tool: Point, at: Point) -> Point {
    let live = MovingState::default();
    let now = model.conditions(tool, &warmth.map(Celsius), &live).unwrap();
    model.deviation(at, &now).unwrap()
}

/// Along x: lengths under the tool, and pitch angles unless left out, at both warmths.
struct Session {
    runs: Vec<RunSetup>,
    shown: Vec<Vec<Celsius>>,
    observations: Vec<Observation>,
}

const ARCSEC: f64 = 4.848e-6;

impl Session {
    fn new(model: &VolumetricModel, warmths: &[[f64; 2]], chance: &mut Chance, noise: f64) -> Self {
        let mut session = Self {
            runs: Vec::new(),
            shown: Vec::new(),
            observations: Vec::new(),
        };
        for warmth in warmths {
            for is_angle in [false, true] {
                session.run(model, *warmth, is_angle, chance, noise);
            }
        }
        session
    }

    fn run(
        &mut self,
        model: &VolumetricModel,
        warmth: [f64; 2],
        is_angle: bool,
        chance: &mut Chance,
        noise: f64,
    ) {
        let run = self.runs.len();
        for x in nodes(Axis::X, 13) {
            // Nothing but the tool is on x's lever.
            let at = Point::new(x, Metres::ZERO, Metres::ZERO);
            // The turn about y is what x is further 200 mm up, per metre.
            let below = at_warmth(model, warmth, tool(), at);
            let above = at_warmth(model, warmth, Point::from_mm(0.0, 0.0, 100.0), at);
            let reading = if is_angle {
                let deviation = (above.x - below.x).value() / 0.2 + 3e-6;
                Reading::Angle {
                    about: Axis::Y,
                    deviation: Radians(deviation + noise * 0.1 * ARCSEC * chance.normal()),
                    u: Radians(0.1 * ARCSEC),
                }
            } else {
                Reading::Length {
                    along: [1.0, 0.0, 0.0],
                    deviation: below.x + um(5.0) + um(noise * 0.1 * chance.normal()),
                    u: um(0.1),
                }
            };
            self.observations.push(Observation {
                at,
                tool: tool(),
                run,
                reading,
                common: 0.0,
                common_of_run: 0.0,
            });
        }
        let shown = warmth.map(|it| Celsius(it + noise * 0.03 * chance.normal()));
        self.runs.push(OFFSET);
        self.shown.push(shown.to_vec());
    }

    fn plan(&self, chain: &str) -> Plan {
        let names = [
            ErrorName::Along(Axis::X, Axis::X),
            ErrorName::About(Axis::X, Axis::Y),
        ];
        Plan {
            squarenesses: vec![],
            thermal: ThermalPlan {
                references: COLD.map(Celsius).to_vec(),
                runs: self.shown.clone(),
                u: 0.03,
                expansions: vec![ExpansionPlan {
                    axis: Axis::X,
                    thermometers: vec![0, 1],
                }],
                bends: vec![BendPlan {
                    axis: Axis::X,
                    towards: Axis::Z,
                    over: 0,
                    under: Some(1),
                    low: Metres(0.0),
                    high: Metres(0.6),
                    sideways: false,
                    seen_from: None,
                }],
                fixed: Point::ZERO,
            },
            ..plan(chain, &names, 4, self.runs.clone())
        }
    }
}

#[test]
fn runs_cold_and_warm_tell_expansion_and_bending_with_the_errors_themselves() {
    for chain in ["FXYZ", "YXFZ"] {
        let mut chance = Chance(1);
        let truth = warm_machine(chain, &mut chance);
        let session = Session::new(&truth, &[COLD, WARM], &mut chance, 0.0);
        let found = session.plan(chain).identify(&session.observations).unwrap();
        let (expansion, bend) = (&found.expansions[0], &found.bends[0]);
        // The design is of first order: some nanometres and nanoradians.
        assert!(
            (expansion.per_kelvin * 1e6 - 10.0).abs() < 0.03,
            "{expansion:?}"
        );
        assert!((bend.bow.um() - 4.0).abs() < 0.01, "{bend:?}");
        let mut channels = COLD.map(|cold| channel(cold, 0.0));
        expansion.apply(&mut channels);
        for it in channels {
            assert!((it.expansion[0] * 2.0 - expansion.per_kelvin).abs() < 1e-18);
            assert!((it.u_expansion[0] * 2.0 - expansion.u).abs() < 1e-18);
        }
        let term = bend.thermal_bend(5.0, true);
        assert_eq!(
            (term.bow, term.under, term.is_watched),
            (bend.bow, Some(1), true)
        );
    }
}

/// Read cold and warm with noise: what the machine that works states of its tool, at every warmth, is what the fit does.
#[test]
fn a_machine_that_works_warm_states_what_errors_and_coefficients_are_uncertain_by_together() {
    let mut chance = Chance(8);
    let truth = warm_machine("FXYZ", &mut chance);
    let session = Session::new(&truth, &[COLD, WARM], &mut chance, 1.0);
    let found = session
        .plan("FXYZ")
        .identify(&session.observations)
        .unwrap();
    let mut machine = truth.machine().clone();
    (machine.axes, machine.squareness) = (Default::default(), Default::default());
    found.expansions[0].apply(&mut machine.thermal.channels);
    machine.thermal.bends = vec![found.bends[0].thermal_bend(5.0, true)];
    let places = [0.0, 0.2, 0.4, 0.6].map(Metres).to_vec();
    let known = found.covariance([
        places.clone(),
        vec![Metres(0.0), Metres(0.1)],
        vec![Metres(0.0), Metres(0.1)],
    ]);
    let model = model(machine).with_covariance(known);
    let middle: [f64; 2] = core::array::from_fn(|it| (COLD[it] + WARM[it]) / 2.0);
    let mut sums = Vec::new();
    for warmth in [COLD, middle, WARM] {
        let warmth = warmth.map(Celsius);
        let now = model
            .conditions(tool(), &warmth, &MovingState::default())
            .unwrap();
        let mut sum = 0.0;
        for x in &places {
            let at = Point::new(*x, Metres(0.0), Metres(0.0));
            let stated = model.standard_uncertainty(at, &now, &Seen::default());
            let expected = found.standard_uncertainty(at, tool(), &warmth).unwrap();
            let between = expected.distance().value();
            let stated = stated.unwrap().distance().value();
            assert!(
                (stated - between).abs() <= 1e-6 * between + 1e-15,
                "{stated:e} m, not {between:e} m"
            );
            sum += stated * stated;
        }
        sums.push(sum);
    }
    // Half-way both readings tell the tool; coefficients by themselves would make it less sure than cold.
    assert!(sums[1] < sums[0] && sums[1] < sums[2], "{sums:?}");
}

/// A detector 60 mm ahead of its slide's zero sees 32 urad of tilt as 1.9 um, which is taken off readings
/// along z.
#[test]
fn what_a_detector_saw_of_a_tilt_is_no_part_of_the_bend() {
    for chain in ["FXYZ", "YXFZ"] {
        let mut chance = Chance(6);
        let mut machine = warm_machine(chain, &mut chance).machine().clone();
        machine.displacement_max = um(10.0);
        let truth = model(machine);
        let mut session = Session::new(&truth, &[COLD, WARM], &mut chance, 0.0);
        let place = Point::from_mm(60.0, 15.0, 25.0);
        let lever = DetectorLever::new(
            Axis::X,
            place,
            &truth.machine().thermal.bends,
            &COLD.map(Celsius),
        );
        for warmth in [COLD, WARM] {
            let run = session.runs.len();
            for x in nodes(Axis::X, 13) {
                let at = Point::new(x, Metres::ZERO, Metres::ZERO);
                let tool = tool();
                let shown = warmth.map(Celsius);
                let mut live = MovingState::default();
                live.sideways[0] = lever.seen(x, Radians::ZERO, &shown).map(|it| -it);
                let now = truth.conditions(tool, &shown, &live).unwrap();
                let reading = Reading::Length {
                    along: [0.0, 0.0, 1.0],
                    deviation: truth.deviation(at, &now).unwrap().z,
                    u: um(0.1),
                };
                session.observations.push(Observation {
                    at,
                    tool,
                    run,
                    reading,
                    common: 0.0,
                    common_of_run: 0.0,
                });
            }
            session.runs.push(OFFSET);
            session.shown.push(warmth.map(Celsius).to_vec());
        }
        let found = |seen_from| {
            let mut plan = session.plan(chain);
            plan.functions.push(FunctionPlan {
                name: ErrorName::Along(Axis::X, Axis::Z),
                nodes: nodes(Axis::X, 4),
            });
            plan.thermal.bends[0].sideways = true;
            plan.thermal.bends[0].seen_from = seen_from;
            let found = plan.identify(&session.observations).unwrap();
            (found.bends[0].bow.um(), found.birge_ratio.unwrap())
        };
        let (bow, scatter) = found(Some(place));
        assert!((bow - 4.0).abs() < 0.02, "{chain}: {bow} um/K");
        assert!(scatter < 0.2, "{chain}: {scatter}");
        let (_, scatter) = found(None);
        assert!(scatter > 2.0, "{chain}: {scatter}");
    }
}

/// With noise as stated, thermometers' too: coefficients are off by their uncertainties, and so is
/// the tool in another warmth.
#[test]
fn uncertainties_of_thermal_coefficients_hold_what_thermometers_were_off() {
    let (mut expansions, mut bends, mut at_tool) = (0.0, 0.0, 0.0);
    const SEEDS: u32 = 60;
    let hot = [24.0, 21.5];
    for seed in 0..SEEDS {
        let mut chance = Chance(u64::from(seed) * 7919);
        let truth = warm_machine("FXYZ", &mut chance);
        let session = Session::new(&truth, &[COLD, WARM, COLD, WARM], &mut chance, 1.0);
        let found = session
            .plan("FXYZ")
            .identify(&session.observations)
            .unwrap();
        let (expansion, bend) = (&found.expansions[0], &found.bends[0]);
        expansions += ((expansion.per_kelvin - 10e-6) / expansion.u).powi(2);
        bends += ((bend.bow.value() - 4e-6) / bend.u.value()).powi(2);
        // 0.2 ppm of the thermometers' mean and of the lengths' noise each, 0.3 of the bend's part.
        assert!(
            expansion.u < 0.5e-6 && bend.u.um() < 0.2,
            "{expansion:?} {bend:?}"
        );
        // From one place to the other: where x is zero is taken up by the runs' zeros.
        let mut own = truth.machine().clone();
        let errors = found.axis_errors(Shape::Linear).unwrap();
        own.axes[0].along[0] = errors[0].along[0].clone();
        own.axes[0].about[1] = errors[0].about[1].clone();
        expansion.apply(&mut own.thermal.channels);
        own.thermal.bends = vec![bend.thermal_bend(5.0, false)];
        let own = model(own);
        let at = Point::from_mm(600.0, 0.0, 0.0);
        let off = |it: &VolumetricModel| at_warmth(it, hot, tool(), at).x;
        let u = found
            .standard_uncertainty(at, tool(), &hot.map(Celsius))
            .unwrap();
        at_tool += ((off(&own) - off(&truth)).value() / u.x.value()).powi(2);
    }
    for (name, squares) in [
        ("expansion", expansions),
        ("bow", bends),
        ("at the tool", at_tool),
    ] {
        // χ² with 60 degrees of freedom, from 0.5 ‰ to 99.95 %: 0.72 to 1.32 of its mean.
        let rms = f64::sqrt(squares / f64::from(SEEDS));
        assert!((0.72..1.32).contains(&rms), "{name}: {rms}");
    }
}

/// A lever of 100 mm on a pitch that changes evenly along x is a scale that grows.
#[test]
fn lengths_alone_do_not_tell_a_scale_that_grows_from_a_guide_that_bends() {
    let mut chance = Chance(3);
    let truth = warm_machine("FXYZ", &mut chance);
    let session = Session::new(&truth, &[COLD, WARM], &mut chance, 0.0);
    let mut plan = session.plan("FXYZ");
    plan.functions.truncate(1);
    let lengths = session.observations.iter().copied();
    let lengths: Vec<_> = lengths.filter(|it| it.run % 2 == 0).collect();
    plan.runs = vec![OFFSET; 4];
    let seen = plan.observability(&lengths).unwrap().to_string();
    assert!(
        seen.contains("expansion along x by thermometer 0")
            && seen.contains("bending of the guide of x along z"),
        "{seen}"
    );
    assert!(plan.identify(&lengths).is_err());
}

#[test]
fn runs_at_nearly_one_warmth_are_refused_with_how_near_they_are() {
    let mut chance = Chance(4);
    let truth = warm_machine("FXYZ", &mut chance);
    let mut little = COLD;
    little[0] += 0.2;
    let session = Session::new(&truth, &[COLD, little], &mut chance, 0.0);
    let mut plan = session.plan("FXYZ");
    let seen = plan.identify(&session.observations).unwrap_err();
    assert!(
        matches!(seen, IdentifyError::TooAlike { unknown: Unknown::Expansion(Axis::X, 0), spread, .. }
            if (spread - 0.1).abs() < 1e-9),
        "{seen:?}"
    );
    assert!(seen.to_string().contains("at least 0.30 K"), "{seen}");
    // The gradient differs by 0.2 K, which is enough for thermometers of 0.01 K.
    plan.thermal.expansions.clear();
    let seen = plan.identify(&session.observations).unwrap_err();
    let bend = Unknown::Bend(Axis::X, Axis::Z);
    assert!(matches!(seen, IdentifyError::TooAlike { unknown, .. } if unknown == bend));
    plan.thermal.u = 0.01;
    assert!(plan.identify(&session.observations).is_ok());
    // Where the errors are known before, one warm run is another warmth.
    plan.functions.clear();
    plan.thermal.u = 0.015;
    for (run, shown) in plan.thermal.runs.iter_mut().enumerate() {
        assert_eq!(shown.len(), 2, "run {run}");
        *shown = little.map(Celsius).to_vec();
    }
    assert!(plan.identify(&session.observations).is_ok());
}

#[test]
fn thermal_plans_that_do_not_fit_are_refused() {
    let mut chance = Chance(5);
    let truth = warm_machine("FXYZ", &mut chance);
    let session = Session::new(&truth, &[COLD, WARM], &mut chance, 0.0);
    let good = session.plan("FXYZ");
    let refused = |change: &dyn Fn(&mut ThermalPlan)| {
        let mut plan = good.clone();
        change(&mut plan.thermal);
        plan.identify(&session.observations)
            .unwrap_err()
            .to_string()
    };
    for (change, text) in [
        (
            (&|it: &mut ThermalPlan| drop(it.runs.pop())) as &dyn Fn(&mut ThermalPlan),
            "every run needs",
        ),
        (&|it| it.runs[1].truncate(1), "every run needs"),
        (&|it| it.runs[1][0] = Celsius(f64::NAN), "not a number"),
        (&|it| it.u = -0.1, "not a number"),
        (
            &|it| it.expansions[0].thermometers.clear(),
            "no thermometer",
        ),
        (&|it| it.expansions[0].thermometers.push(0), "used twice"),
        (&|it| it.bends[0].over = 2, "does not exist"),
        (&|it| it.bends[0].under = Some(0), "used twice"),
        (&|it| it.bends.push(it.bends[0]), "planned twice"),
        (&|it| it.bends[0].towards = Axis::X, "along its own axis"),
        (&|it| it.bends[0].high = Metres(0.0), "no length"),
    ] {
        let seen = refused(change);
        assert!(seen.contains(text), "{seen}");
    }
}
