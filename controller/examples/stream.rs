//! Opens a machine, zeroes it, streams a path from a file, and shows the correction as it is.
//!
//! `cargo run --example stream -- machine.toml path.csv` (`time_s,x_mm`)
#![expect(clippy::print_stdout, reason = "an example shows what it reads")]
use machine::engine::{Engine, State, read_path};
use machine::records::Lease;
use truestage::{Failure, Machine, config, ports};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().collect();
    let loaded = config::load(words[1].as_ref())?;
    let store = loaded.config.machine.store();
    let _lease = Lease::take(&store, "stream")?;
    let ports = ports::open(&loaded.config, &Default::default(), ports::Use::Motion, 1.0)?;
    let mut machine = Machine::new(&loaded, Box::new(ports));
    let path = std::fs::read_to_string(&words[2])?;
    Ok(machine.guarded(|machine| -> Result<(), Failure> {
        machine.start()?;
        machine.linear("x")?.load_active(&store)?;
        machine.linear("x")?.zero(&store)?;
        let correction = Box::new(machine.table_correction(&["x"])?);
        let (mut engine, mut desk) = Engine::new(machine, &["x"], correction)?;
        engine.in_real_time();
        let path = read_path(&path, &engine.path_form(None)).expect("a path");
        let beside = path.departure.size.mm();
        println!(
            "{} through the rows, at most {beside:.3} mm beside their straight joins",
            path.join
        );
        let writer = std::thread::spawn(move || {
            desk.correct(true).expect("the loop listens");
            let mut points = path.points.into_iter();
            while !matches!(desk.live().map(|it| it.state), Some(State::Stopped(_))) {
                let written = desk.path.write(&mut points);
                written.unwrap_or_else(|error| panic!("{error}"));
                std::thread::sleep(std::time::Duration::from_millis(20));
                let Some(live) = desk.live() else { continue };
                let (offset, u) = (live.offset[0].um(), live.uncertainty[0].um());
                println!("x {:.6} mm, {offset:+.3} ± {u:.3} um", live.actual[0].mm());
            }
        });
        println!("{}\n{}", machine.follow(&mut engine)?, engine.timing());
        writer.join().expect("the writer ends");
        machine.shut_down()
    })?)
}
