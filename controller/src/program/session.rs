//! A machine for one verb: configuration, lease, ports, Ctrl-C.

use std::fs::{File, OpenOptions};
use std::io::{BufWriter, ErrorKind};
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use drivers::transport::Transport;
use drivers::transport::record::Recorder;
use machine::kept_zero;
use machine::records::{DiskPace, Lease};

use crate::config::{self, Loaded};
use crate::ports::{self, Overrides, Use};
use crate::program::behind::Behind;
use crate::program::output::Output;
use crate::program::progress::Bars;
use crate::program::signals::stop_on_signals;
use crate::program::streams::END_LIMIT;
use crate::program::{AxisArgs, MachineArgs};
use crate::{Failure, Machine, assemble};
use machine::records::Store;

/// Verbs by which nothing moves, whatever the configuration says.
const STILL: [&str; 3] = ["align", "reset", "scan"];

/// A machine that is connected and leased to this process.
pub(crate) struct Session {
    pub(crate) machine: Machine,
    pub(crate) store: Store,
    /// Dropped before the lease is given back.
    pub(crate) records: Records,
    /// Held for as long as the machine is used.
    pub(crate) lease: Lease,
}

/// The records of a machine; what was ordered at last is waited for when this is dropped.
pub(crate) struct Records(Store);

impl Drop for Records {
    fn drop(&mut self) {
        let begun = Instant::now();
        while self.0.waiting() > 0 && begun.elapsed() < END_LIMIT {
            thread::sleep(Duration::from_millis(1));
        }
    }
}

impl Session {
    /// Reads the configuration, takes the lease, opens the ports. Nothing is sent.
    pub(crate) fn open(
        args: &MachineArgs,
        verb: &str,
        purpose: Use,
        output: Output,
    ) -> Result<Self, Failure> {
        let mut loaded = config::load(&args.config)?;
        if !STILL.contains(&verb) {
            loaded.filled_in()?;
        }
        let overrides = Overrides::parse(&args.ports, &loaded.config)?;
        if let Some(path) = &args.record {
            refuse_existing(path)?;
        }
        let store = loaded.config.machine.store();
        let lease = Lease::take(&store, verb)?;
        output.detail(|| {
            let root = store.root().display();
            let file = args.config.display();
            format!("{file} was read; records are in {root}, which this process has now")
        });
        let pace = args.pace(verb)?;
        loaded.patience = pace.patience();
        let of_disk = pace.of_disk();
        let ordered = store.ordered(of_disk);
        let store = ordered.map_err(|source| Failure::File {
            path: store.root().to_owned(),
            source,
        })?;
        let transport = ports::open(&loaded.config, &overrides, purpose, pace)?;
        output.detail(|| {
            let names: Vec<String> = assemble::ports(&loaded.config).into_keys().collect();
            format!("{}: open, nothing was sent yet", names.join(", "))
        });
        let transport = recorded(transport, args, &loaded, of_disk)?;
        let mut machine = Machine::new(&loaded, transport);
        kept_zero::keep(&mut machine, store.clone(), loaded.text.as_str().to_owned());
        machine.in_real_time();
        machine.observe(Box::new(output.bars(Bars::new)));
        stop_on_signals(&machine.stop_request())?;
        Ok(Self {
            machine,
            records: Records(store.clone()),
            store,
            lease,
        })
    }
}

fn recorded(
    transport: impl Transport + 'static,
    args: &MachineArgs,
    loaded: &Loaded,
    of_disk: DiskPace,
) -> Result<Box<dyn Transport>, Failure> {
    let Some(path) = &args.record else {
        return Ok(Box::new(transport));
    };
    let failed = |source| Failure::File {
        path: path.clone(),
        source,
    };
    let log = Behind::new(new_file(path)?, of_disk).map_err(failed)?;
    let log = BufWriter::new(log);
    let ports = assemble::ports(&loaded.config);
    let names: Vec<_> = ports
        .iter()
        .map(|(name, port)| (*port, name.as_str()))
        .collect();
    Ok(Box::new(
        Recorder::new(transport, log, &names).map_err(failed)?,
    ))
}

/// Yesterday's record is not written over; said before anything is opened.
fn refuse_existing(path: &Path) -> Result<(), Failure> {
    if !path.is_file() {
        return Ok(());
    }
    Err(Failure::Usage {
        what: format!("--record {}: this file already exists", path.display()),
        help: "it was not changed; give another name, or move it away".into(),
    })
}

/// A file for a record, or what takes records and is no file (a pipe, `/dev/null`).
fn new_file(path: &Path) -> Result<File, Failure> {
    let failed = |source| Failure::File {
        path: path.to_owned(),
        source,
    };
    match File::create_new(path) {
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {
            refuse_existing(path)?;
            OpenOptions::new().write(true).open(path).map_err(failed)
        }
        created => created.map_err(failed),
    }
}

/// The axis asked for, or the only one of `names`.
pub(crate) fn choose_axis(names: Vec<String>, args: &AxisArgs) -> Result<String, Failure> {
    match (&args.axis, names.as_slice()) {
        (Some(axis), known) if known.contains(axis) => Ok(axis.clone()),
        (Some(axis), known) => Err(Failure::Machine(machine::Failure::NoSuchAxis {
            axis: axis.clone(),
            known: known.join(", "),
        })),
        (None, [only]) => Ok(only.clone()),
        (None, _) => Err(Failure::Usage {
            what: "the machine has several axes".into(),
            help: format!("add --axis with one of {}", names.join(", ")),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_never_takes_the_place_of_a_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bus.log");
        new_file(&path).unwrap();
        std::fs::write(&path, "yesterday").unwrap();
        let refused = new_file(&path).unwrap_err();
        assert_eq!(refused.exit_code(), 2);
        let said = refused.to_string();
        assert!(
            said.contains("bus.log") && said.contains("another name"),
            "{said}"
        );
        assert_eq!(std::fs::read(&path).unwrap(), b"yesterday");
        new_file(Path::new("/dev/null")).unwrap();
    }
}
