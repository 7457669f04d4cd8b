//! How often estimates of screws hold what their uncertainties say, over screws of all sorts: an error of
//! their own at each stroke from none to three micrometres, periodic error likewise, 3 to 40 strokes, each made
//! 2 to 30 times from either side, noise of 0.03 to 1 µm. And how often a single stop ends within what is stated of
//! it, of screws that a camera sees.

use super::super::rig::{Noise, row};
use super::*;
use units::Approach;

const LEAD_MM: f64 = 2.0;

/// From so many strokes on the periodic error is looked for.
const PERIODIC_FROM: usize = 9;

/// Below so many degrees of freedom the mean square of Student's t says nothing: it has no variance, and for one
/// or two no mean.
const MEAN_SQUARE_FROM: usize = 5;

struct Sort {
    slope: f64,
    play_um: f64,
    /// Standard deviation of the screw's own error at a stroke, µm: of both sides, and of each.
    rough_um: f64,
    sides_um: f64,
    noise_um: f64,
    repeats: usize,
    strokes_mm: Vec<f64>,
    /// Number, amplitude and phase.
    wave: (u32, f64, f64),
}

impl Sort {
    fn drawn(chance: &mut Noise) -> Self {
        let count = 3 + (chance.uniform() * 38.0) as usize;
        let step = (3.0 + chance.uniform() * 17.0) / (count as f64 - 1.0);
        let place = |i: usize, jitter: f64| (step * (i as f64 + jitter) * 1e3).round() * 1e-3;
        let strokes_mm = (0..count).map(|i| place(i, chance.within(0.4))).collect();
        let has_wave = chance.uniform() < 0.5;
        let number = 1 + (chance.uniform() * 3.0) as u32;
        let amplitude = if has_wave {
            3.0 * chance.uniform()
        } else {
            0.0
        };
        Self {
            slope: chance.within(1e-3),
            play_um: 3.0 * chance.uniform(),
            rough_um: (3.5 * chance.uniform() - 0.5).max(0.0),
            sides_um: 0.0,
            noise_um: 0.03 * (33.0_f64).powf(chance.uniform()),
            repeats: 2 + (chance.uniform() * 29.0) as usize,
            strokes_mm,
            wave: (number, amplitude, chance.within(core::f64::consts::PI)),
        }
    }

    fn is_periodic(&self) -> bool {
        self.strokes_mm.len() >= PERIODIC_FROM
    }

    fn measured(&self, chance: &mut Noise) -> Vec<Stroke> {
        let mut rows = Vec::new();
        let (number, amplitude, phase) = self.wave;
        for &mm in &self.strokes_mm {
            let turn = core::f64::consts::TAU * f64::from(number) * mm / LEAD_MM;
            let own = self.rough_um * chance.normal() + amplitude * (turn + phase).sin();
            for (approach, play) in [(Approach::Forward, 0.0), (Approach::Reverse, self.play_um)] {
                let own = own + self.sides_um * chance.normal();
                for _ in 0..self.repeats {
                    let um = self.slope * mm * 1e3 + play + own + self.noise_um * chance.normal();
                    rows.push(row(approach, mm * 1e3, um));
                }
            }
        }
        rows
    }

    fn options(&self) -> FitOptions {
        FitOptions {
            lead: self.is_periodic().then_some(Metres::from_mm(LEAD_MM)),
            ..FitOptions::default()
        }
    }
}

#[derive(Default)]
struct Ratios(Vec<f64>, Vec<f64>);

impl Ratios {
    fn take(&mut self, error: f64, u: f64, freedom: usize) {
        self.0.push(error / u);
        if freedom >= MEAN_SQUARE_FROM {
            self.1.push(error / u);
        }
    }

    fn within_twice(&self) -> f64 {
        let within = self.0.iter().filter(|it| it.abs() <= 2.0).count();
        within as f64 / self.0.len() as f64
    }

    fn mean_square(&self) -> f64 {
        self.1.iter().map(|it| it * it).sum::<f64>() / self.1.len() as f64
    }
}

#[derive(Default)]
struct Counted {
    slope: Ratios,
    lost_motion: Ratios,
    amplitude: Ratios,
    asked_without: usize,
    invented: usize,
}

