//! What the sections of several drives and modules have in common.

use drivers::device::Identity;
use serde::Deserialize;

/// What a CANopen node must answer at start.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct IdentityConfig {
    pub device_type: u32,
    pub vendor_id: u32,
    pub product_code: u32,
    pub revision: Option<u32>,
    pub serial_number: Option<u32>,
}

impl IdentityConfig {
    /// The same as a driver says it, as far as the configuration does.
    pub fn configured(&self) -> Identity {
        Identity {
            device_type: self.device_type,
            vendor: self.vendor_id,
            product: self.product_code,
            revision: self.revision.unwrap_or(0),
            serial: self.serial_number.unwrap_or(0),
            name: String::new(),
        }
    }
}

/// What a drive takes its home offset (0x607C) for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum HomeOffsetName {
    /// The position at home, as many drives do.
    #[default]
    PositionAtHome,
    /// The way from home to zero, as CiA 402 has it.
    ZeroFromHome,
}

/// The option codes 0x605A to 0x605E of CiA 402; what is absent stays as the drive has it.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "configs/README.md documents each key")]
pub struct OptionCodesConfig {
    pub quick_stop: Option<i16>,
    pub shutdown: Option<i16>,
    pub disable: Option<i16>,
    pub halt: Option<i16>,
    pub fault_reaction: Option<i16>,
}
