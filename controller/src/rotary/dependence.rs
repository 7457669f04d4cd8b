//! What calibrations of rotary tables depend on: lines of version 2 of that text
//! ([`crate::config::dependence`]). What was published stays as it is.

use crate::config::MachineConfig;
use crate::config::dependence::devices::say_identity;
use crate::config::dependence::text::{Place, by_its_word, quoted};
use crate::rotary::{DirectionName, RotaryConfig, RotaryDevice};

pub(crate) fn depends(config: &MachineConfig, top: &mut Place<'_>) {
    for (name, rotary) in &config.rotary {
        say_rotary(top.at("rotary").at(quoted(name)), rotary);
    }
}

fn say_rotary(mut place: Place<'_>, rotary: &RotaryConfig) {
    place.say("device", rotary.device);
    place.say("node_id", rotary.node.node_id);
    place.say("counts_per_turn", rotary.counts_per_turn);
    place.say("reverse", rotary.reverse);
    say_identity(place.at("identity"), &rotary.node.identity);
    if let Some(zero) = &rotary.zero {
        let mut place = place.at("zero");
        place.say("index_direction", zero.index_direction);
        place.say("index_deg", zero.index_deg);
    }
}

by_its_word! {
    RotaryDevice { Cia402: "cia402" }
    DirectionName { Forward: "forward", Reverse: "reverse" }
}
