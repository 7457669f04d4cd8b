use super::*;
use crate::Edit;
use crate::certificate::{CertificateConfig, Figures};
use crate::config::parse;
use crate::edit::with_spot_cameras;
use crate::kinds::KINDS;

const LINEAR: &str = include_str!("../../../../configs/machines/linear.toml");
const UVW: &str = include_str!("../../../../configs/machines/uvw.toml");
const UVW_COPLEY: &str = include_str!("../../../../configs/machines/uvw-copley.toml");
const ROTARY: &str = include_str!("../../../../configs/machines/rotary.toml");
const VOLUMETRIC: &str = include_str!("../../../../configs/machines/volumetric.toml");

fn hash(text: &str) -> ConfigHash {
    parse(text, "m").unwrap().hash
}

/// `text` from `from` up to the next `to` left out.
fn without(text: &str, from: &str, to: &str) -> String {
    let begin = text.find(from).unwrap();
    let length = text[begin..].find(to).unwrap();
    format!("{}{}", &text[..begin], &text[begin + length..])
}

/// Every key that a detector or a beam of three axes may have, and none of what it may lack.
fn other_detectors() -> String {
    let curve = "dark_mv = [0.25, 0.0, -1e-6, 3.0]\ngain = [1.0, 1.01, 0.99, 1.0]\ncurve = [\
                 { ratio = -0.4, first_um = 250.0, second_um = 251.5 }, \
                 { ratio = 0.0, first_um = 0.0, second_um = 0.0 }, \
                 { ratio = 0.4, first_um = -250.0, second_um = -251.5 }]\n";
    let line = "um_per_one = [-626.66, -626.66]\nratio_max = 0.3\n";
    let text = VOLUMETRIC
        .edit_first(line, curve)
        .edit_first("layout = \"quadrants\"", "layout = \"lateral\"");
    without(&text, "[volumetric.beam.x.end]", "[volumetric.beam.y]")
        .edit_first(
            "[volumetric.beam.y]\ndrift = \"pivoting\"             # or \"translating\", \"mixed\"\n\
             source_mm = -100.0\nend_mm = 500.0",
            "[volumetric.beam.y]\ndrift = \"translating\"",
        )
        .edit_first(
            "[volumetric.beam.z]\ndrift = \"pivoting\"",
            "[volumetric.beam.z]\ntranslation_share = 0.25\ndrift = \"mixed\"",
        )
        .edit_first("revision = 0x1_0000\n", "")
}

fn fewer_detectors() -> String {
    let text = without(
        VOLUMETRIC,
        "[volumetric.roll]",
        "[[volumetric.temperature]]",
    );
    without(&text, "[volumetric.beam.z]", "[[volumetric.temperature]]")
}

/// The hashes were printed by the last program that knew version 1 only.
#[test]
fn calibrations_of_earlier_programs_keep_their_machine() {
    let other_table = ROTARY
        .edit_first("node_id = 1\n", "node_id = 1\nreverse = true\n")
        .edit_first(
            "index_direction = \"forward\"",
            "index_direction = \"reverse\"",
        );
    let other_stage = LINEAR
        .edit_first("resolution_nm = 10.0", "resolution_nm = 12.5")
        .edit_first("stage_serial = \"", "stage_serial = \"Ä\\\"1 ");
    let other_amplifiers = without(UVW_COPLEY, "[axis.u.amplifier]", "[axis.v]")
        .edit_first("serial_number = 4002", "model = \"ACJ-055-18\"");
    let earlier = [
        (
            LINEAR,
            "0a67b7caa56808c806425c37fc6f9ec7937fcd3a8155c4983a418f631f694848",
        ),
        (
            UVW,
            "5d1a05a7f806d5df6fba8f5f3c7f164aceeee11697f41c543b93385b0dff3d05",
        ),
        (
            UVW_COPLEY,
            "8568caeaad8aeac06d2efae27bcc0ca9a620e6fc6630f35df75d069e392c8481",
        ),
        (
            ROTARY,
            "16943312ff802761a1e5ce60a277cf513055662acdf8ffc71b23f34f56c1f5c1",
        ),
        (
            VOLUMETRIC,
            "caa2b5704a4dff60dd88a54546f1565f660e34140609bc5f27afd6a30706b5de",
        ),
        (
            &other_stage,
            "3ecb765a0d13b9849c0eae1c3dcb1af29775b253e18be1d5baa5ec77bace245c",
        ),
        (
            &other_amplifiers,
            "eb5642377b39fc6c945721e91e92da201e5132d1675ae42c16e2eae6a1bd949a",
        ),
        (
            &other_table,
            "4eefbb12fb34d1b654b7def66d92f3f43c3e1980cedf74c685f47e5d9ed08fa4",
        ),
        (
            &other_detectors(),
            "5748a79302927e47993d5c08582dcb6f856e01fdc8e9ace93223efe8516acd08",
        ),
        (
            &fewer_detectors(),
            "07b0da3eca5aad45d2304e1e91482973721b9315b4295fb45b765b3cbdc66558",
        ),
    ];
    for (text, recorded) in earlier {
        let here = hash(text);
        assert!(here.is(recorded), "{recorded}: {here:?}");
        let other = hash(&text.edit_first("stage_serial = \"", "stage_serial = \"another "));
        assert!(!other.is(recorded), "{recorded}");
    }
}

