//! Truth about a drive that no master sees, for judges only.

use units::Time;
use wire::cia402::PowerState;

use super::Cia402DriveNode;

/// Homings of a drive since it was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Homings {
    /// So many were begun.
    pub begun: u64,
    /// So many have set the home.
    pub attained: u64,
}

impl Cia402DriveNode {
    /// The drive's state as it is, whatever its statusword says.
    pub const fn power_state(&self) -> PowerState {
        self.drive.power.wire()
    }

    /// When the motion to the last set-point truly began.
    pub const fn moved_at(&self) -> Option<Time> {
        self.drive.moved_at
    }

    /// Which homings there truly were.
    pub const fn homings(&self) -> Homings {
        self.drive.homings
    }

    /// Whether the drive's coordinates count from its home.
    pub const fn is_homed(&self) -> bool {
        self.drive.homed
    }

    /// The mode in force, whatever 0x6061 shows.
    pub const fn mode(&self) -> i64 {
        self.drive.mode
    }

    /// The position in the drive's coordinates at an encoder count.
    pub fn position_at(&self, counts: i64) -> i64 {
        self.drive.position_of(counts)
    }
}
