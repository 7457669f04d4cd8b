//! python-canopen is the master of our emulated analog module.

use mock_bus::fault::{Fault, FaultConfig};
use serde_json::json;

use crate::emulated::Emulated;

/// 0.2 mV rms of noise in steps of 5 V / 32768, six times, and twice for a difference.
const NOISE_COUNTS: i64 = 16;

#[test]
fn python_canopen_samples_the_emulated_analog_module_at_each_sync() {
    for rig in crate::rigs() {
        let emulated = Emulated::spawn(rig);
        // One input where it is known what it must read: at the rail.
        let rail = FaultConfig::permanent(Fault::InputRail { channel: 0 });
        emulated
            .machine
            .inject(rail)
            .expect("the machine has an input 0");
        let seen = emulated.master("analog_master.py").finish();
        let device = json!({ "type": 0x0004_0191, "name": "truestage mock analog input" });
        assert_eq!(seen["device"], device);
        assert_eq!(seen["mapped"], json!([[0x6401, 1], [0x6401, 2]]));
        assert_eq!(seen["unasked"], 0, "PDOs that no SYNC asked for");
        let samples = seen["by_pdo"].as_array().expect("a list of samples");
        assert_eq!(samples.len(), 20);
        assert_eq!(seen["by_sdo"][0], i16::MAX);
        let still = seen["by_sdo"][1].as_i64().expect("a reading");
        for sample in samples {
            assert_eq!(sample[0], i16::MAX);
            let off = sample[1].as_i64().expect("a reading") - still;
            assert!(
                off.abs() <= NOISE_COUNTS,
                "{off} counts between PDO and SDO"
            );
        }
        emulated.stop();
    }
}
