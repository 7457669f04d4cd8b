//! Random numbers of the operating system, and hexadecimal digits.

use core::fmt::Write as _;
use std::io;

use ring::rand::{SecureRandom as _, SystemRandom};

/// Draws `N` bytes.
///
/// # Errors
/// When the system has none.
pub(crate) fn draw_bytes<const N: usize>() -> io::Result<[u8; N]> {
    let mut bytes = [0; N];
    let drawn = SystemRandom::new().fill(&mut bytes);
    drawn.map_err(|_| io::Error::other("the system gives no random numbers"))?;
    Ok(bytes)
}

/// Writes `bytes` in hexadecimal digits.
pub(crate) fn write_hex(bytes: &[u8]) -> String {
    let mut text = String::new();
    for byte in bytes {
        // To write into a text cannot fail.
        let _ = write!(text, "{byte:02x}");
    }
    text
}
