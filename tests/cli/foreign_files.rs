//! Strange files in the folder of the journals, as clients of the service meet them.

use std::fs;
use std::path::Path;

use nix::sys::signal::Signal;
use nix::sys::stat::Mode;
use nix::unistd::mkfifo;
use serde_json::json;

use crate::programs::{Bench, live_rigs};
use crate::serve::{ask, fetch, keep};

/// The most memory that a process has had, in kB.
fn most_memory_kb(process: u32) -> u64 {
    let status = fs::read_to_string(format!("/proc/{process}/status")).expect("it runs");
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let number = line.and_then(|text| text.split_whitespace().next());
    number.and_then(|text| text.parse().ok()).expect("a number")
}

fn put_foreign_files(runs: &Path) {
    fs::create_dir_all(runs).expect("the folder can be made");
    mkfifo(&runs.join("fifo.jsonl"), Mode::S_IRWXU).expect("a FIFO can be made");
    std::os::unix::fs::symlink("../lease", runs.join("link.jsonl")).expect("a link can be made");
    let sparse = fs::File::create(runs.join("sparse.jsonl")).expect("a file can be made");
    sparse.set_len(3 << 30).expect("it can be sparse");
    fs::create_dir(runs.join("folder.jsonl")).expect("a folder can be made");
}

#[test]
fn a_service_reads_only_regular_files_of_bounded_size() {
    for rig in live_rigs() {
        let bench = Bench::new(rig);
        put_foreign_files(&bench.records().join("runs"));
        let service = keep(&bench);
        let (status, journals) = ask(bench.folder(), "GET /v1/journals", &json!({}));
        assert_eq!(status, 200, "{journals}");
        let journals = journals.as_array().expect("a list");
        for name in ["fifo", "link", "sparse", "folder"] {
            let told = journals.iter().find(|journal| journal["name"] == name);
            assert!(told.expect("it is told")["verb"].is_null(), "{told:?}");
            for resource in ["journals", "reports"] {
                let request = format!("GET /v1/{resource}/{name}");
                let (status, said) = fetch(bench.folder(), &request, &json!({}));
                assert_eq!(status, 503, "{request}: {said}");
            }
        }
        let most = most_memory_kb(service.id());
        assert!(most < 300_000, "{most} kB");
        service.signal(Signal::SIGTERM);
        assert_eq!(service.end().code, Some(0));
    }
}
