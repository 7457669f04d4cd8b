//! TLS towards a service, and the certificate that it is believed by.

use std::env;
use std::io;
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::time::Duration;

use rustls::crypto::ring::default_provider;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, ServerName};
use rustls::{ClientConfig, ClientConnection, RootCertStore, StreamOwned};

/// The file (PEM) of the certificates that a service is believed by: its own, or that of who signed it.
const CA: &str = "TRUESTAGE_CA";

/// A connection to `address`, which is `HOST:PORT`; nothing has been said over it yet.
pub(super) fn connect(
    address: &str,
    patience: Duration,
) -> io::Result<StreamOwned<ClientConnection, TcpStream>> {
    let host = address.rsplit_once(':').map_or(address, |it| it.0);
    let host = host.trim_matches(['[', ']']).to_owned();
    let name = ServerName::try_from(host).map_err(invalid)?;
    let builder = ClientConfig::builder_with_provider(Arc::new(default_provider()));
    let builder = builder.with_safe_default_protocol_versions();
    let builder = builder.map_err(invalid)?.with_root_certificates(roots()?);
    let config = Arc::new(builder.with_no_client_auth());
    let mut stream = open(address, patience)?;
    stream.set_read_timeout(Some(patience))?;
    let mut connection = ClientConnection::new(config, name).map_err(invalid)?;
    // Whoever is not who he must be is told so here, and hears no token.
    while connection.is_handshaking() {
        connection.complete_io(&mut stream).map_err(disbelieved)?;
    }
    Ok(StreamOwned::new(connection, stream))
}

/// A connection to the first place that `address` (`HOST:PORT`) names where somebody answers; `patience` for each.
pub(super) fn open(address: &str, patience: Duration) -> io::Result<TcpStream> {
    let mut refused = None;
    for place in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&place, patience) {
            Ok(stream) => return Ok(stream),
            Err(error) => refused = Some(error),
        }
    }
    Err(refused.unwrap_or_else(|| invalid("this name has no address")))
}

fn roots() -> io::Result<RootCertStore> {
    let path = env::var_os(CA).filter(|it| !it.is_empty());
    let path = path.ok_or_else(|| {
        invalid(format!(
            "{CA} in the environment must name the file of the service's certificate (PEM), or of who signed it"
        ))
    })?;
    let mut roots = RootCertStore::empty();
    let read =
        CertificateDer::pem_file_iter(&path).and_then(Iterator::collect::<Result<Vec<_>, _>>);
    let read = read.map_err(|it| invalid(format!("{CA} = {}: {it}", path.display())))?;
    let (known, _) = roots.add_parsable_certificates(read);
    match known {
        0 => Err(invalid(format!(
            "{CA} = {}: no certificate is in it",
            path.display()
        ))),
        _ => Ok(roots),
    }
}

fn invalid(what: impl Into<Box<dyn core::error::Error + Send + Sync>>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, what)
}

/// What rustls says of a certificate is short.
fn disbelieved(error: io::Error) -> io::Error {
    match error.kind() {
        io::ErrorKind::InvalidData => {
            let what = format!(
                "{error}; {CA} must name the certificate of this very service, and its address must be one of the names \
                 in that (docs/service.md, \"Beyond this computer\")"
            );
            io::Error::new(io::ErrorKind::InvalidData, what)
        }
        _ => error,
    }
}
