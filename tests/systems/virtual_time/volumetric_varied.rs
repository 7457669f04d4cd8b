//! How often the tool of three axes lies within what is stated of it, on machines of all sorts: how large the errors of
//! their guides are, how they warm up, how much their beams shift and their detectors scatter, where their slides come to
//! rest and how far apart the nodes of their tables are is drawn.
//!
//! `SEEDS=1..200 cargo test -p tests --test systems coverage_of_varied_volumes -- --ignored --nocapture`.

use tests::volume::Volume;
use tests::{Edit, random, seeds};

use super::volumetric_day::{
    BEAM_REFERENCES_UM, BEAMS_UM, EXACT, count_days, day_in, days_of, exact, frame_of,
    laser_as_stated, read_of, rolls_as_stated,
};
use super::volumetric_rolls::emulated_three_rolls;

/// At so many places in each hour.
const PLACES: usize = 4;

/// What is drawn of a machine.
#[derive(Clone, Copy, Debug)]
struct Drawn {
    /// How large errors and what warmth does are, as multiples of the shipped machine's.
    errors: f64,
    warmth: f64,
    /// How much the sources of the beams shift, likewise; the uncertainty that is stated of beams with it.
    beams: f64,
    noise_mv: f64,
    rest_error_nm: f64,
    step_mm: f64,
}

impl Drawn {
    fn new(seed: u64) -> Self {
        let mut state = seed ^ 0x7A21_ED00;
        let mut over = |low: f64, high: f64| low * (high / low).powf(random(&mut state));
        // Larger errors are refused by limits of the shipped machine's user, less warmth as it tells nothing of what it
        // does, and slides that stand less still never stand within their window.
        let (errors, warmth, beams) = (over(0.2, 1.8), over(0.6, 2.0), over(0.5, 3.0));
        let (noise_mv, rest_error_nm) = (over(0.03, 0.3), over(2.0, 15.0));
        let step_mm = [25.0, 50.0, 100.0][(3.0 * random(&mut state)) as usize];
        Self {
            errors,
            warmth,
            beams,
            noise_mv,
            rest_error_nm,
            step_mm,
        }
    }

    fn emulated(&self, text: &str) -> String {
        let of = |text: String, key: &str, shipped: f64, now: f64| {
            text.edit(
                &format!("\n{key} = {shipped:?}"),
                &format!("\n{key} = {now:?}"),
            )
        };
        let scaled = [
            ("positioning_um", 20.0, self.errors),
            ("straightness_um", 8.0, self.errors),
            ("roll_arcsec", 5.0, self.errors),
            ("pitch_and_yaw_arcsec", 10.0, self.errors),
            ("squareness_arcsec", 30.0, self.errors),
            ("scale_warming_k", 2.5, self.warmth),
            ("gradient_k", 1.2, self.warmth),
            ("film_um", 7.0, self.warmth),
            ("film_roll_arcsec", 2.0, self.warmth),
            ("translation_um", 0.2, self.beams),
        ];
        let text = scaled
            .into_iter()
            .fold(text.to_owned(), |text, (key, shipped, factor)| {
                of(text, key, shipped, shipped * factor)
            });
        let text = of(text, "noise_mv", 0.1, self.noise_mv);
        of(text, "rest_error_nm", 5.0, self.rest_error_nm)
    }

    /// Of what beams are off by, this is not of their sources and stays: air, and the width of the spot, micrometres.
    const AIR_AND_SPOT_UM: f64 = 0.03;

    fn machine(&self, text: &str) -> String {
        let sources = (BEAMS_UM.powi(2) - Self::AIR_AND_SPOT_UM.powi(2)).sqrt() * self.beams;
        let beams = sources.hypot(Self::AIR_AND_SPOT_UM);
        let references = BEAM_REFERENCES_UM * self.beams;
        text.edit(
            &format!("\nstandard_uncertainty_um = {BEAMS_UM}"),
            &format!("\nstandard_uncertainty_um = {beams}"),
        )
        .edit(
            &format!("reference_standard_uncertainty_um = {BEAM_REFERENCES_UM}"),
            &format!("reference_standard_uncertainty_um = {references}"),
        )
        .edit(
            "[volumetric.calibrate]\ninstrument = \"laser\"\nstep_mm = 50.0",
            &format!(
                "[volumetric.calibrate]\ninstrument = \"laser\"\nstep_mm = {:?}",
                self.step_mm
            ),
        )
    }
}

fn as_stated(seed: u64) -> Volume {
    let drawn = Drawn::new(seed);
    let rolls = |text: &str| drawn.emulated(&rolls_as_stated(text, seed));
    let (laser, dead_path_mm) = laser_as_stated(seed);
    let machine = |text: &str| drawn.machine(text);
    read_of(seed, (&laser, dead_path_mm), &machine, &rolls)
}

fn read_exactly(seed: u64) -> Volume {
    let drawn = Drawn::new(seed);
    // No matter how much their sources would shift: they do not.
    let still = Drawn {
        beams: 1.0,
        ..drawn
    };
    let detectors = |text: &str| exact(&still.emulated(&emulated_three_rolls(text)));
    let machine = |text: &str| drawn.machine(text);
    read_of(seed, EXACT, &machine, &detectors)
}

#[test]
#[ignore = "many machines: for whoever wants the rates, over SEEDS=FIRST..LAST"]
fn coverage_of_varied_volumes() {
    let days = days_of(seeds("1..200"), &|seed| {
        eprintln!("seed {seed}: {:?}", Drawn::new(seed));
        let frame = frame_of(|| read_exactly(seed));
        day_in(Some(frame), || as_stated(seed), seed, PLACES)
    });
    count_days(&days);
}
