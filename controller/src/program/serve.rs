//! `truestage serve`: a machine for whoever keeps it, opened on the thread that does.

use std::any::Any;
use std::io;
use std::path::{self, PathBuf};
use std::sync::{Arc, OnceLock, Weak};

use crate::ports::Use;
use crate::program::kind::KINDS;
use crate::program::output::{Ended, Output};
use crate::program::report::html;
use crate::program::session::Session;
use crate::program::{MachineArgs, json};
use crate::runs::Teller;
use crate::{Failure, Machine};
use machine::records::{Lease, Store};

/// A machine, where its records are, and what must be held as long as it is used.
type Opening = dyn FnOnce() -> Result<(Machine, Store, Box<dyn Any>), Failure> + Send;

/// Tells whoever finds the machine in use where its keeper listens.
type Announcing = dyn Fn(&[String]) -> io::Result<()>;

/// What `truestage serve` is asked for: a machine that is to be kept for others.
pub struct Serving {
    /// Where it is to be found: `unix:PATH`, `tcp:127.0.0.1:PORT`, `tls:ADDRESS:PORT`.
    pub listen: Vec<String>,
    /// What opens it to the network.
    pub network: Network,
    /// Opens it; called once, on the thread that keeps it.
    pub open: Box<Opening>,
    /// Says what it gave, as the command line does.
    pub teller: Teller,
    /// Writes down where it is found, for whoever finds the machine in use.
    pub announce: Box<Announcing>,
    /// Tells whoever started it something.
    pub told: Arc<dyn Fn(&str) + Send + Sync>,
}

/// A machine that is kept, and where it is found.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct ServeArgs {
    #[command(flatten)]
    machine: MachineArgs,
    /// Where: `unix:PATH` (mode 0660), `tcp:127.0.0.1:PORT` for everybody on this computer, or `tls:ADDRESS:PORT` for
    /// the network, with --tls-cert, --tls-key and --tokens. May be given several times.
    #[arg(long, value_name = "PLACE", default_value = "unix:truestage.sock")]
    listen: Vec<String>,
    #[command(flatten)]
    network: Network,
}

/// What opens a service to the network.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct Network {
    /// Beyond this computer: the certificate in PEM form.
    #[arg(long, value_name = "PEM")]
    pub tls_cert: Option<PathBuf>,
    /// Its key; nobody else may read the file.
    #[arg(long, value_name = "PEM")]
    pub tls_key: Option<PathBuf>,
    /// Who may ask, and what: the file that `truestage token` writes.
    #[arg(long, value_name = "FILE")]
    pub tokens: Option<PathBuf>,
    /// Ask for a token on the Unix socket and on loopback, too.
    #[arg(long)]
    pub require_token: bool,
}

/// Keeps the machine until somebody ends it.
pub(crate) fn run(
    args: ServeArgs,
    output: Output,
    serve: fn(Serving) -> Result<(), Failure>,
) -> Ended {
    let ServeArgs {
        machine,
        listen,
        network,
    } = args;
    let taken: Arc<OnceLock<Weak<Lease>>> = Arc::default();
    let lease = Arc::clone(&taken);
    serve(Serving {
        listen,
        network,
        open: Box::new(move || {
            let session = Session::open(&machine, "serve", Use::Measurement, output)?;
            let own = Arc::new(session.lease);
            // It is opened once.
            let _ = lease.set(Arc::downgrade(&own));
            Ok((
                session.machine,
                session.store,
                Box::new((session.records, own)),
            ))
        }),
        // Pages of journals of any kind: whatever has worked on this machine left its own.
        teller: Teller {
            counters: |machine| json::counters(&machine.devices().counters()),
            page: html,
            words: KINDS.iter().map(|kind| kind.words).collect(),
        },
        announce: Box::new(move |places| announce(&taken, places)),
        told: Arc::new(move |text| output.note(text)),
    })?;
    Ok(None)
}

/// Whoever finds the machine in use may be in another folder.
fn announce(taken: &OnceLock<Weak<Lease>>, places: &[String]) -> io::Result<()> {
    let Some(lease) = taken.get().and_then(Weak::upgrade) else {
        return Ok(());
    };
    let places = places.iter().map(|it| match it.strip_prefix("unix:") {
        Some(path) => Ok(format!("unix:{}", path::absolute(path)?.display())),
        None => Ok(it.clone()),
    });
    lease.announce(&places.collect::<io::Result<Vec<_>>>()?)
}
