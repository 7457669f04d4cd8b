//! What only a position display can say.

use crate::device::{Alarm, DeviceName, OwnAlarm};

pub(super) const NAME: DeviceName = DeviceName::Serial("position display");

pub(super) const FAULTY: Alarm = Alarm::Own(&OwnAlarm {
    device: NAME,
    what: "the encoder's signals are faulty, its count is lost",
    remedy: "clean scale and scanning head, clear the error at the display, set a new datum",
});
pub(super) const SET_OTHERWISE: Alarm = Alarm::Own(&OwnAlarm {
    device: NAME,
    what: "its settings or the form of its values have changed",
    remedy: "set it back to one input, millimetres or inches, without a series; set a new datum",
});
pub(super) const JUMPED: Alarm = Alarm::Own(&OwnAlarm {
    device: NAME,
    what: "its value jumped further than the stage can move",
    remedy: "was it set to a value or to another datum? set a new datum",
});
