//! `truestage jog`: an axis runs as long as this program says so, or for a time.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use units::AxisSpeed;
use units::text::axis_speed;

use crate::config::{self, Loaded};
use crate::program::before::said;
use crate::program::intended::{Intent, Step, nowhere};
use crate::program::jogs::Jog;
use crate::program::json::counters;
use crate::program::kept::or_by_its_service;
use crate::program::kind::by_kind;
use crate::program::output::{Ended, Output, with_counters};
use crate::program::session::Session;
use crate::program::span::span_of;
use crate::program::verbs::Verbs;
use crate::program::{AskArgs, AxisArgs, MachineArgs, ZeroArgs};
use crate::{Failure, Machine};

/// Which axis, which way, how fast and for how long.
#[derive(Clone, Debug, Args)]
pub(crate) struct JogArgs {
    #[command(flatten)]
    pub(crate) machine: MachineArgs,
    /// How fast, and with its sign which way: `x=2mm/s`, `x=-500um/s`, `c=5deg/s`; at most the usual speed of the axis. Of
    /// a platform x, y or theta.
    #[arg(value_name = "AXIS=SPEED")]
    target: Option<String>,
    /// End after so long: `2s`, `1.5min`; without it, at the soft limit (of an axis that turns, where its drive counts no
    /// further) or with Ctrl-C.
    #[arg(long = "for", value_name = "TIME", value_parser = span_of)]
    span: Option<Duration>,
    #[command(flatten)]
    ask: AskArgs,
}

impl JogArgs {
    /// `truestage jog x=2mm/s` means `./machine.toml`, as with every verb.
    pub(crate) fn settle(mut self) -> Self {
        let first = self.machine.config.to_string_lossy();
        if self.target.is_none() && first.contains('=') && !self.machine.config.exists() {
            self.target = Some(first.into_owned());
            self.machine.config = PathBuf::from("machine.toml");
        }
        self
    }

    /// # Errors
    /// When it is not said which axis and how fast.
    pub(crate) fn jog(&self) -> Result<Jog, Failure> {
        let text = self.target.as_deref().unwrap_or_default();
        let (axis, speed) = speed_of_axis(text)?;
        Ok(Jog {
            axis,
            speed,
            duration: self.span,
        })
    }
}

/// `x=-2mm/s`: the unit is never guessed.
fn speed_of_axis(text: &str) -> Result<(String, AxisSpeed), Failure> {
    let parts = text.split_once('=').filter(|(axis, _)| !axis.is_empty());
    let read = parts.and_then(|(axis, value)| Some((axis.to_owned(), axis_speed(value)?)));
    let read = read.filter(|(_, speed)| speed.value() != 0.0);
    read.ok_or_else(|| Failure::Usage {
        what: format!("`{text}` is no speed of an axis"),
        help: "write AXIS=SPEED with a sign and a unit: x=2mm/s, x=-500um/s, c=5deg/s".into(),
    })
}

/// What the jog will do; refuses what makes no sense.
fn steps(
    kind: &Verbs,
    loaded: &Loaded,
    (args, jog): (&JogArgs, &Jog),
) -> Result<Vec<Step>, Failure> {
    (kind.jog.check)(&mut nowhere::machine(loaded), jog)?;
    let zero = ZeroArgs {
        axis: AxisArgs {
            machine: args.machine.clone(),
            axis: kind.jog.zeroed.is_none().then(|| jog.axis.clone()),
        },
        ask: args.ask,
    };
    let store = loaded.config.machine.store();
    let mut steps = (kind.intended)(loaded, &store, Intent::Zero(&zero))?;
    steps.push(kind.jog.step(jog));
    Ok(steps)
}

/// Jogs an axis here, or by the service that keeps its machine.
pub(crate) fn run(args: &JogArgs, output: Output) -> Ended {
    or_by_its_service(here(args, output), |service| service.jog(args, output))
}

/// Zeroes the axis and jogs it, on a machine that nobody else has.
fn here(args: &JogArgs, output: Output) -> Ended {
    let jog = args.jog()?;
    by_kind(&args.machine, [jog.axis.as_str()].into_iter(), |kind| {
        let loaded = config::load(&args.machine.config)?;
        loaded.filled_in()?;
        let steps = steps(kind, &loaded, (args, &jog))?;
        if let Some(ended) = said(&loaded, &steps, (args.ask, true), output)? {
            return ended;
        }
        let mut session = Session::open(&args.machine, "jog", kind.jog.purpose, output)?;
        let store = session.store.clone();
        let (jogged, counters) = session.machine.guarded(|machine: &mut Machine| {
            let jogged = (kind.jog.run)(machine, &store, &jog)?;
            machine.shut_down()?;
            Ok((jogged, counters(&machine.devices().counters())))
        })?;
        let value = with_counters(kind.jog.value(&jog.axis, &jogged), counters);
        output.result(&kind.jog.text(&jog.axis, &jogged), &value)
    })
}

#[cfg(test)]
mod tests {
    use units::{MetresPerSecond, RadiansPerSecond};

    use super::*;

    #[test]
    fn a_jog_needs_an_axis_a_way_and_a_unit() {
        let (axis, speed) = speed_of_axis("x=-500um/s").unwrap();
        assert_eq!(axis, "x");
        assert_eq!(speed, MetresPerSecond(-500.0 * 1e-6).into());
        let (_, speed) = speed_of_axis("c=-180deg/s").unwrap();
        assert_eq!(speed, RadiansPerSecond(-core::f64::consts::PI).into());
        for text in [
            "x=2",
            "x",
            "=2mm/s",
            "x=0mm/s",
            "c=0rpm",
            "x=2mm",
            "c=5deg",
            "x=nanmm/s",
            "",
        ] {
            let said = speed_of_axis(text).unwrap_err().to_string();
            assert!(said.contains("x=2mm/s"), "{text}: {said}");
        }
    }
}
