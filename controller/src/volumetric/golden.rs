//! What three axes wrote.

use crate::store::golden::{Golden, again, golden_file, golden_journal};
use crate::volumetric::{BeamReferencesContent, GeometryContent, VolumeLog};

pub(crate) const GOLDEN: Golden = Golden::of::<VolumeLog>(
    include_str!("../../../configs/machines/volumetric.toml"),
    None,
    &[
        (golden_file!("volumetric.json"), again::<GeometryContent>),
        (
            golden_file!("references.json"),
            again::<BeamReferencesContent>,
        ),
    ],
    &[
        golden_journal!("volumetric_calibrate.jsonl"),
        golden_journal!("volumetric_verify.jsonl"),
    ],
);
