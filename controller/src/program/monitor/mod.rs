//! `truestage monitor`: what a machine that a service keeps does, as it happens.
//!
//! On a terminal a picture of 80 columns and 24 lines, which serves over ssh as well; elsewhere a line for each event.

mod board;
mod draw;
mod feed;
mod picture;
mod words;

use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use clap::Args;

use crate::program::ServiceArgs;
use crate::program::exchange::ask;
use crate::program::output::{Ended, Output};
use crate::program::span::span_of;
use crate::program::streams::{self, Reader};
use feed::{Heard, Wanted};

/// So many past events are asked for to begin with: what the picture has room for.
const EVENTS: u64 = 24;
/// Longer than any reader waits, and short enough for a clock.
const FOR_EVER: Duration = Duration::from_secs(1 << 30);

/// What `truestage monitor` is told.
#[derive(Clone, Debug, Args)]
pub(crate) struct MonitorArgs {
    #[command(flatten)]
    service: ServiceArgs,
    /// End after so long: `10s`, `5min`. It otherwise ends with q or Ctrl-C, and where its output is no terminal, with
    /// the service.
    #[arg(long = "for", value_name = "TIME", value_parser = span_of)]
    span: Option<Duration>,
    /// Also what happened before: the last thousand events of this service.
    #[arg(long)]
    all: bool,
}

impl MonitorArgs {
    /// The event after which others are wanted, `ago` before the newest at the latest.
    fn after(&self, newest: u64, ago: u64) -> u64 {
        match self.all {
            true => 0,
            false => newest.saturating_sub(ago),
        }
    }
}

pub(crate) fn run(args: &MonitorArgs, output: Output) -> Ended {
    let at = &args.service.place()?;
    // Who is not there is told at once, before a picture takes the terminal.
    let machine = ask(at, "GET", "/v1/machine", "")?;
    let newest = machine["newest_event"].as_u64().unwrap_or_default();
    let until = Instant::now() + args.span.unwrap_or(FOR_EVER);
    if streams::is_out_terminal() && !output.is_json() {
        let wanted = Wanted {
            after: args.after(newest, EVENTS),
            picture: true,
        };
        return picture::show(at, &feed::follow(at, wanted), until);
    }
    let wanted = Wanted {
        after: args.after(newest, 0),
        picture: false,
    };
    lines(&feed::follow(at, wanted), until, output)
}

/// A line for each event until the service ends, which is the end of what there is to tell.
fn lines(heard: &Receiver<Heard>, until: Instant, output: Output) -> Ended {
    loop {
        let left = until.saturating_duration_since(Instant::now());
        let line = match heard.recv_timeout(left) {
            Ok(Heard::Event(event)) if output.is_json() => output.object(&event),
            Ok(Heard::Event(event)) => words::line(&event),
            Ok(Heard::Lost(failure)) => return Err(failure),
            Ok(Heard::Ended) | Err(RecvTimeoutError::Disconnected) => {
                output.note("the service has ended");
                return Ok(None);
            }
            Ok(Heard::Machine(_) | Heard::Axes(_) | Heard::Runs(_)) => continue,
            Err(RecvTimeoutError::Timeout) => return Ok(None),
        };
        if streams::print((line + "\n").into_bytes())? == Reader::Left {
            return Ok(None);
        }
    }
}
