//! What is doubtful of what a platform is to reach, and of what sees it.

use units::{Radians, Short};

use crate::config::MachineConfig;
use crate::config::judge::{ANY_REACHES, Finding, Judge};
use crate::platform::PlatformConfig;

pub(super) fn check(found: &mut Vec<Finding>, config: &MachineConfig, platform: &PlatformConfig) {
    check_camera(found, config, platform);
    let judge = &mut Judge::at("platform".into(), found);
    let Some(size_um) = platform.compensation.as_ref().map(|it| it.size_limit_um) else {
        return;
    };
    let verified = platform.verify.as_ref().map(|it| it.tolerance_um);
    let aligned = platform.align.as_ref().map(|it| it.tolerance_um);
    for (key, tolerance_um) in [
        ("verify.tolerance_um", verified),
        ("align.tolerance_um", aligned),
    ] {
        if let Some(tolerance_um) = tolerance_um.filter(|it| *it > ANY_REACHES * size_um) {
            judge.say(
                key,
                format!(
                    "{} µm are far more than the errors of a screw that are corrected, {} µm (size_limit_um): any platform \
                     reaches that",
                    Short(tolerance_um),
                    Short(size_um)
                ),
                "check it: it is in micrometres",
            );
        }
    }
    let closure_um = platform.calibrate.as_ref().map(|it| it.closure_limit_um);
    if let Some(closure_um) = closure_um.filter(|it| *it > size_um) {
        judge.say(
            "calibrate.closure_limit_um",
            format!(
                "the zero may be {} µm off at the end, and errors are corrected up to {} µm (size_limit_um)",
                Short(closure_um),
                Short(size_um)
            ),
            "give a fraction of what the platform is to reach",
        );
    }
}

/// What sees the pose must see it better than it is to be.
fn check_camera(found: &mut Vec<Finding>, config: &MachineConfig, platform: &PlatformConfig) {
    let tolerance_um = platform.verify.as_ref().map(|it| it.tolerance_um);
    let camera = config.camera.get(&platform.camera);
    let (Some(tolerance_um), Some(camera)) = (tolerance_um, camera) else {
        return;
    };
    let judge = &mut Judge::at(format!("camera.{}", platform.camera), found);
    let angle = Radians::from_arcsec(camera.standard_uncertainty_arcsec);
    let at_edge_um = angle.value() * platform.edge_mm * 1e3;
    for (key, uncertain_um, place) in [
        (
            "standard_uncertainty_um",
            camera.standard_uncertainty_um,
            "",
        ),
        (
            "standard_uncertainty_arcsec",
            at_edge_um,
            " at the edge (edge_mm)",
        ),
    ] {
        if uncertain_um > tolerance_um {
            judge.say(
                key,
                format!(
                    "the camera is uncertain by {} µm{place}, and the platform is to be within {} µm (tolerance_um)",
                    Short((uncertain_um * 1e3).round() * 1e-3),
                    Short(tolerance_um)
                ),
                "check it: nothing can be shown to be within the tolerance",
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::config::warnings::told::check;

    const UVW: &str = include_str!("../../../../configs/machines/uvw.toml");

    #[test]
    fn tolerances_that_any_platform_keeps_are_told() {
        let edit = ("tolerance_um = 2.0", "tolerance_um = 2000.0");
        let says = "2000 µm are far more than the errors of a screw that are corrected, 20 µm";
        check(UVW, &[edit], &["platform.verify.tolerance_um"], says);
        let edit = ("tolerance_um = 0.5", "tolerance_um = 500.0");
        check(
            UVW,
            &[edit],
            &["platform.align.tolerance_um"],
            "500 µm are far more",
        );
        let edit = ("closure_limit_um = 1.0", "closure_limit_um = 1000.0");
        let key = "platform.calibrate.closure_limit_um";
        check(UVW, &[edit], &[key], "1000 µm off at the end");
    }

    #[test]
    fn a_camera_that_cannot_see_the_tolerance_is_told() {
        let edit = ("uncertainty_um = 0.1", "uncertainty_um = 100.0");
        let key = "camera.eye.standard_uncertainty_um";
        let says = "uncertain by 100 µm, and the platform is to be within 2 µm";
        check(UVW, &[edit], &[key], says);
        let edit = ("uncertainty_arcsec = 0.3", "uncertainty_arcsec = 300.0");
        let key = "camera.eye.standard_uncertainty_arcsec";
        let says = "uncertain by 116.355 µm at the edge";
        check(UVW, &[edit], &[key], says);
    }
}