#[test]
fn the_text_is_written_as_it_was_published() {
    let shipped = KINDS.iter().map(|it| &it.golden);
    let shipped = shipped.filter_map(|it| Some((it.machine, it.depends?)));
    let others = [
        (UVW_COPLEY, include_str!("golden/uvw-copley.txt")),
        (
            &other_detectors(),
            include_str!("golden/other-detectors.txt"),
        ),
    ];
    for (file, published) in shipped.chain(others) {
        let config = parse(file, "m").unwrap().config;
        assert_eq!(version_2::text(&config), published);
        let hash = hash_of(&config);
        let of_text = blake3::hash(published.as_bytes()).to_hex();
        assert_eq!(hash.as_str(), of_text.as_str());
    }
}

#[test]
fn the_text_of_a_missing_correction_is_written_as_it_was_published() {
    let off = LINEAR.edit_first("correct_material = true", "correct_material = false");
    let text = version_3::text(&parse(&off, "m").unwrap().config);
    let published = include_str!("golden/linear-uncorrected.txt");
    assert_eq!(text.as_deref(), Some(published));
    assert_eq!(version_3::text(&parse(LINEAR, "m").unwrap().config), None);
}

/// Of several results of one certificate another one corrects otherwise; one that does not say which has the text of before.
#[test]
fn the_text_of_a_certificate_says_its_result_where_one_is_named() {
    let text = |result: Option<&str>| {
        let mut config = parse(VOLUMETRIC, "m").unwrap().config;
        let of = config.volumetric.as_mut().unwrap();
        of.temperature[0].certificate = Some(CertificateConfig {
            result: result.map(str::to_owned),
            ..CertificateConfig::of(Figures::Value { value: 0.0, u: 0.0 })
        });
        version_4::text(&config, "first line\nbody\n").unwrap()
    };
    let before = text(None);
    assert!(
        before.ends_with("body\nvolumetric.temperature.0.certificate = \"ab\"\n"),
        "{before}"
    );
    assert_eq!(
        text(Some("as left")),
        before + "volumetric.temperature.0.certificate.result = \"as left\"\n"
    );
}

#[test]
fn what_is_written_out_at_its_default_changes_nothing() {
    let told = ROTARY.edit_first("node_id = 1\n", "node_id = 1\nreverse = false\n");
    assert_eq!(hash(ROTARY), hash(&told));
    let dark = "layout = \"quadrants\"\ndark_mv = [0.0, -0.0, 0.0, 0.0]";
    let told = VOLUMETRIC.edit_first("layout = \"quadrants\"", dark);
    assert_eq!(hash(VOLUMETRIC).as_str(), hash(&told).as_str());
}

/// What would be two lines of another machine in a name stays one value of this one.
#[test]
fn no_name_can_write_a_line() {
    let name = "A\"\naxis.\"y\".resolution_nm = 10";
    assert_eq!(
        text::quoted(name),
        r#""A\"\u{a}axis.\"y\".resolution_nm = 10""#
    );
}

