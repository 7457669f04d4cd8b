//! Codes of emergency messages (CiA 301, 7.2.7) and drive faults (CiA 402-2, object 0x603F). The low byte refines the
//! class that the high byte names; where a code has no advice of its own, that of its class counts.

use wire::canopen::emcy::EmergencyCode;

use super::Advice;

/// Of a code that no standard names.
pub(super) const UNNAMED: Advice = Advice {
    cause: "a code that no standard names: its maker's own",
    next: "look it up in the device's manual, under error codes; the five bytes behind it are the maker's, too",
};

/// From the first code to the last one of each row; the first row that holds a code counts.
const ADVICE: &[(u16, u16, Advice)] = &[
    (
        0x0000,
        0x00FF,
        Advice {
            cause: "an error went away: nothing is wrong any more",
            next: "look in the journal for what came before it",
        },
    ),
    (
        0x1000,
        0x10FF,
        Advice {
            cause: "the device says only that something is wrong",
            next: "read its own fault memory with its maker's tool",
        },
    ),
    (
        0x2320,
        0x233F,
        Advice {
            cause: "a phase of the motor touches another one or the housing, or the amplifier is broken",
            next: "switch the power off; measure motor and cable against earth before it comes back",
        },
    ),
    (
        0x2340,
        0x234F,
        Advice {
            cause: "the windings or the motor cable are shorted",
            next: "switch the power off; measure motor and cable before it comes back",
        },
    ),
    (
        0x2000,
        0x2FFF,
        Advice {
            cause: "more current than motor or amplifier bear: the axis is blocked, tuned too hard, accelerates too fast, or its \
             commutation is wrong",
            next: "move the axis by hand with the power off; then lower accelerations, and look at the current limits in the drive",
        },
    ),
    (
        0x3210,
        0x321F,
        Advice {
            cause: "braking feeds more energy back than the supply takes",
            next: "lower the deceleration, or give the supply a brake resistor",
        },
    ),
    (
        0x3220,
        0x322F,
        Advice {
            cause: "the power supply is off, too weak, or sags while axes accelerate",
            next: "measure the supply at the drive while it accelerates; look at emergency stop and fuses",
        },
    ),
    (
        0x3000,
        0x3FFF,
        Advice {
            cause: "the mains or a supply voltage is out of its range",
            next: "measure the supply at the device",
        },
    ),
    (
        0x4000,
        0x4FFF,
        Advice {
            cause: "device or motor are too warm: too much work, a fan that stands, or cooling that is blocked",
            next: "let it cool down; look at fan, filter and duty before going on",
        },
    ),
    (
        0x5113,
        0x5113,
        Advice {
            cause: "the supply of the electronics sags below its limit",
            next: "measure the 24 V at the device while the others are switched on",
        },
    ),
    (
        0x5530,
        0x553F,
        Advice {
            cause: "settings cannot be kept, or were lost",
            next: "restore the device's settings with its maker's tool; if it comes again, have it repaired",
        },
    ),
    (
        0x5000,
        0x5FFF,
        Advice {
            cause: "a part of the device is broken",
            next: "switch it off and on; if it comes again, have it repaired",
        },
    ),
    (
        0x6320,
        0x632F,
        Advice {
            cause: "a setting of the device is out of its range or contradicts another one",
            next: "compare its settings with the commissioned ones, or restore them with its maker's tool",
        },
    ),
    (
        0x6000,
        0x6FFF,
        Advice {
            cause: "the device's firmware has failed, or its settings are damaged",
            next: "switch it off and on; if it comes again, load firmware and settings anew",
        },
    ),
    (
        0x7121,
        0x7121,
        Advice {
            cause: "the motor gets current and does not turn: something is in the way, a brake is closed, or it stands at a stop",
            next: "switch the power off and move the axis by hand over its whole travel",
        },
    ),
    (
        0x7305,
        0x7306,
        Advice {
            cause: "the encoder's signal is weak, missing or counts impossibly: cable, read head, dirt on the scale",
            next: "clean the scale, check the read head's gap and its plug; then zero again, for the count cannot be trusted",
        },
    ),
    (
        0x7100,
        0x71FF,
        Advice {
            cause: "the drive's power module is overloaded or broken",
            next: "look at motor and brake; if it comes again at rest, have the drive repaired",
        },
    ),
    (
        0x7300,
        0x73FF,
        Advice {
            cause: "a sensor of the axis says nothing or nonsense",
            next: "look at its cable, its supply and its plug; then zero again",
        },
    ),
    (
        0x7000,
        0x7FFF,
        Advice {
            cause: "a module that is added to the device has failed",
            next: "look at its plug and supply, and at its own lamps",
        },
    ),
    (
        0x8110,
        0x8110,
        Advice {
            cause: "frames came faster than the device could take them",
            next: "look at the bus load; lengthen sync_period_ms, or find out who floods the bus",
        },
    ),
    (
        0x8120,
        0x8120,
        Advice {
            cause: "the device saw so many damaged frames that it hardly sends or stopped sending: cable, termination, bit rate, shield",
            next: "measure 60 ohms between CAN_H and CAN_L with the power off; look for another bit rate and for long stubs",
        },
    ),
    (
        0x8140,
        0x8140,
        Advice {
            cause: "the device saw so many damaged frames that it hardly sends or stopped sending: cable, termination, bit rate, shield",
            next: "measure 60 ohms between CAN_H and CAN_L with the power off; look for another bit rate and for long stubs",
        },
    ),
    (
        0x8130,
        0x8130,
        Advice {
            cause: "the device missed this program's heartbeat: the computer was held up, the cable was off, or the program ended",
            next: "look at what else the computer does; acknowledge with `truestage reset`, then zero",
        },
    ),
    (
        0x8150,
        0x8150,
        Advice {
            cause: "two devices send with the same identifier: two have the same node number",
            next: "`truestage scan machine.toml` with one of them switched off, and then the other; give each its own number",
        },
    ),
    (
        0x8210,
        0x8220,
        Advice {
            cause: "process data of another length than the device expects: it was set up by somebody else",
            next: "switch the device off and on, and make sure that no other program sets it up",
        },
    ),
    (
        0x8250,
        0x8250,
        Advice {
            cause: "set-points stayed away: the computer was held up, or frames were lost",
            next: "look at the bus load and at what else the computer does; docs/engine.md says how to give it real-time rights",
        },
    ),
    (
        0x8100,
        0x82FF,
        Advice {
            cause: "the device cannot follow what is said on the bus",
            next: "look at the bus for errors, for other masters, and at its load",
        },
    ),
    (
        0x8611,
        0x8611,
        Advice {
            cause: "the axis was farther from its set-point than the drive permits: blocked, too fast, badly tuned, or its encoder slips",
            next: "look for what is in the way; then lower speed and acceleration; zero again before measuring",
        },
    ),
    (
        0x8612,
        0x8612,
        Advice {
            cause: "the target is beyond a limit that is set in the drive",
            next: "compare the drive's position limits with the soft limits in the machine's file",
        },
    ),
    (
        0x8400,
        0x84FF,
        Advice {
            cause: "the axis cannot keep its speed: friction, load, tuning",
            next: "move the axis by hand with the power off; then look at the tuning",
        },
    ),
    (
        0x8600,
        0x86FF,
        Advice {
            cause: "the drive's position loop cannot do what it is told",
            next: "look at friction, tuning and limits; zero again before measuring",
        },
    ),
    (
        0x8000,
        0x8FFF,
        Advice {
            cause: "something that the device watches is out of its limits",
            next: "read its own fault memory with its maker's tool",
        },
    ),
    (
        0x9000,
        0x90FF,
        Advice {
            cause: "an input from outside says that something is wrong",
            next: "look at what is wired to the device's error inputs",
        },
    ),
    (
        0xFF01,
        0xFF01,
        Advice {
            cause: "of many makers: the safe torque off circuit is open (emergency stop, door)",
            next: "close the circuit, acknowledge with `truestage reset`, then zero: somebody may have moved the axis",
        },
    ),
    (
        0xFF00,
        0xFFFF,
        Advice {
            cause: "the device's maker has a meaning of its own for this code",
            next: "look it up in the device's manual; the five bytes behind it are the maker's, too",
        },
    ),
];

/// What mostly stands behind a code, and what to do.
pub(super) fn of(code: EmergencyCode) -> Advice {
    let mut rows = ADVICE.iter();
    let row = rows.find(|(first, last, _)| (*first..=*last).contains(&code.0));
    row.map_or(UNNAMED, |(_, _, advice)| *advice)
}
