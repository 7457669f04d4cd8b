//! Runs of three axes in the words of the command line, for whoever keeps a machine.

use crate::program::volumetric::{memory, moved, part, reference, verbs};
use crate::runs::Told;
use crate::volumetric::VolumetricTeller;

pub(crate) static TELLER: VolumetricTeller = VolumetricTeller {
    zeroed: verbs::zeroed,
    calibrated: |made| Told {
        text: verbs::calibrated_text(made),
        value: verbs::calibrated_value(made),
    },
    verified: |verified| Told {
        text: verbs::verified_text(verified),
        value: verbs::verified_value(verified),
    },
    remembered: memory::remembered,
    designed: memory::designed,
    moved: moved::moved,
    followed: part::followed,
    referenced: |taken| Told {
        text: reference::referenced_text(taken),
        value: reference::referenced_value(taken),
    },
};
