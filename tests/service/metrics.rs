//! `GET /metrics` as a monitoring system takes it, of every kind of machine, in real time: only there SYNCs are late.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use service::{Access, Caller, Edge, Listen};
use tests::{LINEAR, ROTARY, Rig, Shipped, UVW, UVW_COPLEY, VOLUMETRIC, rigs};
use truestage::emulated::EmulatedOnPtys;

use crate::flood::kept;

/// A service that does not live for a second within that has failed.
const LATE: Duration = Duration::from_secs(60);

/// A name, and what it is.
type Labels = BTreeMap<String, String>;

/// A metric and its samples: the rest of the name, labels, value.
#[derive(Debug)]
struct Family {
    kind: String,
    samples: Vec<(String, Labels, f64)>,
}

impl Family {
    /// The values of its samples with this rest of the name.
    fn values(&self, rest: &str) -> Vec<f64> {
        let samples = self.samples.iter().filter(|it| it.0 == rest);
        samples.map(|it| it.2).collect()
    }

    fn labels_of(&self, label: &str) -> BTreeSet<&str> {
        let samples = self.samples.iter();
        samples
            .filter_map(|it| it.1.get(label))
            .map(|it| &**it)
            .collect()
    }
}

/// The text form 0.0.4 of Prometheus, and nothing that it does not allow.
/// Source: <https://prometheus.io/docs/instrumenting/exposition_formats/>
fn parse(text: &str) -> BTreeMap<String, Family> {
    let mut families = BTreeMap::new();
    let mut lines = text.lines().peekable();
    assert!(text.ends_with('\n'), "the last line has an end");
    while let Some(line) = lines.next() {
        let help = line.strip_prefix("# HELP ").expect(line);
        let (name, what) = help.split_once(' ').expect(line);
        assert!(is_name(name) && !what.is_empty(), "{line}");
        let line = lines.next().expect("a TYPE");
        let of_type = line.strip_prefix("# TYPE ").expect(line);
        let (named, kind) = of_type.split_once(' ').expect(line);
        assert_eq!(named, name);
        let mut samples: Vec<(String, Labels, f64)> = Vec::new();
        while let Some(line) = lines.next_if(|it| !it.starts_with('#')) {
            let (rest, labels, value) = sample(line, name);
            let is_new = samples.iter().all(|it| (&it.0, &it.1) != (&rest, &labels));
            assert!(is_new, "twice: {line}");
            samples.push((rest, labels, value));
        }
        let family = Family {
            kind: kind.to_owned(),
            samples,
        };
        check(name, &family);
        let before = families.insert(name.to_owned(), family);
        assert!(before.is_none(), "{name} comes twice");
    }
    families
}

fn is_name(text: &str) -> bool {
    let is_first = |it: char| it.is_ascii_alphabetic() || it == '_';
    text.starts_with(is_first) && text.chars().all(|it| is_first(it) || it.is_ascii_digit())
}

/// A line of `name`: the rest of its name, its labels, its value.
fn sample(line: &str, name: &str) -> (String, Labels, f64) {
    let rest = line.strip_prefix(name).expect(line);
    let (head, value) = rest.rsplit_once(' ').expect(line);
    let value = value
        .parse()
        .unwrap_or_else(|_| panic!("no number: {line}"));
    let Some((rest, labels)) = head.split_once('{') else {
        return (head.to_owned(), Labels::new(), value);
    };
    let labels = labels.strip_suffix('}').expect(line);
    (rest.to_owned(), labels_of(labels, line), value)
}

fn labels_of(mut text: &str, line: &str) -> Labels {
    let mut labels = Labels::new();
    while !text.is_empty() {
        let (label, rest) = text.split_once("=\"").expect(line);
        assert!(is_name(label), "{line}");
        let (mut value, mut chars) = (String::new(), rest.char_indices());
        let end = loop {
            match chars.next().expect(line) {
                (at, '"') => break at,
                (_, '\\') => match chars.next().expect(line).1 {
                    'n' => value.push('\n'),
                    it @ ('\\' | '"') => value.push(it),
                    other => panic!("\\{other}: {line}"),
                },
                (_, it) => value.push(it),
            }
        };
        let before = labels.insert(label.to_owned(), value);
        assert!(before.is_none(), "{line}");
        let rest = &rest[end + 1..];
        text = rest.strip_prefix(',').unwrap_or(rest);
        assert!(text.is_empty() || rest.starts_with(','), "{line}");
    }
    labels
}

/// What Prometheus recommends of names (base units, `_total` for counters alone) and says of each kind.
fn check(name: &str, family: &Family) {
    assert!(!family.samples.is_empty(), "{name} has no sample");
    let is_total = name.ends_with("_total");
    assert_eq!(family.kind == "counter", is_total, "{name}");
    let foreign = [
        "milli", "micro", "percent", "_ms", "_us", "_mm", "_um", "_hours",
    ];
    assert!(foreign.iter().all(|it| !name.contains(it)), "{name}");
    for (rest, labels, value) in &family.samples {
        let has_quantile = labels.contains_key("quantile");
        match family.kind.as_str() {
            "counter" => assert!(rest.is_empty() && !has_quantile && *value >= 0.0, "{name}"),
            "gauge" => assert!(
                rest.is_empty() && !has_quantile && value.is_finite(),
                "{name}"
            ),
            "summary" => assert_eq!(has_quantile, rest.is_empty(), "{name}{rest}"),
            other => panic!("{name}: {other} is no kind that is used here"),
        }
    }
    if family.kind == "summary" {
        let (sums, counts) = (family.values("_sum").len(), family.values("_count").len());
        assert_eq!((sums, counts), (counts, family.labels_of("bus").len()));
    }
}

