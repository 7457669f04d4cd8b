//! `truestage align`: where each detector sees its beam, again and again, while a person turns the adjusters.
//!
//! No drive is enabled, nothing moves, and nothing is sent to a drive: a person has his hands in the machine.

mod lines;
mod picture;

use core::time::Duration;

use clap::Args;
use drivers::device::Signal;
use machine::engine::{CHANNELS_MAX, Observed, SPOTS_MAX};
use machine::{start_sensors, stop_sensors};
use units::Time;

use crate::ports::Use;
use crate::program::MachineArgs;
use crate::program::output::{Ended, Output};
use crate::program::session::Session;
use crate::program::span::span_of;
use crate::program::streams::{self, Reader};
use crate::volumetric::sight::{Sight, Sights, references_in_use};
use crate::{Failure, Machine, config};

/// From one picture to the next: as fast as an eye follows while a hand turns.
const REFRESH: Duration = Duration::from_millis(200);
/// From one line to the next where there is no terminal.
const LINE: Duration = Duration::from_secs(1);

/// What `truestage align` is told.
#[derive(Debug, Args)]
pub(crate) struct AlignArgs {
    #[command(flatten)]
    machine: MachineArgs,
    /// End after so long: `10s`, `5min`. It otherwise ends with Ctrl-C; both are a good end.
    #[arg(long = "for", value_name = "TIME", value_parser = span_of)]
    span: Option<Duration>,
    /// Look once, and end.
    #[arg(long, conflicts_with = "span")]
    once: bool,
    /// Also show the signal of each `[instrument.NAME]` that tells of it: how strong it is, and why it cannot be counted
    /// by; its line is opened, so it must be there. A machine without beams shows that alone.
    #[arg(long)]
    instruments: bool,
}

/// All that is shown at one moment.
struct View {
    /// Since the first look.
    seconds: f64,
    sights: Vec<Sight>,
    /// By name; `None` before an instrument has said anything of its signal.
    signals: Vec<(String, Option<Signal>)>,
    now: Time,
}

/// How it is shown, and how often.
enum Shown {
    Picture(picture::Screen),
    Lines,
}

pub(crate) fn run(args: &AlignArgs, output: Output) -> Ended {
    let loaded = config::load(&args.machine.config)?;
    let has_beams = !Sights::new(&loaded.config, None)?.is_empty();
    if !has_beams && loaded.config.instrument.is_empty() {
        return Err(nothing_to_align());
    }
    let with_instruments = args.instruments || !has_beams;
    let purpose = match with_instruments {
        true => Use::Measurement,
        false => Use::Motion,
    };
    let mut session = Session::open(&args.machine, "align", purpose, output)?;
    let known = references_in_use(&loaded.config, &loaded.hash, &session.store);
    let known = known.unwrap_or_else(|failure| {
        output.note(&format!("references are not shown: {failure}"));
        None
    });
    let sights = Sights::new(&loaded.config, known.as_ref())?;
    let names = match with_instruments {
        true => loaded.config.instrument.keys().cloned().collect(),
        false => Vec::new(),
    };
    let is_picture = !output.is_json() && !args.once && streams::is_out_terminal();
    let mut align = Align {
        shown: match is_picture {
            true => Shown::Picture(picture::Screen::new(&loaded.config.machine.name)),
            false => Shown::Lines,
        },
        sights,
        names,
        output,
    };
    let ended = align.run(&mut session.machine, args);
    // What is left running keeps nobody from working on, and the next verb starts it anew.
    let stopped = stop_sensors(&mut session.machine).map_err(Failure::from);
    match ended {
        Err(Failure::Machine(machine::Failure::Interrupted)) => stopped?,
        ended => ended.and(stopped)?,
    }
    if known.is_some() {
        output.note(
            "references were taken with the beams as they were: after one was adjusted, take them again \
             (`truestage reference`)",
        );
    }
    Ok(None)
}

fn nothing_to_align() -> Failure {
    Failure::Usage {
        what: "this machine has nothing to align: no detector that sees a beam, and no instrument"
            .into(),
        help: "describe them in [volumetric.beam.x], y and z, or in [instrument.NAME]".into(),
    }
}

struct Align {
    sights: Sights,
    /// Of the instruments whose signals are shown.
    names: Vec<String>,
    shown: Shown,
    output: Output,
}

impl Align {
    fn run(&mut self, machine: &mut Machine, args: &AlignArgs) -> Result<(), Failure> {
        start_sensors(machine)?;
        let started = machine.now();
        let end = args.span.map_or(Time::NEVER, |it| started + it);
        let every = match self.shown {
            Shown::Picture(_) => REFRESH,
            Shown::Lines => LINE,
        };
        let mut next = started;
        loop {
            next = (next + every).min(end);
            self.watch(machine, next)?;
            let view = self.view(machine, started)?;
            let reader = self.show(&view)?;
            if args.once || next >= end || reader == Reader::Left {
                return Ok(());
            }
        }
    }

    /// Lets the detectors be heard until the clock reaches `until`.
    fn watch(&mut self, machine: &mut Machine, until: Time) -> Result<(), Failure> {
        while machine.now() < until {
            machine.tick(until)?;
            let (mut channels, mut spots) = ([None; CHANNELS_MAX], [None; SPOTS_MAX]);
            machine.devices().hear_channels(&mut channels);
            machine.devices().hear_spots(&mut spots);
            self.sights.hear(&Observed {
                now: machine.now(),
                nominal: &[],
                actual: &[],
                channels: &channels,
                temperatures: &[],
                spots: &spots,
            });
        }
        Ok(())
    }

    fn view(&mut self, machine: &Machine, started: Time) -> Result<View, Failure> {
        let now = machine.now();
        let mut signals = Vec::new();
        for name in &self.names {
            let signal = machine.devices().instrument(name)?.signal();
            signals.push((name.clone(), signal));
        }
        Ok(View {
            seconds: now.since(started).as_secs_f64(),
            sights: self.sights.look(now),
            signals,
            now,
        })
    }

    fn show(&mut self, view: &View) -> Result<Reader, Failure> {
        let text = match &mut self.shown {
            Shown::Picture(screen) => screen.draw(view),
            Shown::Lines if self.output.is_json() => self.output.object(&lines::value(view)) + "\n",
            Shown::Lines => format!("{}\n", lines::line(view)),
        };
        streams::show(text.into_bytes())
    }
}
