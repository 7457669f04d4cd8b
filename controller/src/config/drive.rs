//! What the sections of CiA 402 drives have in common, whatever they move.

use schemars::JsonSchema;
use serde::Deserialize;

/// What a drive takes its home offset (0x607C) for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum HomeOffsetName {
    /// The position at home, as many drives do.
    #[default]
    PositionAtHome,
    /// The way from home to zero, as CiA 402 has it.
    ZeroFromHome,
}

/// The option codes of CiA 402; what is absent stays as the drive has it.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OptionCodesConfig {
    /// 0x605A.
    pub quick_stop: Option<i16>,
    /// 0x605B.
    pub shutdown: Option<i16>,
    /// 0x605C.
    pub disable: Option<i16>,
    /// 0x605D.
    pub halt: Option<i16>,
    /// 0x605E.
    pub fault_reaction: Option<i16>,
}
