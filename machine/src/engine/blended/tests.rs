use core::time::Duration;

use proptest::prelude::*;
use units::{MetresPerSecond, MetresPerSecondCubed, MetresPerSecondSquared};

use super::*;
use crate::engine::csv::{CsvPath, PathForm, read_path};
use crate::engine::join::Join;
use crate::engine::judge::{Judge, PathError};
use crate::engine::{AXES_MAX, PerAxis};

const AXES: usize = 3;
const PERIOD: Duration = Duration::from_millis(1);

/// 50 mm/s, 1 m/s², 100 m/s³.
fn limits() -> PerAxis<AxisLimits> {
    let axis = AxisLimits {
        min: Metres(-10.0),
        max: Metres(10.0),
        speed: MetresPerSecond(0.05),
        acceleration: MetresPerSecondSquared(1.0),
        jerk: MetresPerSecondCubed(100.0),
        ..AxisLimits::default()
    };
    [axis; AXES_MAX]
}

fn names() -> [String; AXES] {
    ["x", "y", "z"].map(str::to_owned)
}

/// The rows, mm, each so many seconds after the one before.
fn text(rows: &[([f64; AXES], f64)]) -> String {
    let mut time = 0.0;
    let mut text = "time_s,x_mm,y_mm,z_mm\n".to_owned();
    for (row, ([x, y, z], takes)) in rows.iter().enumerate() {
        time += if row == 0 { 0.0 } else { *takes };
        text += &format!("{time},{x},{y},{z}\n");
    }
    text
}

fn path(rows: &[([f64; AXES], f64)], blend: Metres) -> CsvPath {
    let (axes, limits) = (names(), limits());
    let form = PathForm {
        axes: &axes,
        limits: &limits[..AXES],
        period: PERIOD,
        join: Some(Join::Linear { blend }),
    };
    read_path(&text(rows), &form).unwrap()
}

fn judged(path: &CsvPath) -> Result<(), PathError> {
    let mut judge = Judge::new(names().to_vec(), PERIOD, limits());
    path.points.iter().try_for_each(|point| {
        let mut all = [Metres::ZERO; AXES_MAX];
        all[..AXES].copy_from_slice(point);
        let next = judge.judge(&all)?;
        judge.accept(next);
        Ok(())
    })
}

fn minus(one: [f64; AXES], other: [f64; AXES]) -> [f64; AXES] {
    core::array::from_fn(|axis| one[axis] - other[axis])
}

fn dot(one: [f64; AXES], other: [f64; AXES]) -> f64 {
    one.iter().zip(&other).map(|(a, b)| a * b).sum()
}

fn length(of: [f64; AXES]) -> f64 {
    dot(of, of).sqrt()
}

fn mm(point: &[Metres]) -> [f64; AXES] {
    core::array::from_fn(|axis| point[axis].mm())
}

/// How far `point` is from the line between two others.
fn beside(point: [f64; AXES], [from, to]: [[f64; AXES]; 2]) -> f64 {
    let (way, gone) = (minus(to, from), minus(point, from));
    let share = match dot(way, way) {
        0.0 => 0.0,
        squared => (dot(gone, way) / squared).clamp(0.0, 1.0),
    };
    length(minus(gone, way.map(|it| share * it)))
}

/// How far any point is from the lines through the rows, and any row from the points, in mm.
fn distances(path: &CsvPath, rows: &[([f64; AXES], f64)]) -> [f64; 2] {
    let points: Vec<_> = path.points.iter().map(|it| mm(it)).collect();
    let lines = || rows.windows(2).map(|it| [it[0].0, it[1].0]);
    let beside_lines = points.iter().map(|point| {
        let each = lines().map(|line| beside(*point, line));
        each.fold(f64::INFINITY, f64::min)
    });
    let beside_rows = rows.iter().map(|(row, _)| {
        let each = points.windows(2).map(|it| beside(*row, [it[0], it[1]]));
        each.fold(f64::INFINITY, f64::min)
    });
    [
        beside_lines.fold(0.0, f64::max),
        beside_rows.fold(0.0, f64::max),
    ]
}

/// By what the speed changes at most within a period, mm/s.
fn largest_step(path: &CsvPath) -> f64 {
    let points: Vec<_> = path.points.iter().map(|it| mm(it)).collect();
    let steps = points.windows(3).map(|it| {
        let [before, after] = [minus(it[1], it[0]), minus(it[2], it[1])];
        length(minus(after, before)) / PERIOD.as_secs_f64()
    });
    steps.fold(0.0, f64::max)
}

fn square() -> Vec<([f64; AXES], f64)> {
    [
        [0.0, 0.0],
        [20.0, 0.0],
        [20.0, 20.0],
        [0.0, 20.0],
        [0.0, 0.0],
    ]
    .map(|[x, y]| ([x, y, 5.0], 1.0))
    .to_vec()
}

/// 20 mm/s round a square: Δv = 28.3 mm/s, of each axis 20, which the jerk wants to be half of 2 · 17.3 ms.
#[test]
fn a_corner_is_rounded_as_little_as_the_axes_can_and_its_size_is_told() {
    let half = f64::sqrt(1.5 * 20.0 / 100e3);
    let size = 3.0 / 16.0 * half * 20.0 * f64::sqrt(2.0);
    let path = path(&square(), Metres::from_mm(1.0));
    assert!(
        (path.departure.size.mm() - size).abs() < 1e-9,
        "{:?}",
        path.departure
    );
    let [off, missed] = distances(&path, &square());
    assert!((missed - size).abs() < 1e-3, "{missed} instead of {size}");
    assert!(off < size && off > size / 2.0, "{off}");
    assert!(path.tight.is_empty());
    assert!((path.longer.as_secs_f64() - 2.0 * half).abs() < 1e-9);
    judged(&path).unwrap();
}

