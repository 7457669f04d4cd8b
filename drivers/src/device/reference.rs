//! Whether a drive has kept its reference while no controller looked after it.
//!
//! After a restart a controller knows nothing of where an axis is. Some drives can prove that their coordinates are
//! still those of the last zero; which proof a drive offers is configured, because none is in CiA 402: bit 12 of the
//! statusword ("homing attained") says so only in homing mode.

use thiserror::Error;
use wire::canopen::Object;

/// What a drive proves its reference with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ReferenceProof {
    /// A number is written into this object at zeroing. It must have 32 bits, mean nothing to the drive, and be lost
    /// with the drive's power: whoever still finds the number there knows that the drive was never without it.
    Mark(Object),
    /// The drive says itself whether it is homed, by a bit of an object.
    HomedBit {
        /// Such as 0x6041:00 of a drive that has a bit of its own for it.
        object: Object,
        /// From 0, the lowest.
        bit: u8,
    },
    /// The encoder is absolute over the whole travel, its own position is in this object, which no homing changes, and the
    /// drive keeps without power what it adds to that.
    AbsoluteEncoder(Object),
}

/// What a drive shows of its reference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DriveReference {
    /// What is in the object of [`ReferenceProof::Mark`].
    pub mark: Option<u32>,
    /// The bit of [`ReferenceProof::HomedBit`].
    pub homed: Option<bool>,
    /// 0x6098, as it was written last.
    pub method: u32,
    /// 0x607C, as it was written last.
    pub home_offset: u32,
    /// 0x6064, position units.
    pub position: i32,
    /// 0x607E, where the drive has it: in which direction it counts.
    pub polarity: u32,
    /// The encoder's own position, increments, where the drive has it: 0x6063, or what its proof names.
    pub increments: Option<i32>,
    /// By how many increments it changed while the position was read.
    pub moved: u32,
    /// 0x603F, where the drive has it; 0: none.
    pub error_code: u32,
}

/// Why a drive's coordinates are not taken for those of its last zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum ReferenceLost {
    /// Its power was off, or another program has zeroed it.
    #[error(
        "the mark {expected:#010X} that was written into the drive at its zero is not there (seen: {seen:#010X}); \
         its power was off, or it was homed by somebody else"
    )]
    Mark {
        /// What was written.
        expected: u32,
        /// What is there now.
        seen: u32,
    },
    /// By its own word.
    #[error("the drive itself says that it is not homed")]
    NotHomed,
    /// Somebody has written what says where and in which direction it counts.
    #[error(
        "{object} is {seen:#X} and no longer {expected:#X}: another program has set the drive's coordinates"
    )]
    Changed {
        /// The homing method, the home offset or the polarity.
        object: Object,
        /// As our zero left it.
        expected: u32,
        /// As it is now.
        seen: u32,
    },
    /// The drive adds something else to the encoder's position than it did.
    #[error(
        "position (0x6064) and encoder are {counts} counts farther apart than at its zero: the origin was moved, or \
         encoder or drive were without power"
    )]
    Shifted {
        /// By so many position units.
        counts: i64,
    },
    /// The encoder's position is not there, or not any more.
    #[error(
        "the drive does not show the position of its encoder, which its own must be compared with"
    )]
    NoEncoder,
    /// What should be the encoder's own position changed with homing.
    #[error(
        "{object} changed with the position when the drive was homed: it is not the encoder's own position, and proves \
         nothing"
    )]
    NotOfEncoder {
        /// Which object.
        object: Object,
    },
    /// Nobody has seen yet whether it is the encoder's own position: the origin has not changed.
    #[error(
        "the origin lies where it lay, so that nobody could see whether {object} is the encoder's own position; that shows at \
         the first zero after the drive was without power"
    )]
    NotTried {
        /// Which object.
        object: Object,
    },
    /// Nothing can be compared while it moves.
    #[error("the axis moved by {increments} increments while it was read")]
    Moving {
        /// By so many.
        increments: u32,
    },
    /// It found something wrong meanwhile.
    #[error(
        "the drive reports error {code:#06X}; once its cause is gone, switch the drive off and on, and zero"
    )]
    Fault {
        /// 0x603F.
        code: u32,
    },
}
