//! Runs of a platform in the words of the command line, for whoever keeps a machine.

use crate::platform::PlatformTeller;
use crate::program::platform::verbs;
use crate::runs::Told;

pub(crate) static TELLER: PlatformTeller = PlatformTeller {
    zeroed: verbs::zeroed,
    calibrated: |made| Told {
        text: verbs::calibrated_text(made),
        value: verbs::calibrated_value(made),
    },
    verified: verbs::verified_as,
    moved: verbs::moved,
};
