//! What a rotary table wrote.

use crate::rotary::{PlateLog, RotaryContent};
use crate::store::golden::{Golden, again, golden_file, golden_journal};

pub(crate) const GOLDEN: Golden = Golden::of::<PlateLog>(
    include_str!("../../../configs/machines/rotary.toml"),
    Some(include_str!("../config/dependence/golden/rotary.txt")),
    &[(golden_file!("rotary.json"), again::<RotaryContent>)],
    &[
        golden_journal!("rotary_calibrate.jsonl"),
        golden_journal!("rotary_verify.jsonl"),
    ],
);
