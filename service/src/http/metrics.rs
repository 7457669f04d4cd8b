//! What a monitoring system asks for: the text form of Prometheus.

use core::fmt::Write;

use axum::extract::State;
use axum::http::header;
use axum::response::IntoResponse;
use drivers::transport::SyncStatistics;
use machine::BusFigures;

use super::state::State as Shared;
use crate::figures::Figures;
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
    text += &of_figures(&desk.figures());
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

/// A figure's name, what it is, its kind, and each of its labels with a value.
type Figure = (&'static str, &'static str, &'static str, Vec<(String, f64)>);

/// Of the buses, and of what is measured around them.
fn of_figures(figures: &Figures) -> String {
    let list = sync_figures(figures).into_iter();
    let mut text = String::new();
    for (name, what, kind, values) in list.chain(bus_figures(figures)) {
        if !values.is_empty() {
            // To write into a text cannot fail.
            let _ = writeln!(text, "# HELP {name} {what}\n# TYPE {name} {kind}");
        }
        for (labels, value) in values {
            let _ = writeln!(text, "{name}{{{labels}}} {value}");
        }
    }
    text
}

/// Of SYNCs that a thread sends: in simulated time, and while the cyclic engine sends them, there are none.
fn sync_figures(figures: &Figures) -> [Figure; 4] {
    let minutes = figures.buses.iter().zip(&figures.minute);
    let lateness = minutes.filter_map(|(bus, it)| Some((label(&bus.name), it.lateness.as_ref()?)));
    let quantiles = lateness.flat_map(|(bus, lateness)| {
        [0.5, 0.99, 1.0].map(|share| {
            let labels = format!("bus=\"{bus}\",quantile=\"{share}\"");
            (labels, lateness.percentile(share).as_secs_f64())
        })
    });
    let of = |count: fn(&SyncStatistics) -> u64| {
        let buses = figures.buses.iter();
        let known =
            buses.filter_map(|bus| Some((bus_label(bus), count(bus.sync.as_ref()?) as f64)));
        known.collect()
    };
    [
        (
            "truestage_sync_lateness_seconds",
            "How late SYNCs left in the last minute: half of them, 99 %, all.",
            "gauge",
            quantiles.collect(),
        ),
        (
            "truestage_syncs_total",
            "SYNCs sent.",
            "counter",
            of(|it| it.sent),
        ),
        (
            "truestage_sync_overruns_total",
            "SYNCs left out, because they would have been more than half a period late.",
            "counter",
            of(|it| it.skipped),
        ),
        (
            "truestage_sync_refused_total",
            "SYNCs that the bus's port did not take.",
            "counter",
            of(|it| it.refused),
        ),
    ]
}

fn bus_label(bus: &BusFigures) -> String {
    format!("bus=\"{}\"", label(&bus.name))
}

fn bus_figures(figures: &Figures) -> [Figure; 6] {
    let of = |count: fn(&BusFigures) -> f64| {
        let buses = figures.buses.iter();
        buses.map(|bus| (bus_label(bus), count(bus))).collect()
    };
    let load = figures.buses.iter().zip(&figures.minute);
    let load = load.map(|(bus, minute)| (bus_label(bus), minute.load));
    let temperatures = figures
        .temperatures
        .iter()
        .map(|(module, sensor, celsius)| {
            let labels = format!("module=\"{}\",sensor=\"{sensor}\"", label(module));
            (labels, celsius.value())
        });
    [
        (
            "truestage_bus_load_ratio",
            "The share of the last minute for which the bus was taken.",
            "gauge",
            load.collect(),
        ),
        (
            "truestage_bus_busy_seconds_total",
            "For how long the bus was taken.",
            "counter",
            of(|it| it.busy.as_secs_f64()),
        ),
        (
            "truestage_bus_frames_total",
            "Frames heard and sent, without SYNCs.",
            "counter",
            of(|it| it.counts.frames as f64),
        ),
        (
            "truestage_bus_frames_lost_total",
            "Frames that came and that this computer did not take.",
            "counter",
            of(|it| it.counts.lost as f64),
        ),
        (
            "truestage_bus_errors_total",
            "Error frames: trouble on the bus in the words of its controller.",
            "counter",
            of(|it| it.counts.errors as f64),
        ),
        (
            "truestage_temperature_celsius",
            "What thermometers said last, by the number of the sensor from 0 on.",
            "gauge",
            temperatures.collect(),
        ),
    ]
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
