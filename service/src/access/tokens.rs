//! Who may ask over the network: names, roles, and hashes of tokens, in a file that others cannot read.
//!
//! A token is 256 random bits, so its hash is a plain SHA-256: nobody can try so many, and a slow hash with a salt,
//! which words that people choose need, would only let whoever asks keep the computer busy.

use std::collections::BTreeSet;
use std::fs::OpenOptions;
use std::io::{self, Write as _};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

use ring::digest;
use serde::Deserialize;

use super::role::{Role, RoleError};
use super::secret_file::{SecretError, check, io_of, read};
use crate::random::{draw_bytes, write_hex};

/// So many random bytes a token has.
const RANDOM: usize = 32;
/// So long a name may be.
const NAME_MAX: usize = 64;
/// Others may not read it; members of the service's group may, who find only hashes.
const MODE: u32 = 0o640;
/// What a new file begins with.
const HEAD: &str = "\
# Who may ask the service over the network: `truestage token NAME --role ROLE` adds one, and a [[token]] that is taken
# out is not let in any more; the service need not be started again. Only hashes (SHA-256) are here.
";

/// A file of tokens that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum TokenError {
    /// It cannot be read or written, or others may read it.
    #[error(transparent)]
    File(#[from] SecretError),
    /// It is no file of tokens.
    #[error("{}:{line}: {what}; each [[token]] has name, role, sha256 and made, as `truestage token` writes them", path.display())]
    Syntax {
        /// Which file.
        path: PathBuf,
        /// In which line.
        line: usize,
        /// What is wrong.
        what: String,
    },
    /// One of its entries.
    #[error("{}: token of `{name}`: {what}", path.display())]
    Entry {
        /// Which file.
        path: PathBuf,
        /// Whose.
        name: String,
        /// What is wrong.
        what: String,
    },
    /// Nobody could ask.
    #[error("{}: it has no [[token]]; make one with `truestage token NAME --role operator`", path.display())]
    Empty {
        /// Which file.
        path: PathBuf,
    },
    /// A name that would have to be escaped somewhere.
    #[error(
        "`{name}` is no name for the owner of a token: give 1 to {NAME_MAX} letters, digits, spaces and . - _ @"
    )]
    Name {
        /// As it was given.
        name: String,
    },
    /// It has a token.
    #[error(
        "`{name}` has a token in {}; take that [[token]] out of the file first, or give another name, `{name}-2`",
        path.display()
    )]
    Taken {
        /// Whose.
        name: String,
        /// Which file.
        path: PathBuf,
    },
    /// A word that is no role.
    #[error(transparent)]
    Role(#[from] RoleError),
    /// The system has no random numbers.
    #[error("no token can be made: {0}")]
    Random(io::Error),
}

/// Whose a token is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Owner {
    pub(crate) name: String,
    pub(crate) role: Role,
}

/// Who is known.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Tokens(Vec<([u8; 32], Owner)>);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    token: Vec<Entry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    name: String,
    role: String,
    sha256: String,
    /// For people.
    #[serde(default, rename = "made")]
    _made: String,
}

impl Tokens {
    /// Those in `path`.
    pub(crate) fn read(path: &Path) -> Result<Self, TokenError> {
        let tokens = Self::parse(path, &read(path)?)?;
        match tokens.0.is_empty() {
            true => Err(TokenError::Empty { path: path.into() }),
            false => Ok(tokens),
        }
    }

    fn parse(path: &Path, text: &str) -> Result<Self, TokenError> {
        let file: File = toml::from_str(text).map_err(|error: toml::de::Error| {
            let before = error.span().map_or(0, |it| it.start).min(text.len());
            TokenError::Syntax {
                path: path.into(),
                line: text.as_bytes()[..before]
                    .iter()
                    .filter(|it| **it == b'\n')
                    .count()
                    + 1,
                what: error.message().to_owned(),
            }
        })?;
        let mut names = BTreeSet::new();
        let entries = file.token.into_iter().map(|entry| {
            let wrong = |what: String| TokenError::Entry {
                path: path.into(),
                name: entry.name.clone(),
                what,
            };
            if !is_name(&entry.name) {
                return Err(TokenError::Name {
                    name: entry.name.clone(),
                });
            }
            if !names.insert(entry.name.clone()) {
                return Err(wrong("the name stands twice; take one of them out".into()));
            }
            let role = entry
                .role
                .parse()
                .map_err(|it: RoleError| wrong(it.to_string()))?;
            let hash = bytes_of(&entry.sha256).ok_or_else(|| {
                wrong("sha256 is not 64 hexadecimal digits; make the token again".into())
            })?;
            let name = entry.name.clone();
            Ok((hash, Owner { name, role }))
        });
        entries.collect::<Result<_, _>>().map(Self)
    }

    /// Whose `token` is. Hashes are compared: how long that takes says nothing about a token.
    pub(crate) fn owner(&self, token: &str) -> Option<&Owner> {
        let hash = hash_of(token);
        let mut tokens = self.0.iter();
        tokens.find(|it| it.0 == hash).map(|it| &it.1)
    }
}