#[test]
fn a_corner_that_would_need_more_than_is_allowed_is_told_and_refused() {
    let blend = Metres::from_um(50.0);
    let path = path(&square(), blend);
    assert!(
        path.departure.size <= blend * 1.000_001,
        "{:?}",
        path.departure
    );
    let lines: Vec<usize> = path.tight.iter().map(|it| it.line).collect();
    assert_eq!(lines, [3, 4, 5]);
    let refused = judged(&path).unwrap_err();
    let tight = &path.tight[0];
    assert!((refused.at_s - tight.at_s).abs() < 0.1, "{refused}");
    let enough = super::tests::path(&square(), tight.wants * 1.000_001);
    judged(&enough).unwrap();
    assert!(enough.tight.is_empty(), "{:?}", enough.tight);
}

/// To and fro on one line: nothing is beside it, and the turning point is missed by what is told.
#[test]
fn a_turning_point_is_missed_by_no_more_than_is_told() {
    let rows = [0.0, 20.0, 0.0].map(|x| ([x, 0.0, 0.0], 1.0));
    let path = path(&rows, Metres::from_mm(1.0));
    let [off, missed] = distances(&path, &rows);
    assert!(off < 1e-9, "{off}");
    let told = path.departure.size.mm();
    assert!(
        (missed - told).abs() < 1e-3 && told > 0.1,
        "{missed}, told {told}"
    );
    judged(&path).unwrap();
}

/// Faster, slower and a rest on one line: every row is reached, whatever is allowed beside corners.
#[test]
fn a_straight_line_is_left_nowhere_and_a_rest_is_kept() {
    let rows = [0.0, 5.0, 20.0, 20.0, 30.0].map(|x| ([x, 2.0 * x, 0.0], 1.0));
    let path = path(&rows, Metres::from_um(0.1));
    let [off, missed] = distances(&path, &rows);
    assert!(off < 1e-9 && missed < 1e-9, "{off} {missed}");
    assert_eq!(path.departure.size, Metres::ZERO);
    judged(&path).unwrap();
}

prop_compose! {
    /// Rows in a cube of 40 mm, none faster than the limits.
    fn any_rows()(
        rows in prop::collection::vec((prop::array::uniform3(-20.0..20.0_f64), 0.05..0.5_f64), 2..6),
    ) -> Vec<([f64; AXES], f64)> {
        let mut rows = rows;
        for row in 1..rows.len() {
            let way = minus(rows[row].0, rows[row - 1].0);
            let fastest = way.iter().fold(0.0, |most: f64, it| most.max(it.abs()));
            rows[row].1 = rows[row].1.max(fastest / 49.9);
        }
        rows
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn no_corner_is_passed_farther_than_is_allowed_and_speed_has_no_steps(
        rows in any_rows(),
        blend_um in 1.0..2_000.0_f64,
    ) {
        let path = path(&rows, Metres::from_um(blend_um));
        let told = path.departure.size.um();
        prop_assert!(told <= blend_um * (1.0 + 1e-9), "{} of {}", told, blend_um);
        let [off, _] = distances(&path, &rows).map(|it| it * 1e3);
        prop_assert!(off <= told + 1e-6, "{} beside the lines, told {}", off, told);
        let points = &path.points;
        let ends = [(0, 0), (points.len() - 1, rows.len() - 1)];
        for (point, row) in ends {
            let apart = minus(mm(&points[point]), rows[row].0);
            prop_assert!(length(apart) < 1e-9, "{:?}", apart);
        }
        if judged(&path).is_ok() {
            // 1 m/s² of each axis.
            let (step, most) = (largest_step(&path), f64::sqrt(3.0) * 1.01);
            prop_assert!(step <= most, "{} mm/s in a period", step);
        }
    }

    /// Rows that leave time for every corner, and a distance that is enough for all of them.
    #[test]
    fn what_is_told_to_be_enough_can_be_driven(rows in any_rows()) {
        let mut rows = rows;
        for row in &mut rows {
            // Two corners of 100 mm/s take 0.15 s each, by the acceleration.
            row.1 = row.1.max(0.32);
        }
        let path = path(&rows, Metres::from_mm(10.0));
        prop_assert_eq!(&path.tight, &[]);
        let refused = judged(&path);
        prop_assert!(refused.is_ok(), "{:?}", refused);
        // Between two points lie straight lines here: 2 m/s² leave them by 0.25 µm within a period.
        let told = path.departure.size.um() + 0.5;
        let [off, missed] = distances(&path, &rows).map(|it| it * 1e3);
        prop_assert!(off <= told && missed <= told, "{} and {} of {}", off, missed, told);
        let own = path.departure.size * (1.0 + 1e-9) + Metres::from_um(0.001);
        let again = super::tests::path(&rows, own);
        prop_assert_eq!(&again.tight, &[]);
        prop_assert!(judged(&again).is_ok());
    }
}
