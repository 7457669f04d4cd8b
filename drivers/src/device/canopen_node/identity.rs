//! Who a node is (CiA 301: 0x1000, 0x1008, 0x1018), and whether it is the right one.

use super::settings::NodeSettings;
use crate::device::{DeviceError, Identity};
use crate::protocol::script::{Script, Step};
use wire::canopen::Object;

pub(super) const DEVICE_TYPE: Object = Object::new(0x1000, 0);
const NAME: Object = Object::new(0x1008, 0);
const VENDOR: Object = Object::new(0x1018, 1);
const PRODUCT: Object = Object::new(0x1018, 2);
const REVISION: Object = Object::new(0x1018, 3);
const SERIAL: Object = Object::new(0x1018, 4);

pub(super) fn steps() -> Vec<Step> {
    const TEXT: &str = "reading its identity";
    vec![
        Step::read(DEVICE_TYPE, TEXT),
        Step::read(VENDOR, TEXT),
        Step::read(PRODUCT, TEXT).optional(),
        Step::read(REVISION, TEXT).optional(),
        Step::read(SERIAL, TEXT).optional(),
        Step::read(NAME, TEXT).optional(),
    ]
}

pub(super) fn from_script(script: &Script) -> Identity {
    let value = |object| script.value(object).unwrap_or(0);
    let name = script.data(NAME).unwrap_or_default();
    Identity {
        device_type: value(DEVICE_TYPE),
        vendor: value(VENDOR),
        product: value(PRODUCT),
        revision: value(REVISION),
        serial: value(SERIAL),
        name: String::from_utf8_lossy(name)
            .trim_end_matches(['\0', ' '])
            .to_owned(),
    }
}

/// Whether it is the device that the configuration means.
pub(super) fn check(
    settings: &NodeSettings,
    profile: u16,
    seen: &Identity,
) -> Result<(), DeviceError> {
    let node = settings.node;
    let expected = settings.expected;
    let profile = u32::from(profile);
    let checks = [
        ("device profile", Some(profile), seen.device_type & 0xFFFF),
        ("device type", expected.device_type, seen.device_type),
        ("vendor", expected.vendor, seen.vendor),
        ("product", expected.product, seen.product),
        ("revision", expected.revision, seen.revision),
        ("serial number", expected.serial, seen.serial),
    ];
    for (what, expected, seen) in checks {
        if let Some(expected) = expected.filter(|expected| *expected != seen) {
            return Err(DeviceError::WrongIdentity {
                node,
                what,
                expected,
                seen,
            });
        }
    }
    Ok(())
}
