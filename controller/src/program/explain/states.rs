//! States of CiA 402 drives (object 0x6041): what holds a drive in each, and what to do.

use wire::cia402::PowerState;

use super::Advice;

pub(super) const fn of(state: PowerState) -> Advice {
    match state {
        PowerState::NotReadyToSwitchOn => Advice {
            cause: "the drive tests itself, or has just got its supply",
            next: "wait some seconds; if it stays there, look at its display for a fault of its own",
        },
        PowerState::SwitchOnDisabled => Advice {
            cause: "the usual state after power-on and after a stop. A drive that does not leave it has no mains voltage, \
                    an open safe torque off (STO) or an inactive enable input",
            next: "nothing, unless enabling fails; then check mains, STO and the enable input",
        },
        PowerState::ReadyToSwitchOn => Advice {
            cause: "the drive may be switched on, and its power stage is off",
            next: "nothing, unless enabling fails; then check mains, DC link and the enable input",
        },
        PowerState::SwitchedOn => Advice {
            cause: "the power stage has voltage, the motor has no torque",
            next: "nothing, unless enabling fails; then check the enable input, the brake and the motor's commutation",
        },
        PowerState::OperationEnabled => Advice {
            cause: "the motor is under control: the axis holds its place or moves",
            next: "nothing. Where it does not reach its target, compare the bits with the drive's manual for its mode",
        },
        PowerState::QuickStopActive => Advice {
            cause: "a quick stop runs or has ended: commanded, by an input, or by a limit switch",
            next: "find what asked for it, then disable and enable the axis",
        },
        PowerState::FaultReactionActive => Advice {
            cause: "the drive has found a fault and brings the axis to rest",
            next: "wait until it is in fault, then read its code (0x603F) and explain that",
        },
        PowerState::Fault => Advice {
            cause: "the drive has found a fault and is off; its code is in 0x603F and in its emergency message",
            next: "explain that code, remove the cause, then `truestage reset` and zero the axis again",
        },
        PowerState::Unknown(_) => Advice {
            cause: "the bits are no state of CiA 402: another object was read, or the word is damaged",
            next: "read 0x6041 again, and check the mapping of the process data",
        },
    }
}
