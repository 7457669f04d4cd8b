//! Buses and what passes on them, for a person.

use wire::LinkState;
use wire::can::CanId;

/// With all the digits that it can have, as it stands in a log of the bus.
///
/// # Example
///
/// ```
/// use machine::identifier_text;
/// use wire::can::CanId;
///
/// assert_eq!(identifier_text(CanId::Standard(0x81)), "identifier 0x081");
/// assert_eq!(identifier_text(CanId::Extended(0x81)), "29-bit identifier 0x00000081");
/// ```
pub fn identifier_text(id: CanId) -> String {
    match id {
        CanId::Standard(raw) => format!("identifier {raw:#05X}"),
        CanId::Extended(raw) => format!("29-bit identifier {raw:#010X}"),
    }
}

/// What became of a bus or line.
pub fn link_text(state: LinkState) -> &'static str {
    match state {
        LinkState::Up => "came back; start the machine again",
        LinkState::Down => {
            "down: the interface was set down (ENETDOWN), or the adapter no longer answers; set it \
             up and start again"
        }
        LinkState::Gone => {
            "the interface or adapter has disappeared (ENODEV); plug it in and start again"
        }
    }
}
