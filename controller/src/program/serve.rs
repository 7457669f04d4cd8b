//! `truestage serve`: a machine for whoever keeps it, opened on the thread that does.

use std::any::Any;

use crate::ports::Use;
use crate::program::output::{Ended, Output};
use crate::program::session::Session;
use crate::program::{MachineArgs, ServeArgs};
use crate::{Failure, Machine, Store};

/// A machine, where its records are, and what must be held as long as it is used.
type Opening = dyn FnOnce() -> Result<(Machine, Store, Box<dyn Any>), Failure> + Send;

/// What `truestage serve` is asked for: a machine that is to be kept for others.
pub struct Serving {
    /// Where it is to be found: `unix:PATH`, `tcp:127.0.0.1:PORT`.
    pub listen: Vec<String>,
    /// Opens it; called once, on the thread that keeps it.
    pub open: Box<Opening>,
    /// Tells whoever started it something.
    pub told: Box<dyn Fn(&str)>,
}

/// Keeps the machine until somebody ends it.
pub(crate) fn run(
    args: ServeArgs,
    output: Output,
    serve: fn(Serving) -> Result<(), Failure>,
) -> Ended {
    let ServeArgs { machine, listen } = args;
    serve(Serving {
        listen,
        open: Box::new(move || open(&machine, output)),
        told: Box::new(move |text| output.note(text)),
    })?;
    Ok(None)
}

fn open(args: &MachineArgs, output: Output) -> Result<(Machine, Store, Box<dyn Any>), Failure> {
    let Session {
        machine,
        store,
        lease,
    } = Session::open(args, "serve", Use::Measurement, output)?;
    Ok((machine, store, Box::new(lease)))
}
