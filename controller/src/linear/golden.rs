//! What a linear axis wrote.

use crate::linear::{LinearContent, LinearLog};
use crate::store::golden::{Golden, again, golden_file, golden_journal};

pub(crate) const GOLDEN: Golden = Golden::of::<LinearLog>(
    include_str!("../../../configs/machines/linear.toml"),
    Some(include_str!("../config/dependence/golden/linear.txt")),
    &[
        (golden_file!("linear.json"), again::<LinearContent>),
        (golden_file!("linear_budget.json"), again::<LinearContent>),
    ],
    &[
        golden_journal!("linear_calibrate.jsonl"),
        golden_journal!("linear_zero.jsonl"),
    ],
);