impl Counted {
    fn ratios(&self) -> [(&'static str, &Ratios); 3] {
        [
            ("slope", &self.slope),
            ("lost motion", &self.lost_motion),
            ("amplitude", &self.amplitude),
        ]
    }

    fn take(&mut self, sort: &Sort, fitted: &Fitted) {
        let model = &fitted.model;
        let freedom = fitted.degrees_of_freedom;
        let u = model.u_slope().unwrap();
        self.slope.take(model.slope - sort.slope, u, freedom);
        let u = model.u_lost_motion().unwrap().um();
        self.lost_motion
            .take(model.lost_motion.um() - sort.play_um, u, freedom);
        let (number, amplitude, _) = sort.wave;
        if sort.is_periodic() && amplitude == 0.0 {
            self.asked_without += 1;
            self.invented += usize::from(!model.harmonics.is_empty());
        }
        for (index, it) in model.harmonics.iter().enumerate() {
            if it.number == number && amplitude > 0.0 {
                let u = model.u_harmonic(index).unwrap()[2].um();
                self.amplitude
                    .take(it.amplitude().um() - amplitude, u, freedom);
            }
        }
    }
}

fn count(seeds: core::ops::Range<u64>, change: impl Fn(&mut Sort)) -> Counted {
    let mut counted = Counted::default();
    for seed in seeds {
        let mut chance = Noise(seed.wrapping_mul(0x9E37_79B9));
        let mut sort = Sort::drawn(&mut chance);
        change(&mut sort);
        let rows = sort.measured(&mut chance);
        counted.take(&sort, &fit(&rows, &sort.options()).unwrap());
    }
    for (what, it) in counted.ratios() {
        println!(
            "{what:<12} {:5} within 2u {:.3}; of {:5} mean square {:.2}",
            it.0.len(),
            it.within_twice(),
            it.1.len(),
            it.mean_square()
        );
    }
    println!(
        "invented harmonics: {} of {} screws without",
        counted.invented, counted.asked_without
    );
    counted
}

/// Three standard deviations of a share of `count`.
fn give(share: f64, count: usize) -> f64 {
    3.0 * (share * (1.0 - share) / count as f64).sqrt()
}

/// Between the rates wanted, give or take what so many cases permit.
#[track_caller]
fn check_rates(counted: &Counted, what: &str) {
    let it = counted
        .ratios()
        .into_iter()
        .find(|it| it.0 == what)
        .unwrap()
        .1;
    check_share(it, what, it.0.len());
    // Student's t² with five degrees of freedom has a standard deviation of 4.7, widened as it is of 2.7; most
    // have more.
    check_square(it, what, 3.0 * 2.0 / (it.1.len() as f64).sqrt());
}

#[track_caller]
fn check_share(it: &Ratios, what: &str, independent: usize) {
    let share = it.within_twice();
    let (least, most) = (
        0.93 - give(0.93, independent),
        0.975 + give(0.975, independent),
    );
    assert!(
        (least..=most).contains(&share),
        "{what}: {share} within 2u, of {independent}"
    );
}

#[track_caller]
fn check_square(it: &Ratios, what: &str, give: f64) {
    let square = it.mean_square();
    assert!(
        (0.9 - give..=1.15 + give).contains(&square),
        "{what}: mean square {square}"
    );
}

fn check(counted: &Counted) {
    for what in ["slope", "lost motion", "amplitude"] {
        check_rates(counted, what);
    }
    let (found, of) = (counted.invented as f64, counted.asked_without as f64);
    assert!(
        found <= 0.01 * of + 3.0 * (0.01 * of).sqrt(),
        "{found} invented in {of}"
    );
}

/// The fixed part of the count below.
#[test]
fn screws_of_all_sorts_are_as_sure_as_they_say() {
    check(&count(0..600, |_| ()));
}

#[test]
fn three_strokes_do_not_promise_more_than_they_can_tell() {
    let counted = count(0..400, |it| {
        it.strokes_mm = vec![0.5, 1.0, 1.5];
        it.wave.1 = 0.0;
    });
    for (what, it) in &counted.ratios()[..2] {
        let share = it.within_twice();
        assert!(share >= 0.93 - give(0.93, 400), "{what}: {share} within 2u");
    }
}

#[test]
#[ignore = "half a minute in the debug profile: docs/reliability.md has the command"]
fn screws_counted_over_many() {
    type Change = fn(&mut Sort);
    let sorts: [(&str, Change); 5] = [
        ("all sorts", |_| ()),
        ("no error of its own", |it| it.rough_um = 0.0),
        ("3 µm at each stroke", |it| it.rough_um = 3.0),
        ("0.5 µm at each side of a stroke", |it| it.sides_um = 0.5),
        ("the patent's three strokes", |it| {
            it.strokes_mm = vec![0.5, 1.0, 1.5]
        }),
    ];
    for (at, (name, change)) in sorts.into_iter().enumerate() {
        println!("--- {name}");
        let counted = count(100_000..104_000, change);
        if at == 0 {
            check(&counted);
        }
    }
}

/// A screw as a platform's calibration measures it: 21 strokes, twice from either side, from a zero that the camera
/// has seen eight times as often. Standard deviations in µm.
#[derive(Clone, Copy)]
struct Watched {
    /// Of a single stop.
    stop_um: f64,
    /// The screw's own error at a stroke.
    rough_um: f64,
    /// Whether neighbouring strokes share it: it walks by so much each half millimetre.
    walks: bool,
    /// Of what is seen of a stroke.
    camera_um: f64,
}

/// At so many places a single stop is judged.
const STOPS: usize = 8;

impl Watched {
    const SLOPE_UM_PER_MM: f64 = 0.8;
    const PLAY_UM: f64 = 2.0;
    const LOOKS: f64 = 8.0;

