//! The error register, the error history and emergency messages (CiA 301, 7.2.7, 7.5.2.2-4).

use wire::canopen::emcy::{Emergency, EmergencyCode};

/// The most errors 0x1003 remembers.
pub(super) const HISTORY: usize = 8;

/// The bits of the error register 0x1001.
pub mod register {
    /// Any error.
    pub const GENERIC: u8 = 0x01;
    /// Current.
    pub const CURRENT: u8 = 0x02;
    /// Voltage.
    pub const VOLTAGE: u8 = 0x04;
    /// Communication.
    pub const COMMUNICATION: u8 = 0x10;
    /// Specific to the device profile.
    pub const PROFILE: u8 = 0x20;
    /// Specific to the manufacturer.
    pub const MANUFACTURER: u8 = 0x80;
}

/// The errors that are present, and those that were.
#[derive(Clone, Debug, Default)]
pub(super) struct Errors {
    present: Vec<(EmergencyCode, u8)>,
    /// The newest first, as 0x1003 gives them.
    pub(super) history: Vec<u32>,
}

impl Errors {
    pub(super) fn register(&self) -> u8 {
        let bits = self.present.iter().fold(0, |all, (_, bits)| all | bits);
        if self.present.is_empty() {
            0
        } else {
            bits | register::GENERIC
        }
    }

    /// The message of a new error; `None` when it is already known.
    pub(super) fn raise(
        &mut self,
        code: EmergencyCode,
        bits: u8,
        detail: [u8; 5],
    ) -> Option<Emergency> {
        if self.present.iter().any(|(known, _)| *known == code) {
            return None;
        }
        self.present.push((code, bits));
        let extra = u32::from(detail[0]) | u32::from(detail[1]) << 8;
        self.history.insert(0, u32::from(code.0) | extra << 16);
        self.history.truncate(HISTORY);
        Some(self.message(code, detail))
    }

    /// The message that an error went away; `None` when it was not there.
    pub(super) fn clear(&mut self, code: EmergencyCode) -> Option<Emergency> {
        let before = self.present.len();
        self.present.retain(|(known, _)| *known != code);
        (self.present.len() < before).then(|| self.message(EmergencyCode::CLEARED, [0; 5]))
    }

    fn message(&self, code: EmergencyCode, detail: [u8; 5]) -> Emergency {
        Emergency {
            code,
            register: self.register(),
            detail,
        }
    }
}