/// Its calibrations are wrong by what is not corrected, and good ones stay good.
#[test]
fn a_calibration_made_without_a_correction_is_foreign_when_that_is_on_again() {
    for key in [
        "correct_air = true",
        "correct_material = true",
        "correct_dead_path = true",
    ] {
        // The dead path is corrected by the air that is there.
        let off = LINEAR.edit_first(key, &key.replace("true", "false"));
        let off = match key {
            "correct_air = true" => {
                off.edit_first("correct_dead_path = true", "correct_dead_path = false")
            }
            _ => off,
        };
        let (usual, off) = (hash(LINEAR), hash(&off));
        assert!(!usual.is(off.as_str()), "{key}");
        assert!(off.is(usual.as_str()), "{key}");
        assert!(off.is(off.as_str()), "{key}");
    }
    let off = VOLUMETRIC.edit("correct_air = true", "correct_air = false");
    assert!(!hash(VOLUMETRIC).is(hash(&off).as_str()));
    let cold = VOLUMETRIC.edit_first("correct_material = false", "correct_material = true");
    assert_eq!(hash(VOLUMETRIC).as_str(), hash(&cold).as_str());
    // No beam leans by nothing.
    assert_eq!(LINEAR.matches("correct_cosine = false").count(), 1);
    let leans = LINEAR.edit_first("misalignment_mrad = 0.0", "misalignment_mrad = 2.0");
    assert!(!hash(LINEAR).is(hash(&leans).as_str()));
}

/// Where a detector's module is wired, and who it is, not what the file calls it.
#[test]
fn the_name_of_a_module_may_change() {
    let renamed = VOLUMETRIC.edit("beams_x", "first_beams");
    assert_eq!(hash(VOLUMETRIC), hash(&renamed));
}

/// Its name may change; not which one it is, what it was taught, and how its numbers become places.
#[test]
fn references_by_a_camera_depend_on_what_it_was_taught() {
    let text = with_spot_cameras(VOLUMETRIC, &["x"]);
    let usual = hash(&text);
    assert_ne!(usual, hash(VOLUMETRIC));
    let renamed = text.edit("[camera.slide_x]", "[camera.looks]");
    let renamed = renamed.edit("camera = \"slide_x\"", "camera = \"looks\"");
    assert_eq!(usual, hash(&renamed));
    for (from, to) in [
        ("job = \"spot.job\"", "job = \"point.job\""),
        (
            "job = \"spot.job\"",
            "job = \"spot.job\"\nserial_number = \"7\"",
        ),
        ("rotation_deg = 180.0", "rotation_deg = 90.0"),
        ("length_um_per_unit = 1.0", "length_um_per_unit = 1.5"),
    ] {
        assert_ne!(usual, hash(&text.edit_first(from, to)), "{to}");
    }
}

#[test]
fn a_calibration_depends_on_how_a_table_is_counted_and_on_nothing_of_its_speed() {
    let usual = hash(ROTARY);
    let faster = ROTARY.edit("speed_deg_per_s = 30.0", "speed_deg_per_s = 40.0");
    assert_eq!(usual, hash(&faster));
    let mirrored = ROTARY.edit("node_id = 1\n", "node_id = 1\nreverse = true\n");
    assert_ne!(usual, hash(&mirrored));
}

#[test]
fn the_hash_of_a_platform_follows_where_its_screws_push() {
    let moved = UVW.edit_first("point_mm = [-80.0, 80.0]", "point_mm = [-80.0, 81.0]");
    let slower = UVW.edit_first("settle_ms = 30", "settle_ms = 40");
    assert_ne!(hash(UVW), hash(&moved));
    assert_eq!(hash(UVW), hash(&slower));
}

#[test]
fn the_hash_follows_what_a_calibration_depends_on() {
    let same = LINEAR.edit("runs = 3", "runs = 4");
    let other = LINEAR.edit("resolution_nm = 10.0", "resolution_nm = 20.0");
    assert_eq!(hash(LINEAR), hash(&same));
    assert_ne!(hash(LINEAR), hash(&other));
}

#[test]
fn the_hash_follows_how_detectors_are_wired_and_read() {
    let hash = |from: &str, to: &str| hash(&VOLUMETRIC.edit_first(from, to));
    let usual = hash("", "");
    assert_eq!(usual, hash("age_max_ms = 100.0", "age_max_ms = 90.0"));
    assert_eq!(usual, hash("blend_s = 2.0", "blend_s = 3.0"));
    assert_ne!(usual, hash("[-626.66, -626.66]", "[-626.66, 626.66]"));
    assert_ne!(usual, hash("source_mm = -100.0", "source_mm = -90.0"));
    assert_ne!(usual, hash("node_id = 11", "node_id = 15"));
    assert_ne!(usual, hash("\"FXYZ\"", "\"XFYZ\""));
    assert_ne!(
        usual,
        hash("inclination_deg = 45.0", "inclination_deg = 30.0")
    );
}
