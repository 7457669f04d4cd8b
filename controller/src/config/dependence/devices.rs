//! Which device a part of the configuration means: where it is, and who it must be.

use super::text::Place;
use crate::config::model::MachineConfig;
use crate::hardware::analog::AnalogConfig;
use crate::hardware::node::IdentityConfig;

pub(crate) fn say_identity(mut place: Place<'_>, identity: &IdentityConfig) {
    place.say("device_type", identity.device_type);
    place.say("vendor_id", identity.vendor_id);
    place.say("product_code", identity.product_code);
    place.say("revision", identity.revision);
    place.say("serial_number", identity.serial_number);
}

/// Which module a name stands for: where it is, and who it must be. The name itself may change.
pub(crate) fn say_module(mut place: Place<'_>, config: &MachineConfig, name: &str) {
    let module: Option<&AnalogConfig> = config.analog.get(name);
    let Some(module) = module else { return };
    let node = module.node();
    place.say("bus", node.map(|it| &it.bus));
    place.say("node_id", node.map(|it| it.node_id));
    place.say("line", node.is_none().then(|| module.port().to_owned()));
    place.say("address", module.address());
    if let Some(node) = node {
        say_identity(place.at("identity"), &node.identity);
    }
}
