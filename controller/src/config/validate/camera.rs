//! Whether an image controller's section makes sense.

use wire::in_sight::Cell;

use crate::config::judge::{Finding, Judge};
use crate::config::{CameraConfig, MachineConfig};

pub(super) fn check_cameras(config: &MachineConfig, findings: &mut Vec<Finding>) {
    for (name, camera) in &config.camera {
        let mut judge = Judge::at(format!("camera.{name}"), findings);
        if config.instrument.contains_key(name) {
            judge.say(
                "",
                format!("an instrument is called `{name}`, too"),
                "give every instrument a name of its own",
            );
        }
        check_camera(&mut judge, config, camera);
    }
}

fn check_camera(judge: &mut Judge<'_>, config: &MachineConfig, camera: &CameraConfig) {
    judge.known("line", &camera.line, &config.serial, "serial line");
    let job = camera.job.to_ascii_lowercase();
    if !(job.ends_with(".job") || job.ends_with(".jobx")) {
        judge.say(
            "job",
            format!("`{}` is no job", camera.job),
            "give the name that In-Sight Explorer shows, with `.job` or `.jobx`",
        );
    }
    if Cell::parse(&camera.result_cell).is_none() {
        judge.say(
            "result_cell",
            format!("`{}` is no cell", camera.result_cell),
            "give a letter and a row, such as \"C7\"",
        );
    }
}

#[cfg(test)]
mod tests {
    use crate::Edit;
    use crate::config::{ConfigError, parse};

    const UVW: &str = include_str!("../../../../configs/machines/uvw.toml");

    #[track_caller]
    fn check(from: &str, to: &str, key: &str) {
        match parse(&UVW.edit(from, to), "uvw.toml") {
            Err(ConfigError::Invalid { findings }) => {
                assert!(findings.iter().any(|it| it.key == key), "{findings:?}");
            }
            other => panic!("{to}: {other:?}"),
        }
    }

    #[test]
    fn the_shipped_platform_is_sound() {
        parse(UVW, "uvw.toml").unwrap_or_else(|error| panic!("{error}"));
    }

    #[test]
    fn what_no_camera_can_be_is_found_where_it_stands() {
        check("line = \"vision\"", "line = \"visoin\"", "camera.eye.line");
        check("platform.job", "platform", "camera.eye.job");
        check("\"C7\"", "\"C400\"", "camera.eye.result_cell");
        let key = "camera.eye.length_um_per_unit";
        check("um_per_unit = 1.0", "um_per_unit = nan", key);
        let key = "camera.eye.angle_arcsec_per_unit";
        check("arcsec_per_unit = 1.0", "arcsec_per_unit = 0.0", key);
        check(
            "rotation_deg = 0.0",
            "rotation_deg = inf",
            "camera.eye.rotation_deg",
        );
        check("targets = 2", "targets = 0", "camera.eye.targets");
        let key = "camera.eye.score_min_percent";
        check("score_min_percent = 60.0", "score_min_percent = 101.0", key);
        let key = "camera.eye.inspection_timeout_ms";
        check("timeout_ms = 2000.0", "timeout_ms = 0.0", key);
    }
}
