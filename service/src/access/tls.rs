//! TLS of the service: a certificate and its key from PEM files, taken anew when they have changed.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use rustls::ServerConfig;
use rustls::crypto::ring::default_provider;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, pem};

use super::secret_file::{SecretError, check};
use super::watched::Watched;

/// A certificate or a key that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum TlsError {
    /// The key's file cannot be read, or others may read it.
    #[error(transparent)]
    File(#[from] SecretError),
    /// No PEM, or none of what is needed.
    #[error("{}: no {what} in PEM form ({source}); docs/service.md has the openssl command that makes one", path.display())]
    Pem {
        /// Which file.
        path: PathBuf,
        /// What was looked for.
        what: &'static str,
        /// What was seen.
        source: pem::Error,
    },
    /// They do not belong together, or are of a kind that nobody takes.
    #[error("{} and {}: {source}; the key must be that of the first certificate", certificate.display(), key.display())]
    Pair {
        /// Which certificate.
        certificate: PathBuf,
        /// Which key.
        key: PathBuf,
        /// What rustls says.
        source: rustls::Error,
    },
}

/// Who the service proves to be.
pub(crate) struct Tls(Watched<ServerConfig, TlsError>);

impl Tls {
    pub(crate) fn open(certificate: PathBuf, key: PathBuf) -> Result<Self, TlsError> {
        let both = vec![certificate.clone(), key.clone()];
        Watched::open(both, move || config(&certificate, &key)).map(Self)
    }

    /// For the next connection. The last that could be used: a certificate and a key are not exchanged at the same moment.
    pub(crate) fn config(&self) -> Arc<ServerConfig> {
        self.0.last_good()
    }
}

fn config(certificate: &Path, key: &Path) -> Result<ServerConfig, TlsError> {
    let of = |path: &Path, what| {
        let path = path.to_owned();
        move |source| TlsError::Pem { path, what, source }
    };
    check(key)?;
    let chain = CertificateDer::pem_file_iter(certificate).and_then(Iterator::collect);
    let chain: Vec<_> = chain.map_err(of(certificate, "certificate"))?;
    let private = PrivateKeyDer::from_pem_file(key).map_err(of(key, "private key"))?;
    let builder = ServerConfig::builder_with_provider(Arc::new(default_provider()));
    let config = builder
        .with_safe_default_protocol_versions()
        .and_then(|it| it.with_no_client_auth().with_single_cert(chain, private));
    let mut config = config.map_err(|source| TlsError::Pair {
        certificate: certificate.to_owned(),
        key: key.to_owned(),
        source,
    })?;
    config.alpn_protocols = vec![b"http/1.1".to_vec()];
    Ok(config)
}
