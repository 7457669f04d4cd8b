//! The laser and its optics against numbers worked by hand.

use core::time::Duration;

use units::{Metres, Radians, Time};

use super::config::{LaserConfig, VolumetricConfig};
use super::tests::{hours, move_to, perfect, point, truth};
use super::{LineOptics, LineSetUp};
use crate::plant::config::{ClimateConfig, InterferometerConfig, PlantConfig};
use crate::plant::{Beam, Plant};

/// NIST Engineering Metrology Toolbox, Ciddor's equation at 633 nm: 20 °C, 101 325 Pa, 50 %.
const INDEX: f64 = 1.000_271_373;
const WAVELENGTH_M: f64 = 632.991_372e-9;

const ALONG_X: [f64; 3] = [1.0, 0.0, 0.0];

/// A machine in still air without noise, and what its laser reads.
struct Stand {
    plant: Plant,
    now: Time,
}

/// A hand that never errs.
fn exact() -> LaserConfig {
    LaserConfig {
        misalignment_urad: 0.0,
        straightedge_slope_urad: 0.0,
        ..LaserConfig::default()
    }
}

/// x bent upwards by 15 µm: its slide pitches from −1.2e-4 to 1.2e-4, 4 · 15 µm / 500 mm.
fn bowed() -> VolumetricConfig {
    let mut config = still();
    config.errors.deliberate_bow_um = 15.0;
    config
}

fn still() -> VolumetricConfig {
    let mut config = perfect();
    config.slide.rest_error_nm = 0.0;
    config.laser = exact();
    config
}

impl Stand {
    /// Standing at `at_mm`.
    fn new(volumetric: VolumetricConfig, at_mm: [f64; 3]) -> Self {
        let config = PlantConfig {
            volumetric: Some(volumetric),
            climate: ClimateConfig {
                pressure_hpa: 1013.25,
                pressure_swing_hpa: 0.0,
                humidity_percent: 50.0,
                humidity_swing_percent: 0.0,
                ..ClimateConfig::default()
            },
            interferometer: InterferometerConfig {
                noise_nm: 0.0,
                ..InterferometerConfig::default()
            },
            ..PlantConfig::default()
        };
        let mut stand = Self {
            plant: Plant::new(&config, 1),
            now: Time::ZERO,
        };
        stand.go(at_mm);
        stand
    }

    fn go(&mut self, to_mm: [f64; 3]) {
        self.now = move_to(&mut self.plant, self.now, to_mm);
    }

    fn wait(&mut self, span: Duration) {
        self.now += span;
        self.plant.advance(self.now);
    }

    /// Set up, and the hands are gone.
    fn set_up(&mut self, optics: LineOptics, along: [f64; 3], offset_mm: [f64; 3]) {
        self.plant.set_up_line(&LineSetUp {
            optics,
            along,
            tool_offset: point(offset_mm),
        });
        self.wait(Duration::from_millis(400));
    }

    /// What the counter sees, as one-way path in micrometres.
    fn path_um(&mut self) -> f64 {
        let fringes = self.plant.fringes();
        assert_eq!(fringes.beam, Beam::Good);
        fringes.half_wavelengths * WAVELENGTH_M / 2.0 / INDEX * 1e6
    }

    /// By how much it changes on a way.
    fn change_um(&mut self, to_mm: [f64; 3]) -> f64 {
        let before = self.path_um();
        self.go(to_mm);
        self.path_um() - before
    }

    fn scale_um(&self, axis: usize) -> f64 {
        truth(&self.plant).scales()[axis].um()
    }
}

#[track_caller]
fn near(seen: f64, expected: f64, within: f64) {
    assert!((seen - expected).abs() < within, "{seen} is not {expected}");
}

/// A tool 100 mm under the slide goes back with the pitch: from +12 µm to −12 µm.
#[test]
fn linear_optics_see_the_tool_go_along_the_line() {
    let mut stand = Stand::new(bowed(), [0.0; 3]);
    stand.set_up(LineOptics::Linear, ALONG_X, [0.0, 0.0, -100.0]);
    let from_um = stand.scale_um(0);
    let seen = stand.change_um([500.0, 0.0, 0.0]);
    near(seen, stand.scale_um(0) - from_um - 24.0, 0.02);
    // At the height of the guide the pitch moves nothing.
    let mut stand = Stand::new(bowed(), [0.0; 3]);
    stand.set_up(LineOptics::Linear, ALONG_X, [0.0; 3]);
    let from_um = stand.scale_um(0);
    let seen = stand.change_um([500.0, 0.0, 0.0]);
    near(seen, stand.scale_um(0) - from_um, 0.02);
}