/// Adds a token for `name` to the file `path`, which is made when it is not there; `made` is when, for people. Returns the token, which
/// stands nowhere else.
///
/// # Errors
/// When the name has one already, or the file cannot be used.
pub fn add_token(path: &Path, name: &str, role: &str, made: &str) -> Result<String, TokenError> {
    let role: Role = role.parse()?;
    if !is_name(name) {
        return Err(TokenError::Name { name: name.into() });
    }
    let is_new = !path.exists();
    if !is_new {
        check(path)?;
        let known = Tokens::parse(path, &read(path)?)?;
        if known.0.iter().any(|it| it.1.name == name) {
            return Err(TokenError::Taken {
                name: name.into(),
                path: path.into(),
            });
        }
    }
    let token = draw_bytes::<RANDOM>().map_err(TokenError::Random)?;
    let token = write_hex(&token);
    let hash = write_hex(&hash_of(&token));
    let head = if is_new { HEAD } else { "" };
    let entry = format!(
        "{head}\n[[token]]\nname = \"{name}\"\nrole = \"{role}\"\nsha256 = \"{hash}\"\nmade = \"{made}\"\n"
    );
    let opened = OpenOptions::new()
        .create(true)
        .append(true)
        .mode(MODE)
        .open(path);
    let written = opened.and_then(|mut file| {
        file.write_all(entry.as_bytes())?;
        file.sync_all()
    });
    written.map_err(|source| io_of(path, source))?;
    Ok(token)
}

/// It stands in events, journals and pages, and in this file without any escape.
fn is_name(name: &str) -> bool {
    let is_plain = |it: char| it.is_alphanumeric() || " .-_@".contains(it);
    (1..=NAME_MAX).contains(&name.chars().count())
        && name.trim() == name
        && name.chars().all(is_plain)
}

fn hash_of(token: &str) -> [u8; 32] {
    let mut hash = [0; 32];
    hash.copy_from_slice(digest::digest(&digest::SHA256, token.as_bytes()).as_ref());
    hash
}

fn bytes_of(hex: &str) -> Option<[u8; 32]> {
    let mut bytes = [0; 32];
    if hex.len() != 64 || !hex.is_ascii() {
        return None;
    }
    for (at, byte) in bytes.iter_mut().enumerate() {
        *byte = u8::from_str_radix(&hex[2 * at..2 * at + 2], 16).ok()?;
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    const DAY: &str = "2026-03-01T08:00:00.000Z";

    #[test]
    fn a_token_is_shown_once_and_only_its_hash_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tokens.toml");
        let anna = add_token(&path, "anna", "operator", DAY).unwrap();
        let line_7 = add_token(&path, "line 7", "viewer", DAY).unwrap();
        assert_eq!((anna.len(), anna == line_7), (64, false));
        let text = fs::read_to_string(&path).unwrap();
        assert!(!text.contains(&anna) && !text.contains(&line_7), "{text}");
        let mode = fs::metadata(&path).unwrap().permissions().mode();
        assert_eq!(mode & 0o027, 0, "{mode:o}");
        let tokens = Tokens::read(&path).unwrap();
        let of = |token: &str| tokens.owner(token).map(|it| (it.name.as_str(), it.role));
        assert_eq!(of(&anna), Some(("anna", Role::Operator)));
        assert_eq!(of(&line_7), Some(("line 7", Role::Viewer)));
        assert_eq!(of(""), None);
        assert_eq!(of(&anna[1..]), None);
        // The hash is not a token.
        let hash = text.split("sha256 = \"").nth(1).unwrap();
        assert_eq!(of(&hash[..64]), None);
    }

    /// FIPS 180-4, the example of one block: what `printf abc | sha256sum` says.
    #[test]
    fn the_hash_is_what_sha256sum_says() {
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(write_hex(&hash_of("abc")), expected);
        assert_eq!(bytes_of(expected), Some(hash_of("abc")));
    }

    #[test]
    fn what_cannot_be_a_token_is_refused_and_nothing_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tokens.toml");
        for name in ["", " anna", "a\"b", "a\nb", "\u{1b}[31m", &"x".repeat(65)] {
            let refused = add_token(&path, name, "viewer", DAY).unwrap_err();
            assert!(matches!(refused, TokenError::Name { .. }), "{name:?}");
        }
        let refused = add_token(&path, "anna", "root", DAY).unwrap_err();
        assert!(refused.to_string().contains("commissioner"), "{refused}");
        assert!(!path.exists());
        add_token(&path, "anna", "viewer", DAY).unwrap();
        let before = fs::read_to_string(&path).unwrap();
        let refused = add_token(&path, "anna", "operator", DAY).unwrap_err();
        assert!(refused.to_string().contains("anna-2"), "{refused}");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o644)).unwrap();
        let refused = add_token(&path, "otto", "viewer", DAY).unwrap_err();
        assert!(refused.to_string().contains("chmod"), "{refused}");
        assert_eq!(fs::read_to_string(&path).unwrap(), before);
    }

    #[test]
    fn a_file_that_is_wrong_is_refused_with_its_line_and_never_with_what_it_keeps() {
        let path = Path::new("tokens.toml");
        let refused = |text: &str| Tokens::parse(path, text).unwrap_err().to_string();
        let hash = "0".repeat(64);
        let good = format!("[[token]]\nname = \"a\"\nrole = \"viewer\"\nsha256 = \"{hash}\"\n");
        assert!(Tokens::parse(path, &good).is_ok());
        let said = refused(&format!("{good}{good}"));
        assert!(said.contains("twice"), "{said}");
        let said = refused(&format!("{good}secret = 1\n"));
        assert!(
            said.contains("tokens.toml:5") && !said.contains(&hash),
            "{said}"
        );
        let said = refused("[[token]]\nname = \"a\"\nrole = \"boss\"\nsha256 = \"\"\n");
        assert!(said.contains("`boss` is no role"), "{said}");
        let said = refused("[[token]]\nname = \"a\"\nrole = \"viewer\"\nsha256 = \"abc\"\n");
        assert!(said.contains("64"), "{said}");
    }
}
