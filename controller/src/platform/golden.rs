//! What a platform wrote.

use crate::platform::{PlatformLog, ScrewContent};
use crate::store::golden::{Golden, again, golden_file, golden_journal};

pub(crate) const GOLDEN: Golden = Golden::of::<PlatformLog>(
    include_str!("../../../configs/machines/uvw.toml"),
    Some(include_str!("../config/dependence/golden/uvw.txt")),
    &[(golden_file!("platform.json"), again::<ScrewContent>)],
    &[
        golden_journal!("platform_calibrate.jsonl"),
        golden_journal!("platform_verify.jsonl"),
    ],
);