/// 300 mm and 400 mm make 500 mm, which y's lean c shortens by 240 mm · c.
#[test]
fn a_face_diagonal_sees_the_squareness() {
    let mut config = still();
    config.errors.squareness_arcsec = 15.0;
    let mut stand = Stand::new(config, [0.0; 3]);
    stand.set_up(LineOptics::Linear, [3.0, 4.0, 0.0], [0.0; 3]);
    let from = [0, 1].map(|axis| stand.scale_um(axis));
    let seen = stand.change_um([300.0, 400.0, 0.0]);
    let [x, y] = [0, 1].map(|axis| stand.scale_um(axis) - from[axis]);
    let lean = truth(&stand.plant).squareness()[0].value();
    assert!(lean.abs() > 3e-5, "{lean}");
    near(seen, 0.6 * x + 0.8 * y - 240e3 * lean, 0.02);
}

/// A beam that leans by ε sees cos ε of the way.
#[test]
fn a_beam_that_was_set_up_badly_sees_less_of_the_way() {
    let mut config = still();
    config.laser.misalignment_urad = 2500.0;
    let mut shortest = 0.0_f64;
    for _ in 0..5 {
        let mut stand = Stand::new(config.clone(), [0.0; 3]);
        stand.set_up(LineOptics::Linear, ALONG_X, [0.0; 3]);
        let lean = truth(&stand.plant).laser_line().unwrap().misalignment;
        let from_um = stand.scale_um(0);
        let seen = stand.change_um([500.0, 0.0, 0.0]);
        let way = stand.scale_um(0) - from_um;
        near(seen, way * (1.0 - lean.value() * lean.value() / 2.0), 0.02);
        shortest = shortest.max(way - seen);
        config.laser.misalignment_urad -= 400.0;
    }
    assert!(shortest > 0.1, "{shortest} µm: there was something to see");
}

/// 15 µm in the middle, of which the prism's 1.5916° make a 36th; the straightedge's slope is
/// seen with it.
#[test]
fn straightness_optics_see_the_bow_and_their_own_slope() {
    let up = LineOptics::Straightness {
        across: [0.0, 0.0, 1.0],
    };
    let mut config = bowed();
    let mut stand = Stand::new(config.clone(), [0.0; 3]);
    stand.set_up(up, ALONG_X, [0.0; 3]);
    near(36.0 * stand.change_um([250.0, 0.0, 0.0]), 15.0, 2e-3);
    near(36.0 * stand.change_um([500.0, 0.0, 0.0]), -15.0, 2e-3);
    let mut stand = Stand::new(config.clone(), [0.0; 3]);
    let sideways = LineOptics::Straightness {
        across: [0.0, 1.0, 0.0],
    };
    stand.set_up(sideways, ALONG_X, [0.0; 3]);
    near(36.0 * stand.change_um([250.0, 0.0, 0.0]), 0.0, 2e-3);
    config.laser.straightedge_slope_urad = 150.0;
    let mut stand = Stand::new(config, [0.0; 3]);
    stand.set_up(up, ALONG_X, [0.0; 3]);
    let slope = truth(&stand.plant).laser_line().unwrap().slope.value();
    assert!(slope.abs() > 1e-6 && slope.abs() < 150e-6, "{slope}");
    let middle = stand.change_um([250.0, 0.0, 0.0]);
    near(36.0 * middle, 15.0 - 250e3 * slope, 2e-3);
    let end = middle + stand.change_um([500.0, 0.0, 0.0]);
    near(36.0 * end, -500e3 * slope, 2e-3);
}

/// 30 mm times 2.4e-4 rad about y. A table under the tool turns the tool the other way, and goes the
/// other way along its bowed guide: that is the same again.
#[test]
fn angular_optics_see_the_tool_tilt_by_the_right_hand() {
    let about = |about| LineOptics::Angular { about };
    for chain in ["FXYZ", "XFYZ"] {
        let mut config = bowed();
        config.chain = chain.into();
        let mut stand = Stand::new(config, [0.0; 3]);
        stand.set_up(about([0.0, 1.0, 0.0]), ALONG_X, [0.0, 0.0, -100.0]);
        near(stand.change_um([500.0, 0.0, 0.0]), 7.2, 1e-3);
        // The other way round; what of it is along the line does not count.
        stand.set_up(
            about([1.0, -2.0, 0.0]),
            [-1.0, 0.0, 0.0],
            [0.0, 0.0, -100.0],
        );
        near(stand.change_um([0.0; 3]), 7.2, 1e-3);
        stand.set_up(about([0.0, 0.0, 1.0]), ALONG_X, [0.0; 3]);
        near(stand.change_um([500.0, 0.0, 0.0]), 0.0, 1e-3);
    }
}

