//! PDO parameters as a script, in the only order CiA 301 allows (7.5.2.36 and .38).
//!
//! Switch the PDO off (bit 31 of its COB-ID), set the number of mapped objects to 0, map them,
//! set their number, set transmission type and timers, switch it on. Every value is read back:
//! an EDS may lie about what can be mapped, and a drive about what it took.

use super::script::Step;
use wire::canopen::pdo::{MappedObject, PdoCobId, Transmission};
use wire::canopen::{NodeId, Object};

/// Whether the node sends or receives it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PdoDirection {
    /// RPDO: 0x1400 and 0x1600.
    Receive,
    /// TPDO: 0x1800 and 0x1A00.
    Transmit,
}

/// One PDO of a node, numbered 1 to 4 as in the predefined connection set.
///
/// # Example
///
/// ```
/// use drivers::protocol::pdo_setup::{Pdo, PdoDirection};
/// use wire::canopen::NodeId;
/// use wire::canopen::pdo::{MappedObject, Transmission};
///
/// let node = NodeId::new(5).expect("1 to 127");
/// let pdo = Pdo::new(PdoDirection::Transmit, 1).expect("1 to 4");
/// assert_eq!(pdo.cob_id(node), 0x185);
/// let mapped = [MappedObject::new(0x6041, 0, 16), MappedObject::new(0x6064, 0, 32)];
/// let steps = pdo.configure(node, &mapped, Transmission::Synchronous(1))?;
/// assert_eq!(steps[0].object.to_string(), "0x1800:01", "first of all it is switched off");
/// assert!(pdo.configure(node, &[mapped[1]; 3], Transmission::Event).is_err(), "96 bits");
/// # Ok::<(), drivers::protocol::pdo_setup::PdoTooLong>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Pdo {
    direction: PdoDirection,
    number: u8,
}

/// A device may set or clear bit 30 (no remote frames) as it likes; the rest must be as written.
const COB_ID_BITS: u64 = !(1 << 30) & 0xFFFF_FFFF;

impl Pdo {
    /// `None` for numbers other than 1 to 4.
    pub const fn new(direction: PdoDirection, number: u8) -> Option<Self> {
        if number >= 1 && number <= 4 {
            Some(Self { direction, number })
        } else {
            None
        }
    }

    /// Its identifier in the predefined connection set.
    pub const fn cob_id(self, node: NodeId) -> u16 {
        let base = match self.direction {
            PdoDirection::Transmit => 0x180,
            PdoDirection::Receive => 0x200,
        };
        base + (self.number as u16 - 1) * 0x100 + node.raw() as u16
    }

    const fn communication(self, sub: u8) -> Object {
        let base = match self.direction {
            PdoDirection::Receive => 0x1400,
            PdoDirection::Transmit => 0x1800,
        };
        Object::new(base + self.number as u16 - 1, sub)
    }

    const fn mapping(self, sub: u8) -> Object {
        let base = match self.direction {
            PdoDirection::Receive => 0x1600,
            PdoDirection::Transmit => 0x1A00,
        };
        Object::new(base + self.number as u16 - 1, sub)
    }

    const fn entry(self, node: NodeId) -> PdoCobId {
        match self.direction {
            PdoDirection::Transmit => PdoCobId::valid(self.cob_id(node)),
            // Bit 30 is reserved in an RPDO.
            PdoDirection::Receive => PdoCobId(self.cob_id(node) as u32),
        }
    }

    /// The steps that switch this PDO off, if the node has it.
    pub fn disable(self, node: NodeId) -> Vec<Step> {
        let off = self.entry(node).disabled().0;
        vec![
            Step::check_bits(
                self.communication(1),
                off,
                COB_ID_BITS,
                "switching an unused PDO off",
            )
            .optional(),
        ]
    }

    /// The steps that map `mapped` (at most 8 objects, 64 bits) and switch this PDO on.
    ///
    /// # Errors
    /// When the objects do not fit.
    pub fn configure(
        self,
        node: NodeId,
        mapped: &[MappedObject],
        transmission: Transmission,
    ) -> Result<Vec<Step>, PdoTooLong> {
        let bits: u32 = mapped.iter().map(|entry| u32::from(entry.bits)).sum();
        if bits > 64 || mapped.len() > 8 {
            return Err(PdoTooLong { bits });
        }
        let entry = self.entry(node);
        let mut steps = vec![
            Step::check_bits(
                self.communication(1),
                entry.disabled().0,
                COB_ID_BITS,
                "switching a PDO off to map it",
            ),
            Step::check(self.mapping(0), 0_u8, "clearing a PDO's mapping"),
        ];
        for (sub, object) in (1_u8..).zip(mapped) {
            steps.push(Step::check(
                self.mapping(sub),
                object.raw(),
                "mapping an object to a PDO",
            ));
        }
        steps.push(Step::check(
            self.mapping(0),
            mapped.len() as u8,
            "setting the number of mapped objects",
        ));
        steps.push(Step::check(
            self.communication(2),
            transmission.raw(),
            "setting a PDO's transmission type",
        ));
        if self.direction == PdoDirection::Transmit {
            let inhibit = Step::check(
                self.communication(3),
                0_u16,
                "clearing a PDO's inhibit time",
            );
            let event = Step::check(self.communication(5), 0_u16, "clearing a PDO's event timer");
            steps.push(inhibit.optional());
            steps.push(event.optional());
        }
        steps.push(Step::check_bits(
            self.communication(1),
            entry.0,
            COB_ID_BITS,
            "switching a PDO on",
        ));
        Ok(steps)
    }
}

/// More was to be mapped than a PDO holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a PDO holds 8 objects and 64 bits; {bits} bits were to be mapped")]
pub struct PdoTooLong {
    /// How many.
    pub bits: u32,
}
