//! LinuxCNC with a COMP_FILE.
//!
//! Source: LinuxCNC. `usrmotLoadComp` (src/emc/motion/usrmotintf.cc): rows of three numbers up to the first line that
//! has not three; type 0 takes nominal − value, type 1 the value. `EMCMOT_SET_JOINT_COMP` (command.c): at most 256 rows,
//! growing; slopes between them, in single precision. `motion.c`: the first entry at minus infinity, slopes of nothing
//! at both ends. `compute_screw_comp` (control.c): by the direction of motion; `output_to_hal`: added to the command.

#[derive(Clone, Copy)]
struct Entry {
    nominal: f64,
    trim: [f32; 2],
    slope: [f32; 2],
}

/// A joint whose table is loaded.
pub(crate) struct Joint {
    entries: Vec<Entry>,
}

impl Joint {
    /// As `COMP_FILE_TYPE` says.
    pub(crate) fn load(file: &str, kind: u8) -> Self {
        let mut entries = vec![Entry {
            nominal: f64::MIN,
            trim: [0.0; 2],
            slope: [0.0; 2],
        }];
        for line in file.lines() {
            let numbers: Vec<f64> = line
                .split_whitespace()
                .map_while(|it| it.parse().ok())
                .collect();
            let [nominal, forward, reverse, ..] = numbers[..] else {
                break;
            };
            let values = match kind {
                0 => [nominal - forward, nominal - reverse],
                _ => [forward, reverse],
            };
            assert!(entries.len() <= 256, "joint: too many compensation entries");
            let last = entries.last_mut().expect("there is the first");
            assert!(
                nominal > last.nominal,
                "joint: compensation values must increase"
            );
            let trim = values.map(|it| it as f32);
            if last.nominal == f64::MIN {
                last.trim = trim;
            } else {
                let width = nominal - last.nominal;
                last.slope = [0, 1].map(|at| (f64::from(trim[at] - last.trim[at]) / width) as f32);
            }
            entries.push(Entry {
                nominal,
                trim,
                slope: [0.0; 2],
            });
        }
        Self { entries }
    }

    /// How many rows it has read.
    pub(crate) fn rows(&self) -> usize {
        self.entries.len() - 1
    }

    /// Where the motor is sent for a commanded position, moving with growing coordinates or not.
    pub(crate) fn motor(&self, position: f64, is_growing: bool) -> f64 {
        let at = self.entries.iter().rposition(|it| it.nominal <= position);
        let entry = self.entries[at.expect("the first is at minus infinity")];
        let side = usize::from(!is_growing);
        let beyond = if entry.nominal == f64::MIN {
            0.0
        } else {
            position - entry.nominal
        };
        position + f64::from(entry.trim[side]) + f64::from(entry.slope[side]) * beyond
    }
}

#[test]
fn the_example_of_its_source_is_read_as_it_says() {
    // usrmotLoadComp gives these three rows: forward and reverse are positions, so the joint must be sent on by what
    // it lacks.
    let file =
        "0.000000 0.000000 -0.001279\n0.100000 0.098742  0.051632\n0.200000 0.171529  0.194216\n";
    let joint = Joint::load(file, 0);
    let near =
        |seen: f64, expected: f64| assert!((seen - expected).abs() < 1e-7, "{seen} {expected}");
    near(joint.motor(0.1, true), 0.1 + 0.001258);
    near(joint.motor(0.1, false), 0.1 + 0.048368);
    near(joint.motor(0.15, true), 0.15 + (0.001258 + 0.028471) / 2.0);
    near(joint.motor(-5.0, false), -5.0 + 0.001279);
    near(joint.motor(7.0, true), 7.0 + 0.028471);
    assert_eq!(Joint::load("# a comment first\n0 0 0\n", 1).rows(), 0);
}
