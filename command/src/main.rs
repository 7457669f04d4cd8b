//! The command `truestage`: the command line of the library, with the service that `truestage serve` keeps a
//! machine by. It is the only package that knows both.

use std::io;
use std::process::ExitCode;
use std::sync::Arc;

use service::{
    Access, AccessFiles, Edge, Listen, ListenError, Manager, Opened, Service, StartError,
};
use truestage::{Failure, Serving};

fn main() -> ExitCode {
    truestage::main(
        serve,
        |new| {
            let made = service::add_token(&new.file, &new.name, new.role, &new.made);
            made.map_err(|it| refused("truestage token", &it))
        },
        service::failure_code,
        env!("TRUESTAGE_VERSION"),
    )
}

/// Keeps a machine until somebody ends it.
fn serve(serving: Serving) -> Result<(), Failure> {
    let Serving {
        listen,
        network,
        open,
        teller,
        announce,
        told,
    } = serving;
    // Before the machine is touched.
    let access = Access::open(AccessFiles {
        certificate: network.tls_cert,
        key: network.tls_key,
        tokens: network.tokens,
        everywhere: network.require_token,
    });
    let access = access.map_err(|it| refused("truestage serve", &it))?;
    let access = access.saying(Arc::clone(&told));
    let places = places_of(&listen, &access).map_err(|it| refused("--listen", &it))?;
    let manager = Manager::of_environment();
    let say = |text: &str| manager.iter().for_each(|it| it.say(text));
    say("starting the machine");
    let service = Service::start(move || {
        let (machine, store, held) = open()?;
        Ok(Opened {
            machine,
            store,
            held,
            teller: Some(teller),
        })
    });
    let mut service = service.map_err(|failure| {
        say(&failure.to_string());
        match failure {
            StartError::Machine(failure) => failure,
            other => refused("truestage serve", &other),
        }
    })?;
    match Edge::open(service.desk(), &places, &access) {
        Ok(edge) => {
            let places: Vec<_> = edge.places().iter().map(ToString::to_string).collect();
            for place in &places {
                told(&format!("listening at {place}"));
            }
            if let Err(error) = announce(&places) {
                told(&format!(
                    "the lease cannot say where that is ({error}); give `truestage status` and `stop` --at"
                ));
            }
            if let Some(Err(error)) = manager.map(|it| service.report_to(it)) {
                told(&untold(&error));
            }
            let ended = service.wait();
            drop(edge);
            ended
        }
        Err(error) => {
            // Nobody could ask this machine anything: its drives are switched off again.
            let _ = service
                .desk()
                .end(&service::Caller::named("truestage serve"));
            service.wait()?;
            Err(refused("--listen", &error))
        }
    }
}

/// Those of this computer first: verbs that find the machine in use ask at the first one.
fn places_of(listen: &[String], access: &Access) -> Result<Vec<Listen>, ListenError> {
    let places = listen.iter().map(|it| it.parse::<Listen>()?.settle(access));
    let mut places: Vec<_> = places.collect::<Result<_, _>>()?;
    places.sort_by_key(|it| matches!(it, Listen::Tls(_)));
    Ok(places)
}

/// The machine is there for whoever asks it, whatever its manager thinks.
fn untold(error: &io::Error) -> String {
    format!(
        "the service manager was not told that the service is ready: {error}; NOTIFY_SOCKET names its socket, and \
         systemd ends a service that it does not hear of (NotifyAccess=main allows it)"
    )
}

fn refused(what: &str, why: &dyn std::error::Error) -> Failure {
    Failure::Usage {
        what: format!("{what}: {why}"),
        help: "see `truestage help serve` and docs/service.md".into(),
    }
}
