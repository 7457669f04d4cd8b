//! Instructions of whole cycles in virtual time, of a tick, and of the pieces that they are made of.
//!
//! A count does not depend on how busy a computer is. `tests/bench/counts` runs them and compares.

#![expect(missing_docs, reason = "the macros make modules that have none")]

use core::fmt::Debug;
use core::time::Duration;
use std::hint::black_box;

use compensator::error_table::{Compensation, Interpolation};
use compensator::rotary::{Criterion, RotarySeries, SolveOptions, plan, solve};
use compensator::volumetric::Point;
use compensator::volumetric::function::Shape;
use compensator::volumetric::model::{Conditions, VolumetricModel};
use gungraun::{
    Callgrind, LibraryBenchmarkConfig, library_benchmark, library_benchmark_group, main,
};
use tests::Bench;
use tests::cycles::{Cycle, PARTS, WHOLE, named};
use tests::specimens::{plate, stroke, volume};
use units::{Metres, Radians};
use wire::can::CanFrame;
use wire::{dcon, slcan, umd2};

const SEED: u64 = 1;
const CALLS: usize = 100;

fn made(cycles: &'static [Cycle], name: &str) -> (&'static Cycle, Bench) {
    let cycle = named(cycles, name);
    (cycle, cycle.bench(SEED))
}

fn whole(name: &str) -> (&'static Cycle, Bench) {
    made(&WHOLE, name)
}

fn part(name: &str) -> (&'static Cycle, Bench) {
    made(&PARTS, name)
}

#[library_benchmark]
#[bench::linear(args = ("linear"), setup = whole)]
#[bench::uvw(args = ("uvw"), setup = whole)]
#[bench::uvw_copley(args = ("uvw-copley"), setup = whole)]
#[bench::rotary(args = ("rotary"), setup = whole)]
#[bench::volumetric_part(args = ("volumetric"), setup = part)]
fn cycle((cycle, bench): (&'static Cycle, Bench)) -> Bench {
    cycle.run(bench)
}

#[library_benchmark]
#[bench::volumetric(args = ("volumetric"), setup = whole)]
fn day((cycle, bench): (&'static Cycle, Bench)) -> Bench {
    cycle.run(bench)
}

/// A stage that stands at its start, enabled.
fn started() -> Bench {
    let mut bench = Bench::new(SEED);
    bench.machine.start().expect("nothing is wrong with it");
    bench
}

// A second in which nothing is asked for.
#[library_benchmark]
#[bench::second(setup = started)]
fn wait(mut bench: Bench) -> Bench {
    let end = bench.machine.now() + Duration::from_secs(1);
    while bench.machine.now() < end {
        bench.machine.tick(end).expect("nothing is wrong with it");
    }
    bench
}

fn model(shape: Shape) -> (VolumetricModel, Conditions, Vec<Point>) {
    let (model, now) = volume::model(shape);
    (model, now, volume::targets(CALLS))
}

type InVolume = (VolumetricModel, Conditions, Vec<Point>);

/// Does `work` at each target.
fn at_each<E: Debug>(
    (model, now, targets): InVolume,
    work: impl Fn(&VolumetricModel, Point, &Conditions) -> Result<Point, E>,
) -> InVolume {
    for target in &targets {
        black_box(work(&model, *target, &now).expect("within the volume"));
    }
    (model, now, targets)
}

#[library_benchmark]
#[bench::tables(args = (Shape::Linear), setup = model)]
#[bench::splines(args = (Shape::Spline), setup = model)]
fn deviation(specimen: InVolume) -> InVolume {
    at_each(specimen, VolumetricModel::deviation)
}

#[library_benchmark]
#[bench::tables(args = (Shape::Linear), setup = model)]
#[bench::splines(args = (Shape::Spline), setup = model)]
fn inverse(specimen: InVolume) -> InVolume {
    at_each(specimen, VolumetricModel::command)
}

fn table(interpolation: Interpolation) -> (Compensation, Vec<Metres>) {
    let made = stroke::compensation(interpolation, 2000);
    (made, stroke::targets(CALLS))
}

#[library_benchmark]
#[bench::linear(args = (Interpolation::Linear), setup = table)]
#[bench::cubic(args = (Interpolation::MonotoneCubic), setup = table)]
fn set_point((table, targets): (Compensation, Vec<Metres>)) -> Compensation {
    for target in &targets {
        let _ = black_box(table.set_point(*target, units::Approach::Forward));
    }
    table
}

#[library_benchmark]
#[bench::three_hundred_and_sixty_lines(360, 4)]
fn plan_offsets(lines: usize, placements: usize) -> bool {
    plan(black_box(lines), placements, Criterion::Worst).is_ok()
}

fn readings() -> (RotarySeries, SolveOptions) {
    const LINES: usize = 360;
    let planned = plan(LINES, 4, Criterion::Worst).expect("four placements are possible");
    let options = SolveOptions {
        reading_noise: Some(Radians::from_arcsec(0.05)),
        ..SolveOptions::default()
    };
    (plate::series(LINES, planned.offsets()), options)
}

#[library_benchmark]
#[bench::four_placements(setup = readings)]
fn self_calibration((series, options): (RotarySeries, SolveOptions)) -> RotarySeries {
    black_box(solve(&series, &options).expect("nothing is wrong with it"));
    series
}

const UMD2_LINE: &str = "16777216 16777321 105 -3 128 4711 0 0";

/// Does `work` so often that its cost shows.
fn repeat<T>(work: impl Fn() -> T) {
    for _ in 0..CALLS {
        let _ = black_box(work());
    }
}

fn sample() -> umd2::Sample {
    match umd2::Line::parse(UMD2_LINE).expect("a line of the manual's form") {
        umd2::Line::Sample(sample) => sample,
        other => panic!("{other:?}"),
    }
}

#[library_benchmark]
#[bench::line(setup = sample)]
fn emit_umd2(sample: umd2::Sample) -> Vec<u8> {
    let mut line = Vec::with_capacity(100 * CALLS);
    for _ in 0..CALLS {
        sample.emit_into(&mut line);
    }
    line
}

#[library_benchmark]
#[bench::line(UMD2_LINE)]
fn parse_umd2(line: &str) {
    repeat(|| umd2::Line::parse(black_box(line)));
}

#[library_benchmark]
#[bench::two_channels(">+1.4567-0.0012")]
fn parse_dcon(line: &str) {
    repeat(|| dcon::parse_volts(black_box(line)));
}

#[library_benchmark]
#[bench::frame(b"t1818A1B2C3D4E5F60718")]
fn parse_slcan(line: &[u8]) {
    repeat(|| slcan::Reply::parse(black_box(line)));
}

#[library_benchmark]
#[bench::frame(CanFrame::standard(0x181, &[0xA1, 0xB2, 0xC3, 0xD4, 0xE5, 0xF6, 7, 0x18]))]
fn emit_slcan(frame: CanFrame) {
    repeat(|| slcan::Command::Transmit(black_box(frame)).emit());
}

library_benchmark_group!(name = cycles, benchmarks = [cycle, wait]);
library_benchmark_group!(name = days, benchmarks = [day]);
library_benchmark_group!(
    name = calculations,
    benchmarks = [
        deviation,
        inverse,
        set_point,
        plan_offsets,
        self_calibration
    ]
);
library_benchmark_group!(
    name = codecs,
    benchmarks = [emit_umd2, parse_umd2, parse_dcon, parse_slcan, emit_slcan]
);
main!(
    config = LibraryBenchmarkConfig::default().tool(Callgrind::with_args(["--cache-sim=no"])),
    library_benchmark_groups = [cycles, days, calculations, codecs]
);
