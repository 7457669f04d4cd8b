use compensator::volumetric::online::BeamDrift;
use tempfile::TempDir;

use super::*;
use crate::config::parse;
use crate::edit::with_spot_cameras;
use crate::stores::store_in;
use crate::volumetric::benefit::fall_back;
use crate::volumetric::chosen::use_geometry;
use crate::volumetric::{GEOMETRY, GeometryContent, GivenName};

const CONFIG: &str = include_str!("../../../../configs/machines/volumetric.toml");
const HEADER: &str = "axis,detector,along,position_mm,value,unit\n";

/// The shipped machine, whose errors were measured.
struct Known {
    _folder: TempDir,
    store: Store,
    machine: MachineConfig,
}

fn head(axis: &str) -> RecordHead {
    RecordHead {
        axis: axis.into(),
        ..RecordHead::default()
    }
}

fn known() -> Known {
    let folder = tempfile::tempdir().unwrap();
    let store = store_in(folder.path(), "m");
    let content = GeometryContent::default();
    let head = head(GEOMETRY);
    let id = store.save(&CalibrationRecord { head, content }).unwrap();
    store.activate(GEOMETRY, &id).unwrap();
    Known {
        _folder: folder,
        store,
        machine: parse(CONFIG, "m.toml").unwrap().config,
    }
}

impl Known {
    fn import(&self, text: &str, name: &str) -> Result<GivenReferences, Failure> {
        import(&self.machine, &self.store, head(REFERENCES), (text, name))
    }

    fn in_use(&self) -> Option<String> {
        self.store.active(REFERENCES).unwrap().current
    }
}

/// Straight lines: by axis and direction across, what is read at both ends of the travel.
fn table(x_along_y: [f64; 2]) -> String {
    let mut text = HEADER.to_owned();
    for (axis, travel_mm) in Axis::ALL.into_iter().zip([500, 400, 300]) {
        for along in axis.others() {
            let is_own = (axis, along) == (Axis::X, Axis::Y);
            let [low, high] = if is_own { x_along_y } else { [-2.0, 3.0] };
            text += &format!("{axis},slide,{along},0,{low},um\n");
            text += &format!("{axis},slide,{along},{travel_mm},{high},um\n");
            text += &format!("{axis},end,{along},,7.5,um\n");
        }
    }
    text + "x,roll,,0,-1,arcsec\nx,roll,,500,1,arcsec\n"
}

/// Likewise as functions; `x_along_y` says that of x along y.
fn functions(x_along_y: &str) -> String {
    let mut text = "schema_version = 1\n".to_owned();
    for (axis, travel_mm) in Axis::ALL.into_iter().zip([500, 400, 300]) {
        for along in axis.others() {
            let head = format!("axis = \"{axis}\"\nalong = \"{along}\"\n");
            let is_own = (axis, along) == (Axis::X, Axis::Y);
            let line = format!(
                "coefficients_um = [-2.0, 5.0]\nscale_mm = {travel_mm}\nfrom_mm = 0\nto_mm = {travel_mm}\n"
            );
            let own = if is_own { x_along_y } else { &line };
            text += &format!("[[function]]\ndetector = \"slide\"\n{head}{own}\n");
            text += &format!("[[function]]\ndetector = \"end\"\n{head}coefficients_um = [7.5]\n");
        }
    }
    text + "[[function]]\naxis = \"x\"\ndetector = \"roll\"\ncoefficients_arcsec = [-1.0, 2.0]\n\
            scale_mm = 500\nfrom_mm = 0\nto_mm = 500\n"
}

/// A bow of 12 um over the travel of x, on 4 um.
const BOW: &str = "coefficients_um = [16.0, 0.0, -12.0]\norigin_mm = 250\nscale_mm = 250\n\
                   from_mm = -1\nto_mm = 501\n";

#[test]
fn a_table_is_in_use_with_its_origin_and_reads_as_it_was_given() {
    let known = known();
    let given = known.import(&table([-10.0, 40.0]), "r.csv").unwrap();
    assert_eq!(known.in_use().as_ref(), Some(&given.id));
    assert!(given.before.is_none() && given.foreign.is_empty());
    let content = known.store.load::<BeamReferencesContent>(&given.id);
    let content = content.unwrap().content;
    assert_eq!(content.given, Some(GivenName::Table));
    let said = content.summary();
    assert!(said.contains("given beforehand as a table"), "{said}");
    let drift = BeamDrift::Translating;
    let beam = content.beam(&given.id, Axis::X, drift).unwrap().unwrap();
    let [y, z] = beam.slider(Metres(0.1));
    assert!(
        (y.um() - 0.0).abs() < 1e-9 && (z.um() + 1.0).abs() < 1e-9,
        "{y} {z}"
    );
    assert!(beam.end().iter().all(|it| (it.um() - 7.5).abs() < 1e-9));
    let own = known.machine.volumetric.as_ref().unwrap();
    let [roll, ..] = content.rolls(&given.id, own).unwrap();
    assert!((roll.unwrap().at(Metres(0.375)).arcsec() - 0.5).abs() < 1e-9);
}