    /// Where it truly stops.
    fn stop_um(&self, mm: f64, approach: Approach, own_um: f64, chance: &mut Noise) -> f64 {
        let play = match approach {
            Approach::Forward => 0.0,
            Approach::Reverse => Self::PLAY_UM,
        };
        Self::SLOPE_UM_PER_MM * mm + play + own_um + self.stop_um * chance.normal()
    }

    /// The screw's own errors, µm by millimetres.
    fn own(&self, chance: &mut Noise) -> impl Fn(f64, &mut Noise) -> f64 + use<> {
        let Self {
            rough_um, walks, ..
        } = *self;
        let mut at = 0.0;
        let knots: Vec<f64> = (0..=12)
            .map(|_| {
                at += rough_um * chance.normal();
                at
            })
            .collect();
        move |mm, chance| {
            let place = 2.0 * (mm + 3.0);
            let (left, share) = (place as usize, place.fract());
            if walks {
                knots[left] + share * (knots[left + 1] - knots[left])
            } else {
                rough_um * chance.normal()
            }
        }
    }

    fn fitted(&self, own: impl Fn(f64, &mut Noise) -> f64, chance: &mut Noise) -> Fitted {
        let datum = self.camera_um / Self::LOOKS.sqrt();
        let off = datum * chance.normal();
        let mut rows = Vec::new();
        for at in -10..=10 {
            let mm = 0.25 * f64::from(at);
            let own = own(mm, chance);
            for approach in [Approach::Forward, Approach::Reverse] {
                for _ in 0..2 {
                    let um = self.stop_um(mm, approach, own, chance);
                    let seen = um + self.camera_um * chance.normal() - off;
                    rows.push(row(approach, mm * 1e3, seen));
                }
            }
        }
        let options = FitOptions {
            lead: Some(Metres::from_mm(LEAD_MM)),
            reading: Some(Metres::from_um(self.camera_um)),
            origin: Some(Metres::from_um(datum)),
            ..FitOptions::default()
        };
        fit(&rows, &options).unwrap()
    }

    /// Single stops of so many screws, at places where none was calibrated.
    fn judged(&self, seeds: core::ops::Range<u64>) -> Ratios {
        let mut ratios = Ratios::default();
        for seed in seeds {
            let mut chance = Noise(seed.wrapping_mul(0x9E37_79B9));
            let own = self.own(&mut chance);
            let fitted = self.fitted(&own, &mut chance);
            let model = &fitted.model;
            let scatter = model.scatter.unwrap().um();
            for at in 0..STOPS {
                let mm = chance.within(2.4);
                let approach = [Approach::Forward, Approach::Reverse][at % 2];
                let own = own(mm, &mut chance);
                let is = self.stop_um(mm, approach, own, &mut chance);
                let told = model.predict(Metres::from_mm(mm), approach);
                let u = told.standard_uncertainty.unwrap().um().hypot(scatter);
                ratios.take(is - told.deviation.um(), u, fitted.degrees_of_freedom);
            }
        }
        ratios
    }
}

/// What scatters as much as one micrometre of another, and how it is called.
fn watched() -> impl Iterator<Item = (String, Watched)> {
    let each = [0.0, 0.5, 1.0, 2.0, 3.0, 4.0];
    each.into_iter().flat_map(|camera| {
        [(0.0, false), (0.5, false), (1.0, false), (0.5, true)].map(|(rough, walks): (f64, _)| {
            let it = Watched {
                stop_um: 0.1 * (1.0 - rough * rough).sqrt(),
                rough_um: 0.1 * rough,
                camera_um: 0.1 * camera,
                walks,
            };
            let how = if walks { "walks by" } else { "own" };
            (format!("camera {camera}, {how} {rough}"), it)
        })
    })
}

fn count_stops(seeds: &core::ops::Range<u64>) {
    for (what, it) in watched() {
        let ratios = it.judged(seeds.clone());
        let (share, square) = (ratios.within_twice(), ratios.mean_square());
        println!("{what:<24} within 2u {share:.3}, mean square {square:.3}");
        // A model has three parameters and more, which are wrong at all places alike.
        let independent = ratios.0.len() / 2;
        check_share(&ratios, &what, independent);
        check_square(&ratios, &what, 3.0 * (2.0 / independent as f64).sqrt());
    }
}

/// The fixed part of the count below.
#[test]
fn single_stops_end_where_they_are_said_to_whatever_sees_them() {
    count_stops(&(0..60));
}

#[test]
#[ignore = "a minute: docs/reliability.md has the command"]
fn stops_counted_over_many() {
    count_stops(&(200_000..204_000));
}
