//! SDO abort codes (CiA 301, table 22): why a device did not read or write an object.

use wire::canopen::sdo::AbortCode;

use super::Advice;

const TRANSFER: &str =
    "frames of one transfer were lost, or two programs talk to the same device at once";
const ONE_MASTER: &str = "make sure that this program is the only one that configures the device; then look at the bus for errors";
const OTHER_DEVICE: &str =
    "the device is another one than the configuration says, or has another firmware";
const COMPARE: &str = "compare device and firmware with the machine's file: `truestage scan machine.toml` shows who it says it is";

/// Of the codes that stand together.
const ADVICE: &[(&[AbortCode], Advice)] = &[
    (
        &[
            AbortCode::ToggleNotAlternated,
            AbortCode::InvalidSequence,
            AbortCode::CrcMismatch,
        ],
        Advice {
            cause: TRANSFER,
            next: ONE_MASTER,
        },
    ),
    (
        &[AbortCode::TimedOut],
        Advice {
            cause: "the device waited too long for the next frame of a transfer: this computer or the bus was held up",
            next: "look at the bus load and at what else the computer does; then try again",
        },
    ),
    (
        &[AbortCode::UnknownCommand, AbortCode::InvalidBlockSize],
        Advice {
            cause: "the device does not know this kind of transfer, or what it received was damaged",
            next: COMPARE,
        },
    ),
    (
        &[AbortCode::OutOfMemory, AbortCode::NoResource],
        Advice {
            cause: "the device is busy with another transfer, or has no room for this one",
            next: "switch the device off and on; if it comes again, another program talks to it",
        },
    ),
    (
        &[AbortCode::UnsupportedAccess],
        Advice {
            cause: OTHER_DEVICE,
            next: COMPARE,
        },
    ),
    (
        &[AbortCode::WriteOnly],
        Advice {
            cause: "an object was read that can only be written",
            next: COMPARE,
        },
    ),
    (
        &[AbortCode::ReadOnly],
        Advice {
            cause: "an object was written that can only be read; some drives lock objects while they are enabled",
            next: "switch the drive off and on and try again; then compare device and firmware with the machine's file",
        },
    ),
    (
        &[AbortCode::NoSuchObject, AbortCode::NoSuchSubIndex],
        Advice {
            cause: "the device does not have this object: it is another one than the configuration says, or an option of it is \
             switched off",
            next: COMPARE,
        },
    ),
    (
        &[AbortCode::NotMappable, AbortCode::PdoTooLong],
        Advice {
            cause: "the device cannot send or take this object in its process data, or not so many of them",
            next: "look in the device's manual at which objects can be mapped; another device family may be needed in the file",
        },
    ),
    (
        &[
            AbortCode::ParameterIncompatible,
            AbortCode::InternalIncompatible,
        ],
        Advice {
            cause: "the value contradicts another setting of the device: units, mode, gear or encoder are set otherwise there",
            next: "read the device's own settings with its maker's tool, or restore its factory settings",
        },
    ),
    (
        &[AbortCode::HardwareError],
        Advice {
            cause: "a part of the device is broken, or its memory cannot be read or written",
            next: "switch it off and on; if it comes again, have it repaired",
        },
    ),
    (
        &[
            AbortCode::LengthMismatch,
            AbortCode::LengthTooHigh,
            AbortCode::LengthTooLow,
        ],
        Advice {
            cause: "the object has another type in this device than the standard gives it",
            next: COMPARE,
        },
    ),
    (
        &[
            AbortCode::InvalidValue,
            AbortCode::ValueTooHigh,
            AbortCode::ValueTooLow,
        ],
        Advice {
            cause: "the device does not take this value: speed, acceleration, window or limit are beyond what it can do",
            next: "look at which object the message names, and change the key of the machine's file that it belongs to",
        },
    ),
    (
        &[AbortCode::MaximumBelowMinimum],
        Advice {
            cause: "two limits contradict each other, for one of them is still that of an earlier set-up",
            next: "check the soft limits in the machine's file; then restore the device's factory settings",
        },
    ),
    (
        &[AbortCode::General],
        Advice {
            cause: "the device does not say why; mostly it is not ready, or in a state in which this object is locked",
            next: "acknowledge its fault (`truestage reset`), switch it off and on, and try again",
        },
    ),
    (
        &[
            AbortCode::CannotStore,
            AbortCode::LocalControl,
            AbortCode::DeviceState,
        ],
        Advice {
            cause: "the device is in a state in which it takes no such value: enabled, moving, in fault, or held by a panel or its \
             maker's tool",
            next: "close the maker's tool, acknowledge the fault (`truestage reset`), and try again at rest",
        },
    ),
    (
        &[AbortCode::NoDictionary],
        Advice {
            cause: "the device has lost its object dictionary, or its firmware is not complete",
            next: "load its firmware again with its maker's tool",
        },
    ),
    (
        &[AbortCode::NoData],
        Advice {
            cause: "the device has nothing to say here yet: a measurement has not been taken, or a sensor is missing",
            next: "look at the sensor or input that the object belongs to; then try again",
        },
    ),
];

/// Of a code that no standard names.
pub(super) const UNNAMED: Advice = Advice {
    cause: "a code of the device's maker, which no standard names",
    next: "look it up in the device's manual, under SDO abort codes",
};

/// What mostly stands behind a code, and what to do.
pub(super) fn of(code: AbortCode) -> Advice {
    let mut rows = ADVICE.iter();
    let row = rows.find(|(codes, _)| codes.contains(&code));
    row.map_or(UNNAMED, |(_, advice)| *advice)
}
