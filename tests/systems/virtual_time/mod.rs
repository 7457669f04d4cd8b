//! Many machines and many power cycles: only in virtual time, whatever `RIG` says. The runner
//! of the tests on SocketCAN leaves this module out by its name.

mod gantry;
mod job;
mod linear;
mod linear_causes;
mod linear_zero;
mod patience;
mod pinned;
mod platform;
mod platform_causes;
mod platform_knowledge;
mod platform_strokes;
mod platform_uncertainty;
mod repeatable;
mod rotary;
mod rotary_sighted;
mod rotary_signal;
mod rotary_table;
mod rotary_uncertainty;
mod serial_zero;
mod survey;
mod table_uncertainty;
mod volumetric;
mod volumetric_cameras;
mod volumetric_cause;
mod volumetric_cold;
mod volumetric_day;
mod volumetric_kept;
mod volumetric_kinds;
mod volumetric_line;
mod volumetric_resume;
mod volumetric_rolls;
mod volumetric_scatter;
mod wrong_position;
mod zero_plan;
mod zero_uncertainty;
