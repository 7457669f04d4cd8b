//! Paths of three axes along straight lines: what the encoders see, period by period.

use core::time::Duration;

use machine::engine::{Cause, Engine, Join, NoCorrection, read_path};
use tests::random;
use tests::volume::{Volume, good};
use units::Metres;

/// What a drive lags behind its set-points, and rounds, mm.
const LAG_MM: f64 = 0.010;
/// So many paths are followed.
const PATHS: u64 = 4;

type Rows = Vec<[f64; 3]>;

/// A corner here and there, at 3 to 8 mm/s: the jerk of these axes needs no more than 0.11 mm beside any of them.
fn rows(seed: u64) -> (Rows, String) {
    let mut state = seed ^ 0x0070_6174;
    let mut place = [60.0, 60.0, 60.0];
    let (mut rows, mut time) = (vec![place], 0.0);
    let mut text = "# join: linear 200um\ntime_s,x_mm,y_mm,z_mm\n0,60,60,60\n".to_owned();
    for _ in 0..5 {
        let way = [0; 3].map(|_| 24.0 * random(&mut state) - 12.0);
        let length = way.iter().map(|it| it * it).sum::<f64>().sqrt();
        time += length / (3.0 + 5.0 * random(&mut state));
        for (at, by) in place.iter_mut().zip(way) {
            *at += by;
        }
        let [x, y, z] = place;
        text += &format!("{time},{x},{y},{z}\n");
        rows.push(place);
    }
    (rows, text)
}

fn beside(point: [f64; 3], [from, to]: [[f64; 3]; 2]) -> f64 {
    let way: [f64; 3] = core::array::from_fn(|k| to[k] - from[k]);
    let gone: [f64; 3] = core::array::from_fn(|k| point[k] - from[k]);
    let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(&b).map(|(a, b)| a * b).sum::<f64>();
    let share = (dot(gone, way) / dot(way, way)).clamp(0.0, 1.0);
    let off: [f64; 3] = core::array::from_fn(|k| gone[k] - share * way[k]);
    dot(off, off).sqrt()
}

/// Where the axes are in every period, from the path's first point to its end, mm.
fn follow(volume: &mut Volume, text: &str) -> (Vec<[f64; 3]>, f64) {
    let machine = &mut volume.bench.machine;
    let axes = ["x", "y", "z"];
    let (mut engine, mut desk) = good(Engine::new(machine, &axes, Box::new(NoCorrection)));
    let path = read_path(text, &engine.path_form(None)).expect("it can be read");
    assert_eq!(
        path.join,
        Join::Linear {
            blend: Metres::from_um(200.0)
        }
    );
    let told = path.departure.size.mm();
    desk.path.check(&path.points).expect("it can be driven");
    let mut points = path.points.into_iter();
    let mut seen = Vec::new();
    let cause = machine.follow_with(&mut engine, &mut || {
        desk.path.write(&mut points).expect("it was judged");
        while let Some(live) = desk.next_live() {
            seen.push(core::array::from_fn(|k| live.actual[k].mm()));
        }
    });
    assert_eq!(good(cause), Cause::PathDone);
    (seen, told)
}

#[test]
fn the_axes_leave_straight_lines_at_corners_only_and_by_no_more_than_was_told() {
    let mut volume = Volume::zeroed(51, |text| text, |text| text);
    for seed in 1..=PATHS {
        let (rows, text) = rows(seed);
        // The loop goes to the first point before the path begins.
        let begin = format!(
            "# join: linear 200um\ntime_s,x_mm,y_mm,z_mm\n0,{0},{1},{2}\n1,{0},{1},{2}\n",
            rows[0][0], rows[0][1], rows[0][2]
        );
        follow(&mut volume, &begin);
        let (seen, told) = follow(&mut volume, &text);
        assert!(told > 0.005 && told <= 0.2 + 1e-9, "{told}");
        let lines = || rows.windows(2).map(|it| [it[0], it[1]]);
        let off = seen.iter().map(|at| {
            let each = lines().map(|line| beside(*at, line));
            each.fold(f64::INFINITY, f64::min)
        });
        let off = off.fold(0.0, f64::max);
        assert!(
            off <= told + LAG_MM,
            "seed {seed}: {off} mm off, {told} told"
        );
        for row in &rows {
            let near = seen.windows(2).map(|it| beside(*row, [it[0], it[1]]));
            let near = near.fold(f64::INFINITY, f64::min);
            assert!(
                near <= told + LAG_MM,
                "seed {seed}: {near} mm from a row, {told} told"
            );
        }
        let last = seen.last().expect("there are periods");
        let end = rows.last().expect("there are rows");
        assert!(
            beside(*last, [*end, rows[0]]) < LAG_MM,
            "{last:?}, not {end:?}"
        );
        let period = Duration::from_millis(2).as_secs_f64();
        let fastest = seen.windows(3).map(|it| {
            let steps = (0..3).map(|k| (it[2][k] - 2.0 * it[1][k] + it[0][k]).abs() / period);
            steps.fold(0.0, f64::max)
        });
        // 1000 mm/s² change the speed by 2 mm/s within a period; the drives' own loops add to that.
        let most = fastest.fold(0.0, f64::max);
        assert!(most < 6.0, "seed {seed}: the speed steps by {most} mm/s");
    }
}
