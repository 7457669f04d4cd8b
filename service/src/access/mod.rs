//! Who is let in over the network, and as whom: TLS, tokens, roles.
//!
//! On a Unix socket and on loopback nobody needs a token unless that is asked for: the system says who may open the
//! first, and the second is for everybody on this computer. Beyond loopback nothing is listened to without both.

mod role;
mod secret_file;
mod tls;
mod tokens;
mod watched;

use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

pub use role::{Role, RoleError};
pub use secret_file::SecretError;
pub(crate) use tls::Tls;
pub use tls::TlsError;
pub(crate) use tokens::{Owner, Tokens};
pub use tokens::{TokenError, add_token};
use watched::Watched;

/// What opens the service to the network.
#[derive(Clone, Debug, Default)]
pub struct AccessFiles {
    /// The certificate, and those up to the one that clients trust, in PEM form.
    pub certificate: Option<PathBuf>,
    /// Its key.
    pub key: Option<PathBuf>,
    /// Names, roles and hashes of tokens.
    pub tokens: Option<PathBuf>,
    /// Whether a token is asked for on the Unix socket and on loopback, too.
    pub everywhere: bool,
}

/// What of it cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum AccessError {
    /// The certificate or its key.
    #[error(transparent)]
    Tls(#[from] TlsError),
    /// The tokens.
    #[error(transparent)]
    Tokens(#[from] TokenError),
    /// One is given without what belongs to it.
    #[error("{given} is given without {missing}")]
    Half {
        /// What is there.
        given: &'static str,
        /// What is not.
        missing: &'static str,
    },
}

/// Who is let in, and as whom. The default lets nobody in beyond this computer.
#[derive(Clone, Default)]
pub struct Access {
    pub(crate) tls: Option<Arc<Tls>>,
    pub(crate) tokens: Option<Arc<KnownTokens>>,
    pub(crate) everywhere: bool,
    /// Says to the person who started the service what is wrong with its files.
    pub(crate) say: Option<Say>,
}

/// Says a line without ever waiting.
pub(crate) type Say = Arc<dyn Fn(&str) + Send + Sync>;

impl fmt::Debug for Access {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Access")
            .field("tls", &self.tls.is_some())
            .field("tokens", &self.tokens.is_some())
            .field("everywhere", &self.everywhere)
            .finish()
    }
}

impl Access {
    /// Reads what is given; it is read again when it has changed.
    ///
    /// # Errors
    /// When a file cannot be used, or what belongs to it is missing.
    pub fn open(files: AccessFiles) -> Result<Self, AccessError> {
        let half = |given, missing| Err(AccessError::Half { given, missing });
        let tls = match (files.certificate, files.key) {
            (Some(certificate), Some(key)) => Some(Arc::new(Tls::open(certificate, key)?)),
            (Some(_), None) => return half("--tls-cert", "--tls-key"),
            (None, Some(_)) => return half("--tls-key", "--tls-cert"),
            (None, None) => None,
        };
        let tokens = match files.tokens {
            Some(path) => Some(Arc::new(KnownTokens::open(path)?)),
            None if files.everywhere => return half("--require-token", "--tokens"),
            None => None,
        };
        Ok(Self {
            tls,
            tokens,
            everywhere: files.everywhere,
            say: None,
        })
    }

    /// The same, which says by `say` what is wrong with its files. `say` must not wait.
    #[must_use]
    pub fn saying(mut self, say: Arc<dyn Fn(&str) + Send + Sync>) -> Self {
        self.say = Some(say);
        self
    }

    /// Whether it may be listened to beyond this computer.
    pub(crate) const fn is_for_the_network(&self) -> bool {
        self.tls.is_some() && self.tokens.is_some()
    }
}

/// The tokens as their file says them now.
pub(crate) struct KnownTokens(Watched<Tokens, TokenError>);

impl KnownTokens {
    fn open(path: PathBuf) -> Result<Self, TokenError> {
        let files = vec![path.clone()];
        Watched::open(files, move || Tokens::read(&path)).map(Self)
    }

    /// Whose `token` is.
    ///
    /// # Errors
    /// When the file has been changed into one that cannot be used: nobody is let in by it then.
    pub(crate) fn owner(&self, token: &str) -> Result<Option<Owner>, Arc<TokenError>> {
        Ok(self.0.newest()?.owner(token).cloned())
    }

    /// Whose `token` was when the file could be used last: a slip in it takes the stop from nobody.
    pub(crate) fn owner_before(&self, token: &str) -> Option<Owner> {
        self.0.last_good().owner(token).cloned()
    }

    /// What is wrong with the file now.
    pub(crate) fn trouble(&self) -> Option<Arc<TokenError>> {
        self.0.newest().err()
    }
}
