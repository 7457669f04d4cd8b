//! The computer: may threads go ahead of others, which clock counts, what a processor saves.

use std::fs;
use std::path::{Path, PathBuf};

use super::checked::Checked;

/// CAP_SYS_NICE (capabilities(7)).
const MAY_GO_AHEAD: u64 = 1 << 23;
/// Clock sources that take microseconds to be read, or jump.
const SLOW_CLOCKS: [&str; 4] = ["hpet", "acpi_pm", "pit", "jiffies"];

/// Where the files of a kernel are.
#[derive(Clone, Debug)]
pub(super) struct Host {
    root: PathBuf,
}

impl Host {
    pub(super) fn this() -> Self {
        Self::at(Path::new("/"))
    }

    pub(super) fn at(root: &Path) -> Self {
        Self {
            root: root.to_owned(),
        }
    }

    /// What a file of the kernel says; `None` where it is not there.
    pub(super) fn read(&self, path: &str) -> Option<String> {
        let text = fs::read_to_string(self.root.join(path)).ok()?;
        Some(text.trim().to_owned())
    }

    pub(super) fn has(&self, path: &str) -> bool {
        self.root.join(path).exists()
    }

    pub(super) fn checks(&self) -> Vec<Checked> {
        let found = [self.rights(), self.clock(), self.governor()];
        found.into_iter().flatten().collect()
    }

    /// Whether this process may put its threads ahead of others.
    fn rights(&self) -> Option<Checked> {
        const SUBJECT: &str = "real-time rights";
        let status = self.read("proc/self/status")?;
        let limits = self.read("proc/self/limits")?;
        let capabilities = field(&status, "CapEff:")?;
        let has = u64::from_str_radix(capabilities, 16).is_ok_and(|it| it & MAY_GO_AHEAD != 0);
        let priority = field(&limits, "Max realtime priority").unwrap_or("0");
        Some(match (has, priority) {
            (true, _) => Checked::good(SUBJECT, "threads may go ahead of all others"),
            (false, "0") => Checked::doubtful(
                SUBJECT,
                "none: how punctual a SYNC is depends on what else this computer does",
                "`@dialout - rtprio 50` in /etc/security/limits.d/truestage.conf, then log in again; or run the \
                 unit packaging/truestage@.service",
            ),
            (false, priority) => Checked::good(SUBJECT, format!("priorities up to {priority}")),
        })
    }

    fn clock(&self) -> Option<Checked> {
        const SUBJECT: &str = "clock";
        let used = self.read("sys/devices/system/clocksource/clocksource0/current_clocksource")?;
        Some(match SLOW_CLOCKS.contains(&used.as_str()) {
            true => Checked::doubtful(
                SUBJECT,
                format!("{used}: slow to read, and coarse"),
                "see what /sys/devices/system/clocksource/clocksource0/available_clocksource offers; tsc is usual",
            ),
            false => Checked::good(SUBJECT, used),
        })
    }

    /// Nothing is said where frequencies are not scaled.
    fn governor(&self) -> Option<Checked> {
        const SUBJECT: &str = "processor";
        let used = self.read("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")?;
        Some(match used.as_str() {
            "powersave" => Checked::doubtful(
                SUBJECT,
                "its governor saves power: it wakes up late",
                "sudo cpupower frequency-set -g performance",
            ),
            used => Checked::good(SUBJECT, format!("governor {used}")),
        })
    }
}

/// The first word behind `name` at the beginning of a line.
fn field<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    let line = text.lines().find_map(|it| it.strip_prefix(name))?;
    line.split_whitespace().next()
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::checked::Verdict;
    use super::super::checked::tests::expect;
    use super::*;

    /// A computer with these files, and nothing else.
    pub(in super::super) fn host(files: &[(&str, &str)]) -> (tempfile::TempDir, Host) {
        let folder = tempfile::tempdir().unwrap();
        for (path, text) in files {
            let path = folder.path().join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        let host = Host::at(folder.path());
        (folder, host)
    }

    #[track_caller]
    fn check_rights(capabilities: &str, priority: &str, verdict: Verdict, says: [&str; 2]) {
        let status = format!("Name:\ttruestage\nCapEff:\t{capabilities}\n");
        let limits = format!(
            "Limit                     Soft Limit           Hard Limit           Units     \n\
             Max realtime priority     {priority}                    {priority}                    \n"
        );
        let files = [
            ("proc/self/status", status.as_str()),
            ("proc/self/limits", &limits),
        ];
        let (_folder, host) = host(&files);
        expect(&host.checks(), "real-time rights", verdict, says);
    }

    #[test]
    fn rights_are_those_of_root_or_of_a_limit() {
        let none = "0000000000000000";
        check_rights("000001ffffffffff", "0", Verdict::Good, ["ahead of all", ""]);
        check_rights(none, "50", Verdict::Good, ["up to 50", ""]);
        check_rights(none, "0", Verdict::Doubtful, ["none", "rtprio"]);
    }

    #[test]
    fn a_slow_clock_and_a_sleepy_processor_are_told() {
        let clock = "sys/devices/system/clocksource/clocksource0/current_clocksource";
        let governor = "sys/devices/system/cpu/cpu0/cpufreq/scaling_governor";
        let (_folder, slow) = host(&[(clock, "hpet\n"), (governor, "powersave\n")]);
        expect(&slow.checks(), "clock", Verdict::Doubtful, ["hpet", "tsc"]);
        let says = ["saves power", "performance"];
        expect(&slow.checks(), "processor", Verdict::Doubtful, says);
        let (_folder, quick) = host(&[(clock, "tsc\n"), (governor, "performance\n")]);
        expect(&quick.checks(), "clock", Verdict::Good, ["tsc", ""]);
        expect(
            &quick.checks(),
            "processor",
            Verdict::Good,
            ["performance", ""],
        );
        let (_folder, nothing) = host(&[]);
        assert!(nothing.checks().is_empty());
    }
}
