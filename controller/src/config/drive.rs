//! What the sections of several drives and modules have in common.

use drivers::device::Identity;
use schemars::JsonSchema;
use serde::Deserialize;

/// Who a CANopen node must be.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IdentityConfig {
    /// 0x1000.
    pub device_type: u32,
    /// 0x1018:01.
    pub vendor_id: u32,
    /// 0x1018:02.
    pub product_code: u32,
    /// 0x1018:03.
    pub revision: Option<u32>,
    /// 0x1018:04.
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum HomeOffsetName {
    /// The position at home, as many drives do.
    #[default]
    PositionAtHome,
    /// The way from home to zero, as CiA 402 has it.
    ZeroFromHome,
}

/// The option codes of CiA 402; what is absent stays as the drive has it.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OptionCodesConfig {
    /// 0x605A.
    pub quick_stop: Option<i16>,
    /// 0x605B.
    pub shutdown: Option<i16>,
    /// 0x605C.
    pub disable: Option<i16>,
    /// 0x605D.
    pub halt: Option<i16>,
    /// 0x605E.
    pub fault_reaction: Option<i16>,
}
