//! The zero with the Hall sensors behind a slow analog module on a serial line. It samples when
//! it is asked and not at a SYNC, so that its voltages belong to places where the axis was up
//! to a tenth of a second ago: the zero is refused, never wrong.

use tests::{Rig, Setup, Stand};
use truestage::Failure;

#[test]
fn voltages_that_do_not_belong_to_their_positions_give_a_reason_and_no_zero() {
    for seed in 1..=5 {
        let mut stand = Stand::new(Rig::InProcess, &Setup::new(seed).over_dcon());
        let store = stand.store.clone();
        let result = stand.machine.guarded(|machine| {
            machine.start()?;
            machine.linear("x")?.zero(&store)
        });
        let Err(failure) = result else {
            panic!("seed {seed}: found a zero")
        };
        println!("seed {seed}: {failure}");
        assert!(
            matches!(
                failure,
                Failure::Search { .. } | Failure::Refine { .. } | Failure::ZeroUncertain { .. }
            ),
            "seed {seed}: {failure}"
        );
        assert!(!stand.machine.is_zeroed("x"));
    }
}
