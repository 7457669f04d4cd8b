//! Where the service is found, and what a place takes.

use core::fmt;
use core::str::FromStr;
use std::net::SocketAddr;
use std::path::PathBuf;

use crate::access::Access;

/// Where the service is found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Listen {
    /// A Unix socket, mode 0660.
    Unix(PathBuf),
    /// TCP as it is, on a loopback address.
    Tcp(SocketAddr),
    /// TCP with TLS and tokens, on any address.
    Tls(SocketAddr),
}

/// A place that is none, or that is open to others than may be let in.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ListenError {
    /// A word that is no place.
    #[error(
        "`{seen}` is no place to listen; write unix:PATH, tcp:127.0.0.1:PORT (this computer only) or tls:ADDRESS:PORT \
         (the network, with TLS and tokens)"
    )]
    NoPlace {
        /// As it was written.
        seen: String,
    },
    /// It is for the network, and there is nothing that keeps anybody out.
    #[error(
        "`{place}` takes TLS and tokens, so that not everybody on the network moves this machine: make a certificate \
         (docs/service.md, \"Beyond this computer\") and a token (`truestage token NAME --role operator`), then give \
         --tls-cert CERT.pem --tls-key KEY.pem --tokens tokens.toml; or listen at tcp:127.0.0.1:PORT, for this computer only"
    )]
    Open {
        /// As it was written.
        place: String,
    },
}

impl Listen {
    /// The place with what it takes: what is beyond this computer has TLS and tokens.
    ///
    /// # Errors
    /// When it needs them and they are not there.
    pub fn settle(self, access: &Access) -> Result<Self, ListenError> {
        let secured = match self {
            Self::Tcp(address) if !address.ip().is_loopback() => Self::Tls(address),
            other => other,
        };
        match secured {
            Self::Tls(_) if !access.is_for_the_network() => Err(ListenError::Open {
                place: secured.to_string(),
            }),
            settled => Ok(settled),
        }
    }

    /// What its text begins with.
    pub(super) const fn word(&self) -> &'static str {
        match self {
            Self::Unix(_) => "unix",
            Self::Tcp(_) => "tcp",
            Self::Tls(_) => "tls",
        }
    }
}

impl FromStr for Listen {
    type Err = ListenError;

    fn from_str(text: &str) -> Result<Self, ListenError> {
        let wrong = || ListenError::NoPlace {
            seen: text.to_owned(),
        };
        let address = |text: &str| text.parse().map_err(|_| wrong());
        match text.split_once(':').ok_or_else(wrong)? {
            ("unix", path) if !path.is_empty() => Ok(Self::Unix(path.into())),
            ("tcp", at) => Ok(Self::Tcp(address(at)?)),
            ("tls", at) => Ok(Self::Tls(address(at)?)),
            _ => Err(wrong()),
        }
    }
}

impl fmt::Display for Listen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let word = self.word();
        match self {
            Self::Unix(path) => write!(f, "{word}:{}", path.display()),
            Self::Tcp(address) | Self::Tls(address) => write!(f, "{word}:{address}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nobody_listens_to_the_network_without_tls_and_tokens() {
        for text in [
            "tcp:0.0.0.0:1",
            "tcp:192.168.0.1:80",
            "tcp:[::]:1",
            "tls:127.0.0.1:1",
            "tls:0.0.0.0:1",
        ] {
            let place: Listen = text.parse().unwrap();
            let refused = place.settle(&Access::default()).unwrap_err().to_string();
            for what in ["--tls-cert", "--tls-key", "--tokens", "truestage token"] {
                assert!(refused.contains(what), "{refused}");
            }
        }
        for text in ["tcp:1", "unix:", "http", "tls:stage", "https://0.0.0.0:1"] {
            assert!(text.parse::<Listen>().is_err(), "{text}");
        }
        for text in [
            "tcp:127.0.0.1:8470",
            "tcp:[::1]:8470",
            "unix:/run/truestage.sock",
        ] {
            let place: Listen = text.parse().unwrap();
            let settled = place.settle(&Access::default()).unwrap();
            assert_eq!(settled.to_string(), text);
        }
    }
}
