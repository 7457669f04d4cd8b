//! What a monitoring system asks for: the text form of Prometheus.

use core::fmt::Write;

use axum::extract::State;
use axum::http::header;
use axum::response::IntoResponse;

use super::state::State as Shared;
use crate::view::MachineState;

/// Figures of the machine.
#[utoipa::path(
    get, path = "/metrics", tag = "service",
    responses((status = 200, description = "The text form of Prometheus", body = String, content_type = "text/plain"))
)]
pub(super) async fn metrics(State(shared): State<Shared>) -> impl IntoResponse {
    let kind = [(header::CONTENT_TYPE, "text/plain; version=0.0.4")];
    (kind, text(&shared.desk))
}

fn text(desk: &crate::desk::Desk) -> String {
    let mut text = String::new();
    let machine = desk.machine();
    let running = u8::from(machine.state == MachineState::Running);
    let ticks = desk.snapshot().ticks;
    // To write into a text cannot fail.
    let _ = write!(
        text,
        "# HELP truestage_running Whether the machine is supervised and carries orders out.\n\
         # TYPE truestage_running gauge\ntruestage_running {running}\n\
         # HELP truestage_clock_seconds The machine's clock.\n\
         # TYPE truestage_clock_seconds counter\ntruestage_clock_seconds {}\n\
         # HELP truestage_ticks_total Ticks of the machine's loop.\n\
         # TYPE truestage_ticks_total counter\ntruestage_ticks_total {ticks}\n\
         # HELP truestage_events_total Events.\n\
         # TYPE truestage_events_total counter\ntruestage_events_total {}\n",
        machine.clock_s, machine.newest_event
    );
    axes(&mut text, desk);
    text += "# HELP truestage_device_events_total What each device counted.\n\
             # TYPE truestage_device_events_total counter\n";
    for (device, what, count) in desk.counters() {
        let (device, what) = (label(&device), label(what));
        let _ = writeln!(
            text,
            "truestage_device_events_total{{device=\"{device}\",what=\"{what}\"}} {count}"
        );
    }
    text
}

fn axes(text: &mut String, desk: &crate::desk::Desk) {
    let axes = desk.axes();
    *text += "# HELP truestage_axis_homed Whether the axis has its zero.\n\
              # TYPE truestage_axis_homed gauge\n";
    for axis in &axes {
        let (name, homed) = (label(&axis.name), u8::from(axis.homed));
        let _ = writeln!(text, "truestage_axis_homed{{axis=\"{name}\"}} {homed}");
    }
    *text += "# HELP truestage_calibration_created_timestamp_seconds When the calibration in use was made.\n\
              # TYPE truestage_calibration_created_timestamp_seconds gauge\n";
    for axis in &axes {
        let created = axis.calibration_created.as_deref();
        let created = created.and_then(|it| it.parse::<jiff::Timestamp>().ok());
        if let Some(created) = created {
            let (name, seconds) = (label(&axis.name), created.as_second());
            let _ = writeln!(
                text,
                "truestage_calibration_created_timestamp_seconds{{axis=\"{name}\"}} {seconds}"
            );
        }
    }
    *text += "# HELP truestage_axis_position_metres Where its point stands.\n\
              # TYPE truestage_axis_position_metres gauge\n";
    for axis in &axes {
        let position = axis.position.as_ref().and_then(|it| it.length());
        if let Some(position) = position {
            let (name, metres) = (label(&axis.name), position.value());
            let _ = writeln!(
                text,
                "truestage_axis_position_metres{{axis=\"{name}\"}} {metres}"
            );
        }
    }
}

/// A label's value: nothing in it ends it.
fn label(text: &str) -> String {
    let escaped = text.chars().map(|it| match it {
        '\\' | '"' | '\n' => '_',
        other => other,
    });
    escaped.collect()
}
