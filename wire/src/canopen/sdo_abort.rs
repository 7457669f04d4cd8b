//! Why an SDO transfer was given up (CiA 301, table 22).

use core::fmt;

macro_rules! abort_codes {
    ($($name:ident = $raw:literal, $text:literal;)*) => {
        /// Why a transfer was aborted (CiA 301, table 22).
        ///
        /// # Example
        ///
        /// ```
        /// use wire::canopen::sdo::AbortCode;
        ///
        /// let code = AbortCode::from_raw(0x0602_0000);
        /// assert_eq!(code, AbortCode::NoSuchObject);
        /// assert_eq!(AbortCode::TimedOut.raw(), 0x0504_0000);
        /// assert_eq!(AbortCode::from_raw(7), AbortCode::Unknown(7), "kept as it came");
        /// ```
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[expect(missing_docs, reason = "each is described by its Display text")]
        pub enum AbortCode {
            $($name,)*
            /// A code that CiA 301 does not name.
            Unknown(u32),
        }

        impl AbortCode {
            /// Every code that CiA 301 names, in its order.
            pub const ALL: &[Self] = &[$(Self::$name,)*];

            /// From the number on the wire.
            pub const fn from_raw(raw: u32) -> Self {
                match raw {
                    $($raw => Self::$name,)*
                    other => Self::Unknown(other),
                }
            }

            /// The number on the wire.
            pub const fn raw(self) -> u32 {
                match self {
                    $(Self::$name => $raw,)*
                    Self::Unknown(raw) => raw,
                }
            }

            const fn text(self) -> &'static str {
                match self {
                    $(Self::$name => $text,)*
                    Self::Unknown(_) => "code not named by CiA 301",
                }
            }
        }
    };
}

abort_codes! {
    ToggleNotAlternated = 0x0503_0000, "toggle bit not alternated";
    TimedOut = 0x0504_0000, "SDO protocol timed out";
    UnknownCommand = 0x0504_0001, "command specifier not valid or unknown";
    InvalidBlockSize = 0x0504_0002, "invalid block size";
    InvalidSequence = 0x0504_0003, "invalid sequence number";
    CrcMismatch = 0x0504_0004, "CRC error";
    OutOfMemory = 0x0504_0005, "out of memory";
    UnsupportedAccess = 0x0601_0000, "unsupported access to an object";
    WriteOnly = 0x0601_0001, "object is write only";
    ReadOnly = 0x0601_0002, "object is read only";
    NoSuchObject = 0x0602_0000, "object does not exist";
    NotMappable = 0x0604_0041, "object cannot be mapped to a PDO";
    PdoTooLong = 0x0604_0042, "mapped objects exceed the PDO's length";
    ParameterIncompatible = 0x0604_0043, "general parameter incompatibility";
    InternalIncompatible = 0x0604_0047, "general internal incompatibility";
    HardwareError = 0x0606_0000, "access failed because of a hardware error";
    LengthMismatch = 0x0607_0010, "length of the value does not match";
    LengthTooHigh = 0x0607_0012, "value is too long";
    LengthTooLow = 0x0607_0013, "value is too short";
    NoSuchSubIndex = 0x0609_0011, "sub-index does not exist";
    InvalidValue = 0x0609_0030, "value out of range";
    ValueTooHigh = 0x0609_0031, "value too high";
    ValueTooLow = 0x0609_0032, "value too low";
    MaximumBelowMinimum = 0x0609_0036, "maximum is less than minimum";
    NoResource = 0x060A_0023, "SDO resource not available";
    General = 0x0800_0000, "general error";
    CannotStore = 0x0800_0020, "data cannot be stored";
    LocalControl = 0x0800_0021, "data cannot be stored because of local control";
    DeviceState = 0x0800_0022, "data cannot be stored in the present device state";
    NoDictionary = 0x0800_0023, "no object dictionary";
    NoData = 0x0800_0024, "no data available";
}

impl fmt::Display for AbortCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "0x{:08X} ({})", self.raw(), self.text())
    }
}