/// 10 arcsec at 200 mm to either side: a straightness up and one down.
#[test]
fn straightness_at_two_tool_offsets_sees_the_roll() {
    let roll_um = 200e3 * Radians::from_arcsec(10.0).value();
    for (side_mm, expected_um) in [(200.0, roll_um), (-200.0, -roll_um)] {
        let mut config = still();
        config.errors.deliberate_roll_arcsec = 10.0;
        config.errors.deliberate_from_h = 0.01;
        let mut stand = Stand::new(config, [0.0; 3]);
        let across = [0.0, 0.0, 1.0];
        let offset_mm = [0.0, side_mm, 0.0];
        stand.set_up(LineOptics::Straightness { across }, ALONG_X, offset_mm);
        let before = stand.path_um();
        assert!(stand.now < hours(0.01));
        stand.wait(Duration::from_secs(60));
        near(36.0 * (stand.path_um() - before), expected_um, 2e-3);
    }
}

#[test]
fn a_target_that_leaves_its_line_or_runs_into_the_optics_loses_the_beam() {
    let mut stand = Stand::new(still(), [100.0, 100.0, 100.0]);
    assert_eq!(stand.plant.fringes().beam, Beam::Blocked, "none is set up");
    stand.plant.set_up_line(&LineSetUp {
        optics: LineOptics::Linear,
        along: ALONG_X,
        tool_offset: [Metres::ZERO; 3],
    });
    stand.wait(Duration::from_millis(290));
    assert_eq!(stand.plant.fringes().beam, Beam::Blocked, "hands are in it");
    stand.wait(Duration::from_millis(20));
    for (to_mm, expected) in [
        ([101.0, 100.0, 100.0], Beam::Good),
        ([300.0, 101.9, 100.0], Beam::Good),
        ([300.0, 101.5, 98.5], Beam::Blocked),
        ([300.0, 100.0, 102.1], Beam::Blocked),
        ([52.0, 100.0, 100.0], Beam::Good),
        ([49.0, 100.0, 100.0], Beam::Blocked),
    ] {
        stand.go(to_mm);
        assert_eq!(stand.plant.fringes().beam, expected, "{to_mm:?}");
    }
    stand.go([100.0; 3]);
    stand.plant.take_line_away();
    assert_eq!(stand.plant.fringes().beam, Beam::Blocked);
}

#[test]
fn what_is_no_line_is_not_set_up() {
    let mut stand = Stand::new(still(), [0.0; 3]);
    let about = LineOptics::Angular { about: ALONG_X };
    for (optics, along) in [(LineOptics::Linear, [0.0; 3]), (about, ALONG_X)] {
        stand.plant.set_up_line(&LineSetUp {
            optics,
            along,
            tool_offset: [Metres::ZERO; 3],
        });
        assert_eq!(truth(&stand.plant).laser_line(), None);
    }
}

#[test]
fn the_reflector_may_be_too_fast_along_the_beam_and_as_fast_as_it_will_across() {
    let speed = |along: [f64; 3]| {
        let mut stand = Stand::new(still(), [100.0; 3]);
        stand.set_up(LineOptics::Linear, along, [0.0; 3]);
        let zero_m = truth(&stand.plant).count_zero(0).value();
        let demand = 0.4 - zero_m;
        stand
            .plant
            .set_servo(0, crate::plant::Servo::Follow { demand });
        stand.wait(Duration::from_millis(60));
        let fringes = stand.plant.fringes();
        let mm_per_s = fringes.half_wavelengths_per_s * WAVELENGTH_M / 2.0 / INDEX * 1e3;
        let scale = stand.plant.encoder_speed(0) * 10e-6;
        (mm_per_s, scale, fringes.too_fast)
    };
    let (seen, scale, too_fast) = speed(ALONG_X);
    assert!(scale > 400.0 && too_fast, "{scale}");
    near(seen, scale, 1e-3 * scale);
    let (seen, scale, too_fast) = speed([0.0, 1.0, 0.0]);
    assert!(scale > 400.0 && !too_fast, "{scale}");
    near(seen, 0.0, 1e-3);
}