/// What it says of a machine that has been kept for a little more than a second.
fn metrics_of(shipped: &Shipped, folder: &Path) -> BTreeMap<String, Family> {
    let emulated = EmulatedOnPtys::start(shipped.emulated, 51, 1.0).unwrap();
    let service = kept(shipped, folder, &emulated);
    let socket = folder.join("socket");
    let places = [Listen::Unix(socket.clone())];
    let edge = Edge::open(service.desk(), &places, &Access::default()).unwrap();
    let (begun, clock) = (Instant::now(), service.desk().machine().clock_s);
    // Figures are taken once a second.
    while service.desk().machine().clock_s < clock + 1.5 && begun.elapsed() < LATE {
        thread::park_timeout(Duration::from_millis(20));
    }
    let mut stream = UnixStream::connect(&socket).unwrap();
    stream
        .write_all(b"GET /metrics HTTP/1.1\r\nhost: x\r\nconnection: close\r\n\r\n")
        .unwrap();
    let mut said = String::new();
    stream.read_to_string(&mut said).unwrap();
    let (head, text) = said.split_once("\r\n\r\n").expect("a head");
    assert!(head.contains("text/plain; version=0.0.4"), "{head}");
    drop(edge);
    let _ = service.desk().end(&Caller::named("the test"));
    let _ = service.wait();
    parse(text)
}

/// SYNC lateness and overruns, load, errors: of each CAN bus; and what devices counted.
fn check_machine(shipped: &Shipped, buses: &[&str], axes: usize) {
    let folder = tempfile::tempdir().unwrap();
    let families = metrics_of(shipped, folder.path());
    let of = |name: &str| {
        let family = families.get(&format!("truestage_{name}"));
        family.unwrap_or_else(|| panic!("no {name}: {families:?}"))
    };
    let buses: BTreeSet<&str> = buses.iter().copied().collect();
    for name in [
        "sync_lateness_seconds",
        "syncs_total",
        "sync_overruns_total",
        "sync_refused_total",
        "bus_load_ratio",
        "bus_busy_seconds_total",
        "bus_errors_total",
        "bus_frames_lost_total",
    ] {
        if buses.is_empty() {
            assert!(!families.contains_key(&format!("truestage_{name}")));
            continue;
        }
        assert_eq!(of(name).labels_of("bus"), buses, "{name}");
    }
    assert_eq!(of("axis_homed").samples.len(), axes);
    assert_eq!(of("running").values(""), [1.0], "{families:?}");
    assert!(
        of("device_events_total").samples.len() >= axes,
        "{families:?}"
    );
    if buses.is_empty() {
        return;
    }
    let lateness = of("sync_lateness_seconds");
    let shares: Vec<_> = lateness.labels_of("quantile").into_iter().collect();
    assert_eq!(shares, ["0.5", "0.99", "1"]);
    for bus in 0..buses.len() {
        let quantiles = &lateness.values("")[3 * bus..3 * bus + 3];
        assert!(quantiles.is_sorted() && quantiles[0] > 0.0, "{lateness:?}");
        let (sent, skipped) = (of("syncs_total").values("")[bus], of("sync_overruns_total"));
        let count = lateness.values("_count")[bus];
        assert!(count > 50.0 && sent <= count + 1.0, "{lateness:?}");
        assert!(count <= sent + skipped.values("")[bus] + 50.0);
        let sum = lateness.values("_sum")[bus];
        assert!(
            sum > 0.0 && sum / count <= quantiles[2].max(1.0),
            "{lateness:?}"
        );
        let load = of("bus_load_ratio").values("")[bus];
        assert!(load > 0.0 && load < 1.0, "{load}");
    }
}

#[test]
fn each_kind_of_machine_says_how_punctual_its_syncs_and_how_full_its_buses_are() {
    // No bus makes a difference to it.
    if !rigs().contains(&Rig::Pty) {
        return;
    }
    check_machine(&LINEAR, &["can0"], 1);
    check_machine(&UVW, &["can0"], 3);
    check_machine(&ROTARY, &["can0"], 1);
    check_machine(&VOLUMETRIC, &["can0"], 3);
    // A serial line has neither SYNCs nor a load.
    check_machine(&UVW_COPLEY, &[], 3);
}

#[test]
#[should_panic(expected = "twice")]
fn a_sample_that_comes_twice_is_found() {
    parse("# HELP a_total A.\n# TYPE a_total counter\na_total{x=\"1\"} 1\na_total{x=\"1\"} 2\n");
}

#[test]
#[should_panic(expected = "truestage_clock_seconds")]
fn a_counter_that_is_not_called_so_is_found() {
    parse(
        "# HELP truestage_clock_seconds T.\n# TYPE truestage_clock_seconds counter\ntruestage_clock_seconds 1\n",
    );
}

#[test]
fn a_label_may_say_anything() {
    let text = "# HELP a A.\n# TYPE a gauge\na{x=\"1 \\\"}, \\\\ \\n\",y=\"\"} 2.5\n";
    let families = parse(text);
    assert_eq!(families["a"].samples[0].1["x"], "1 \"}, \\ \n");
}