/// The end's reading counts, whatever reads it.
#[test]
fn what_cameras_read_is_given_alike() {
    let mut known = known();
    let text = with_spot_cameras(CONFIG, &["x"]);
    known.machine = parse(&text, "m.toml").unwrap().config;
    let given = known.import(&table([-10.0, 40.0]), "r.csv").unwrap();
    let beam = given.content.beams.iter().find(|it| it.axis == 'x');
    let end_m = beam.unwrap().end_m.expect("it was given");
    assert!(
        end_m.iter().all(|it| (it - 7.5e-6).abs() < 1e-15),
        "{end_m:?}"
    );
}

#[test]
fn functions_are_drawn_to_a_nanometre_and_told_from_those_before() {
    let known = known();
    let first = known.import(&table([4.0, 4.0]), "r.csv").unwrap();
    let given = known.import(&functions(BOW), "r.toml").unwrap();
    assert_eq!(given.before.as_ref(), Some(&first.content));
    assert_eq!(given.content.given, Some(GivenName::Functions));
    let drift = BeamDrift::Translating;
    let beam = given.content.beam("id", Axis::X, drift).unwrap().unwrap();
    for n in 0..=50 {
        let at = Metres::from_mm(f64::from(n) * 10.0);
        let t = (at.mm() - 250.0) / 250.0;
        let off = beam.slider(at)[0].um() - (16.0 - 12.0 * t * t);
        assert!(off.abs() < 1e-3, "{off} um at {} mm", at.mm());
    }
}

#[track_caller]
fn check_refused(known: &Known, (text, name): (&str, &str), why: &[&str]) {
    let before = known.in_use();
    let refused = known.import(text, name).unwrap_err();
    assert_eq!(refused.exit_code(), 2, "{refused}");
    let said = refused.to_string();
    for part in why.iter().chain(&[name]) {
        assert!(said.contains(part), "`{part}` is not in {said}");
    }
    assert_eq!(known.in_use(), before, "what was in use stays in use");
}

#[test]
fn a_table_that_this_machine_cannot_have_is_refused_with_its_row() {
    let known = known();
    known.import(&table([0.0, 0.0]), "r.csv").unwrap();
    let whole = table([0.0, 0.0]);
    let refused = |text: &str, why: &[&str]| check_refused(&known, (text, "s.csv"), why);
    let edit = |from: &str, to: &str| {
        assert!(whole.contains(from), "{from}");
        whole.replace(from, to)
    };
    // Row 3 is the far end of x along y; the reading begins in row 2.
    let row =
        "s.csv:2: x, slide along y: given from 0 to 400 mm, and the work volume is 0 to 500 mm";
    refused(
        &edit("x,slide,y,500", "x,slide,y,400"),
        &[row, "millimetres"],
    );
    let far = edit("x,slide,y,500", "x,slide,y,5000");
    refused(&far, &["and the soft limits of the axis are -3 to 503 mm"]);
    let large = edit("x,slide,y,500,0,um", "x,slide,y,500,200,um");
    refused(
        &large,
        &["is outside what the detector can show, -187.998 um to 187.998 um"],
    );
    refused(
        &edit("7.5,um", "7500,um"),
        &["x, end along y: 7500 um is outside"],
    );
    let steep = edit("x,roll,,500,1,", "x,roll,,500,61,");
    refused(&steep, &["x, roll: ", "-60 arcsec to 60 arcsec"]);
    refused(
        &edit("z,end,y,,7.5,um\n", ""),
        &["nothing is given for z, end along y"],
    );
    let other = whole.clone() + "y,roll,,0,1,arcsec\ny,roll,,400,1,arcsec\n";
    refused(
        &other,
        &["s.csv:22: y, roll: this machine has no such detector"],
    );
}

