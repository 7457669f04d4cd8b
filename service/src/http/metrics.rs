//! What a monitoring system asks for: the text form of Prometheus.

use core::fmt::Write;

use axum::extract::State;
use axum::http::header;
use axum::response::IntoResponse;
use drivers::transport::SyncStatistics;
use machine::BusFigures;

use super::state::State as Shared;
use crate::desk::Desk;
use crate::figures::Figures;
use crate::view::{AxisView, MachineState};

/// Figures of the machine.
#[utoipa::path(
    get, path = "/metrics", tag = "service",
    responses((status = 200, description = "The text form of Prometheus", body = String, content_type = "text/plain"))
)]
pub(super) async fn metrics(State(shared): State<Shared>) -> impl IntoResponse {
    let kind = [(header::CONTENT_TYPE, "text/plain; version=0.0.4")];
    (kind, text(&shared.desk))
}

fn text(desk: &Desk) -> String {
    let figures = desk.figures();
    let mut text = String::new();
    for figure in machine_figures(desk)
        .into_iter()
        .chain(axis_figures(desk))
        .chain(sync_figures(&figures))
        .chain(bus_figures(&figures))
        .chain([device_figure(desk)])
    {
        write(&mut text, figure);
    }
    text
}

/// A figure's name, what it is, its kind, and its samples: the rest of the name and labels, with a value.
type Figure = (&'static str, &'static str, &'static str, Vec<(String, f64)>);

/// What has no value is left out.
fn write(text: &mut String, (name, what, kind, samples): Figure) {
    if !samples.is_empty() {
        // To write into a text cannot fail.
        let _ = writeln!(text, "# HELP {name} {what}\n# TYPE {name} {kind}");
    }
    for (rest, value) in samples {
        let _ = writeln!(text, "{name}{rest} {value}");
    }
}

fn machine_figures(desk: &Desk) -> [Figure; 6] {
    let machine = desk.machine();
    let only = |value: f64| vec![(String::new(), value)];
    let is_running = machine.state == MachineState::Running;
    [
        (
            "truestage_running",
            "Whether the machine is supervised and carries orders out.",
            "gauge",
            only(f64::from(u8::from(is_running))),
        ),
        (
            "truestage_storage_ok",
            "Whether motions and runs can be written down, and are taken.",
            "gauge",
            only(f64::from(u8::from(desk.storage().ok))),
        ),
        (
            "truestage_idempotency_keys",
            "Idempotency-Keys that are remembered; 100000 are.",
            "gauge",
            only(desk.keys() as f64),
        ),
        (
            "truestage_clock_seconds",
            "The machine's clock.",
            "gauge",
            only(machine.clock_s),
        ),
        (
            "truestage_ticks_total",
            "Ticks of the machine's loop.",
            "counter",
            only(desk.snapshot().ticks as f64),
        ),
        (
            "truestage_events_total",
            "Events.",
            "counter",
            only(machine.newest_event as f64),
        ),
    ]
}

/// What each device counted.
fn device_figure(desk: &Desk) -> Figure {
    let counters = desk.counters();
    let counts = counters.iter().map(|(device, what, count)| {
        let (device, what) = (label(device), label(what));
        let labels = format!("{{device=\"{device}\",what=\"{what}\"}}");
        (labels, *count as f64)
    });
    (
        "truestage_device_events_total",
        "What each device counted.",
        "counter",
        counts.collect(),
    )
}

/// Of SYNCs that leave in real time: in simulated time there are none.
fn sync_figures(figures: &Figures) -> [Figure; 4] {
    let of = |count: fn(&SyncStatistics) -> u64| {
        let buses = figures.buses.iter();
        let known =
            buses.filter_map(|bus| Some((bus_label(bus), count(bus.sync.as_ref()?) as f64)));
        known.collect()
    };
    [
        (
            "truestage_sync_lateness_seconds",
            "How late SYNCs left: in the last minute half of them, 99 %, all; sum and count since the service began.",
            "summary",
            lateness_samples(figures),
        ),
        (
            "truestage_syncs_total",
            "SYNCs sent.",
            "counter",
            of(|it| it.sent),
        ),
        (
            "truestage_sync_overruns_total",
            "SYNCs left out, because they would have been too late.",
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

/// A summary of each bus.
fn lateness_samples(figures: &Figures) -> Vec<(String, f64)> {
    let buses = figures.buses.iter().zip(&figures.minute);
    let known = buses.filter_map(|(bus, minute)| {
        let all = &bus.sync.as_ref()?.lateness;
        let minute = minute.lateness.as_ref()?;
        let name = label(&bus.name);
        let quantile = |share: f64| match minute.total() {
            // Prometheus' word for a quantile of nothing.
            0 => f64::NAN,
            _ => minute.percentile(share).as_secs_f64(),
        };
        let quantiles = [0.5, 0.99, 1.0].map(|share| {
            let rest = format!("{{bus=\"{name}\",quantile=\"{share}\"}}");
            (rest, quantile(share))
        });
        let totals = [
            (format!("_sum{{bus=\"{name}\"}}"), all.sum().as_secs_f64()),
            (format!("_count{{bus=\"{name}\"}}"), all.total() as f64),
        ];
        Some(quantiles.into_iter().chain(totals))
    });
    known.flatten().collect()
}

fn bus_label(bus: &BusFigures) -> String {
    format!("{{bus=\"{}\"}}", label(&bus.name))
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
            let (module, sensor) = (label(module), label(sensor));
            let labels = format!("{{module=\"{module}\",sensor=\"{sensor}\"}}");
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
            "What thermometers of modules and instruments said last.",
            "gauge",
            temperatures.collect(),
        ),
    ]
}

fn axis_figures(desk: &Desk) -> [Figure; 4] {
    let axes = desk.axes();
    let of = |value: fn(&AxisView) -> Option<f64>| {
        let labels = |axis: &AxisView| format!("{{axis=\"{}\"}}", label(&axis.name));
        let known = axes.iter().filter_map(|it| Some((labels(it), value(it)?)));
        known.collect()
    };
    [
        (
            "truestage_axis_homed",
            "Whether the axis has its zero.",
            "gauge",
            of(|it| Some(f64::from(u8::from(it.homed)))),
        ),
        (
            "truestage_calibration_created_timestamp_seconds",
            "When the calibration in use was made.",
            "gauge",
            of(|it| {
                let created = it.calibration_created.as_deref()?;
                let created = created.parse::<jiff::Timestamp>().ok()?;
                Some(created.as_second() as f64)
            }),
        ),
        (
            "truestage_axis_position_metres",
            "Where its point stands along its way.",
            "gauge",
            of(|it| Some(it.position.as_ref()?.length()?.value())),
        ),
        (
            "truestage_axis_position_radians",
            "Where it stands round its turn, counted on over the turns.",
            "gauge",
            of(|it| Some(it.position.as_ref()?.angle()?.value())),
        ),
    ]
}

/// A label's value: nothing in it ends it.
fn label(text: &str) -> String {
    text.replace('\\', "\\\\")
        .replace('"', "\\\"")
        .replace('\n', "\\n")
}
