//! What is said of a platform whose readings contradict its configuration.

use core::fmt;

use compensator::platform::cause::{Cause, Explained, Verdict};
use units::{Radians, Short};

use crate::hardware::camera::CameraKeys;

/// A turn of the picture this close to none, or to half a turn, is none.
const MIRROR_TURN_MAX: Radians = Radians(0.02);

/// What the readings say of the configuration, for an operator.
#[derive(Clone, Debug)]
pub struct Explanation {
    pub(super) verdict: Verdict,
    /// The screws, and nanometres a count of each as configured.
    pub(super) screws: Vec<(String, f64)>,
    /// Its name, and the keys that turn its numbers into poses.
    pub(super) camera: (String, CameraKeys),
}

impl Explanation {
    /// Whether something is named.
    pub(crate) const fn names_a_cause(&self) -> bool {
        !self.verdict.causes.is_empty()
    }
}

impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Verdict {
            causes,
            as_configured,
            ..
        } = &self.verdict;
        let as_configured = as_configured.um();
        write!(
            f,
            "as configured, what the camera saw is off by {as_configured:.1} µm (rms)"
        )?;
        for (at, Explained { cause, misfit }) in causes.iter().enumerate() {
            let or = if at == 0 { "; probably" } else { "; or" };
            write!(f, "{or} {}: ", self.what(cause))?;
            self.change(f, cause)?;
            write!(f, ", which leaves {:.1} µm", misfit.um())?;
        }
        if causes.is_empty() {
            f.write_str(
                "; no mirrored or turned camera, wrong unit of it, exchanged screws or wrong \
                 resolution of one or all explains it by itself",
            )?;
        }
        self.gains(f)
    }
}

impl Explanation {
    fn name(&self, screw: usize) -> &str {
        &self.screws[screw].0
    }

    fn what(&self, cause: &Cause) -> String {
        match cause {
            Cause::CameraFrame { mirrored, turn } => picture(*mirrored, *turn),
            Cause::CameraLength { factor } => {
                format!(
                    "the camera's lengths are {} times too long",
                    Rounded(*factor)
                )
            }
            Cause::CameraAngle { factor } => {
                format!(
                    "the camera's angles are {} times too large",
                    Rounded(*factor)
                )
            }
            Cause::Exchanged { order } => {
                let moved = |(screw, by): (usize, &usize)| {
                    (screw != *by).then(|| format!("{} moved {}", self.name(screw), self.name(*by)))
                };
                let moved: Vec<_> = order.iter().enumerate().filter_map(moved).collect();
                format!("screws are exchanged ({})", moved.join(", "))
            }
            Cause::Screw { which, factor } => {
                format!("screw {} {}", self.name(*which), goes(*factor))
            }
            Cause::Screws { factor } => format!("every screw {}", goes(*factor)),
            Cause::Still { which } => format!("screw {} moves nothing", self.name(*which)),
        }
    }

    /// What to do about it.
    fn change(&self, f: &mut fmt::Formatter<'_>, cause: &Cause) -> fmt::Result {
        let (camera, keys) = &self.camera;
        match cause {
            Cause::CameraFrame { mirrored, turn } => {
                // A mirror in front of a turn is a mirror behind the turn the other way.
                let before = if *mirrored {
                    -keys.rotation
                } else {
                    keys.rotation
                };
                let rotation = *turn + before;
                write!(
                    f,
                    "`mirrored = {}` and `rotation_deg = {}` in [camera.{camera}]",
                    keys.mirrored != *mirrored,
                    tenths(rotation - rotation.whole_turns())
                )
            }
            Cause::CameraLength { factor } => {
                let unit = Rounded(keys.length_um_per_unit / factor);
                write!(f, "`length_um_per_unit = {unit}` in [camera.{camera}]")
            }
            Cause::CameraAngle { factor } => {
                let unit = Rounded(keys.angle_arcsec_per_unit / factor);
                write!(
                    f,
                    "`angle_arcsec_per_unit = {unit}` in [camera.{camera}], or levers in \
                     [[platform.actuator]] (`point_mm`) that are {} times too long",
                    Rounded(*factor)
                )
            }
            Cause::Exchanged { order } => self.exchange(f, order),
            Cause::Screw { which, factor } => self.resolution(f, *which, *factor),
            Cause::Screws { factor } => {
                for which in 0..self.screws.len() {
                    f.write_str(if which == 0 { "" } else { ", " })?;
                    self.resolution(f, which, *factor)?;
                }
                Ok(())
            }
            Cause::Still { which } => {
                let name = self.name(*which);
                write!(
                    f,
                    "look at the coupling of {name} and whether [axis.{name}] is its drive"
                )
            }
        }
    }

    fn exchange(&self, f: &mut fmt::Formatter<'_>, order: &[usize]) -> fmt::Result {
        let moved = order.iter().enumerate().filter(|(screw, by)| screw != *by);
        for (at, (screw, by)) in moved.enumerate() {
            let comma = if at == 0 { "" } else { ", " };
            let (now, then) = (self.name(*by), self.name(screw));
            write!(
                f,
                "{comma}`axis = \"{then}\"` in the [[platform.actuator]] of {now}"
            )?;
        }
        f.write_str(", or change the cables")
    }

    /// A count is so many times longer.
    fn resolution(&self, f: &mut fmt::Formatter<'_>, which: usize, factor: f64) -> fmt::Result {
        let (name, resolution_nm) = &self.screws[which];
        let resolution = Rounded(resolution_nm * factor);
        write!(f, "`resolution_nm = {resolution}` in [axis.{name}]")
    }

    fn gains(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (screw, row) in self.verdict.gains.iter().enumerate() {
            let lead = if screw == 0 { "; " } else { ", " };
            write!(f, "{lead}1 mm of {} was seen as", self.name(screw))?;
            for (other, gain) in row.iter().enumerate() {
                write!(f, " {} {gain:+.3}", self.name(other))?;
            }
        }
        f.write_str(" mm")
    }
}

fn picture(mirrored: bool, turn: Radians) -> String {
    let upside_down = turn - Radians(core::f64::consts::PI);
    let upside_down = upside_down - upside_down.whole_turns();
    match mirrored {
        true if turn.abs() < MIRROR_TURN_MAX => "the picture is mirrored in y".into(),
        true if upside_down.abs() < MIRROR_TURN_MAX => "the picture is mirrored in x".into(),
        true => format!(
            "the picture is mirrored in y and turned by {}°",
            tenths(turn)
        ),
        false => format!("the camera is turned by {}°", tenths(turn)),
    }
}

fn goes(factor: f64) -> String {
    let way = if factor < 0.0 { "the other way, " } else { "" };
    match Rounded(factor.abs()).to_string().as_str() {
        "1" => "goes the other way".into(),
        times => format!("goes {way}{times} times as far as commanded"),
    }
}

/// Degrees, as sure as a platform's errors let them be.
fn tenths(angle: Radians) -> Short {
    Short((angle.degrees() * 10.0).round() / 10.0)
}

/// A number to three digits: what is fitted takes part of the screws' own errors.
#[derive(Clone, Copy)]
struct Rounded(f64);

impl fmt::Display for Rounded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rounded: f64 = format!("{:.2e}", self.0).parse().unwrap_or(self.0);
        Short(rounded).fmt(f)
    }
}