#[test]
fn functions_that_cannot_be_are_refused_with_line_and_key() {
    let known = known();
    let refused = |own: &str, why: &[&str]| {
        check_refused(&known, (&functions(own), "f.toml"), why);
    };
    let with =
        |coefficients: &str, rest: &str| format!("coefficients_um = {coefficients}\n{rest}\n");
    let range = "from_mm = 0\nto_mm = 500\n";
    refused(
        &with("[0.0]", "from_mm = 0\nto_mm = 499\n"),
        &["f.toml:2:", "0 to 499 mm"],
    );
    refused(
        &with("[0.0]", ""),
        &["it is not said where this function holds"],
    );
    refused(
        &with("[0.0]", "from_mm = 5\nto_mm = 5\n"),
        &["not above `from_mm`"],
    );
    // Micrometres per millimetre squared, forgotten.
    refused(&with("[0.0, 0.0, 1.0]", range), &["can show"]);
    let endless = with("[0.0, 0.0, 0.0, 0.0, 0.0, 1e290]", range);
    refused(&endless, &["too large or too steep"]);
    let angle = format!("coefficients_arcsec = [1.0]\n{range}");
    refused(&angle, &["is a length"]);
    refused(
        &with("[0.0]", "from_mm = 0\nto_mn = 500\n"),
        &["did you mean `to_mm`?"],
    );
    let twice = functions(BOW)
        + "[[function]]\naxis = \"x\"\nalong = \"y\"\ndetector = \"end\"\n\
                                  coefficients_um = [1.0]\n";
    check_refused(&known, (&twice, "f.toml"), &["x, end along y: given twice"]);
    let along = functions(BOW).replace("along = \"z\"", "along = \"x\"");
    check_refused(&known, (&along, "f.toml"), &["read along y and along z"]);
    let still = functions(BOW).replace("coefficients_um = [7.5]", "coefficients_um = [7.5, 1.0]");
    check_refused(&known, (&still, "f.toml"), &["give one coefficient"]);
}

/// They would count from nothing.
#[test]
fn without_measured_errors_there_are_no_references() {
    let known = known();
    known.store.put_out_of_use(GEOMETRY).unwrap();
    let refused = known.import(&table([0.0, 0.0]), "r.csv").unwrap_err();
    assert_eq!(refused.exit_code(), 3, "{refused}");
    assert_eq!(known.in_use(), None);
}

/// The second memory, counting from `references` and in use; its name.
fn remembered(known: &Known, references: &str) -> String {
    let pointer = memory_pointer(MemoryName::Second);
    let content = StateMemoryContent {
        memory: MemoryName::Second,
        references: references.to_owned(),
        ..StateMemoryContent::default()
    };
    let head = head(pointer);
    let record = CalibrationRecord { head, content };
    let id = known.store.save(&record).unwrap();
    known.store.activate(pointer, &id).unwrap();
    id
}

/// What a memory keeps counts from the references that it was recorded with.
#[test]
fn memories_that_count_from_other_references_are_named() {
    let known = known();
    let before = known.import(&table([0.0, 0.0]), "r.csv").unwrap();
    let id = remembered(&known, &before.id);
    let again = known.import(&table([1.0, 0.0]), "r.csv").unwrap();
    assert_eq!(again.foreign, [(MemoryName::Second, id)]);
}

#[test]
fn errors_that_are_found_or_fallen_back_to_leave_nothing_in_use_that_counts_from_others() {
    let known = known();
    let in_use = |pointer: &str| known.store.active(pointer).unwrap().current;
    let memory = memory_pointer(MemoryName::Second);
    let first = in_use(GEOMETRY).unwrap();
    let of_first = known.import(&table([0.0, 0.0]), "r.csv").unwrap().id;
    let of_old = remembered(&known, &of_first);

    let content = GeometryContent::default();
    let newer = RecordHead {
        created: "2026-01-02T00:00:00Z".into(),
        ..head(GEOMETRY)
    };
    let record = CalibrationRecord {
        head: newer,
        content,
    };
    let second = known.store.save(&record).unwrap();
    let content = BeamReferencesContent {
        geometry: second.clone(),
        ..BeamReferencesContent::default()
    };
    let head = head(REFERENCES);
    let record = CalibrationRecord { head, content };
    let of_second = known.store.save(&record).unwrap();
    use_geometry(&known.store, &second).unwrap();
    assert_eq!(in_use(GEOMETRY).as_ref(), Some(&second));
    assert_eq!(known.in_use().as_ref(), Some(&of_second));
    assert_eq!(in_use(memory), None);

    remembered(&known, &of_second);
    assert_eq!(
        fall_back(&known.store, &second).unwrap().as_ref(),
        Some(&first)
    );
    assert_eq!(in_use(GEOMETRY).as_ref(), Some(&first));
    assert_eq!(known.in_use().as_ref(), Some(&of_first));
    assert_eq!(in_use(memory), Some(of_old));

    assert_eq!(fall_back(&known.store, &first).unwrap(), None);
    assert_eq!((in_use(GEOMETRY), known.in_use()), (None, None));
    assert_eq!(in_use(memory), None);
}
