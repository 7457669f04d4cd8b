//! A SINUMERIK with $AA_ENC_COMP.
//!
//! Source: Siemens, Function Manual Extended Functions 6FC5397-1BP40-3BA1 (03/2013), K3, 4.4.2.2: interpolation point 0
//! at MIN, k at MAX, STEP apart; the first and last value beyond; straight lines (4.4.2.3); with IS_MODULO the table
//! again after MAX. Function Manual 808D (01/2017), page 106: the position actual value is modified by the value, and a
//! positive one moves the machine axis in negative direction.

use std::collections::BTreeMap;

/// A machine axis whose table is loaded.
pub(crate) struct MachineAxis {
    values: Vec<f64>,
    min: f64,
    step: f64,
    is_modulo: bool,
}

impl MachineAxis {
    /// Of measuring system 0 of `axis`.
    pub(crate) fn load(file: &str, axis: &str) -> Self {
        let mut variables = BTreeMap::new();
        let mut is_open = false;
        for line in file.lines() {
            let line = line.split(';').next().unwrap_or_default().trim();
            match line {
                "" => {}
                "CHANDATA(1)" => is_open = true,
                "M17" => break,
                _ if line.starts_with('%') => assert!(line.ends_with("_INI"), "{line}"),
                _ => {
                    assert!(is_open, "{line} before CHANDATA");
                    let (name, value) = line.split_once('=').expect("an assignment");
                    let value: f64 = value.trim().parse().expect("a number");
                    assert!(
                        variables.insert(name.trim().to_owned(), value).is_none(),
                        "{name} twice"
                    );
                }
            }
        }
        let one = |name: &str| variables[&format!("$AA_ENC_COMP{name}[0,{axis}]")];
        let (min, max, step) = (one("_MIN"), one("_MAX"), one("_STEP"));
        let last = ((max - min) / step).round();
        assert!(
            (min + last * step - max).abs() < 1e-6,
            "MAX is no interpolation point"
        );
        let value = |at: usize| variables[&format!("$AA_ENC_COMP[0,{at},{axis}]")];
        let values: Vec<f64> = (0..=last as usize).map(value).collect();
        assert_eq!(variables.len(), values.len() + 4, "variables of nothing");
        Self {
            values,
            min,
            step,
            is_modulo: one("_IS_MODULO") == 1.0,
        }
    }

    fn value(&self, position: f64) -> f64 {
        let last = self.values.len() - 1;
        let mut place = (position - self.min) / self.step;
        if self.is_modulo {
            place = place.rem_euclid(last as f64);
        }
        let place = place.clamp(0.0, last as f64);
        let before = (place as usize).min(last - 1);
        let share = place - before as f64;
        self.values[before] * (1.0 - share) + self.values[before + 1] * share
    }

    /// Where its measuring system stands when the axis has reached `target`: its actual value is then the target.
    pub(crate) fn encoder(&self, target: f64) -> f64 {
        let mut encoder = target;
        for _ in 0..60 {
            encoder = target - self.value(encoder);
        }
        encoder
    }
}

#[test]
fn a_positive_value_moves_the_axis_in_negative_direction() {
    let file = "%_N_AX_EEC_INI\nCHANDATA(1)\n$AA_ENC_COMP[0,0,X1]=0.0 ; first\n$AA_ENC_COMP[0,1,X1]=0.01\n\
                $AA_ENC_COMP[0,2,X1]=0.012\n$AA_ENC_COMP_STEP[0,X1]=1.0\n$AA_ENC_COMP_MIN[0,X1]=-200.0\n\
                $AA_ENC_COMP_MAX[0,X1]=-198.0\n$AA_ENC_COMP_IS_MODULO[0,X1]=0\nM17\n";
    let axis = MachineAxis::load(file, "X1");
    let near =
        |seen: f64, expected: f64| assert!((seen - expected).abs() < 1e-9, "{seen} {expected}");
    near(axis.value(-199.0), 0.010);
    near(axis.value(-199.5), 0.005);
    near(axis.value(-300.0), 0.0);
    near(axis.value(600.0), 0.012);
    assert!(axis.encoder(-198.5) < -198.5);
}
