//! The alternatives, each with its number fitted to the readings.

use units::portable::{atan2, sin, sin_cos};
use units::{Metres, Radians};

use super::super::{Platform, Pose};
use super::{Cause, STOPS_MIN, Sighting, Tolerance};

/// Steps of Gauss and Newton towards the unit of the camera's angles, and of the screws' factors; the first
/// one is nearly right.
const STEPS: usize = 6;

/// By how much, relatively, a number is changed to see what depends on it.
const NUDGE: f64 = 1e-6;

/// The same where it is 0: even of turns seen thousands of times too large a small one.
const NUDGE_FROM_NOTHING: f64 = 1e-9;

/// The readings of a run in which one screw was moved at a time.
pub(super) struct Readings<'a> {
    platform: &'a Platform,
    datum: Pose,
    /// Where each screw was told that it is when it was homed, metres.
    homed: Vec<f64>,
    stops: Vec<Stop>,
}

/// One of them.
struct Stop {
    /// The screw that was moved.
    moved: usize,
    /// Metres.
    commanded: f64,
    seen: Pose,
}

impl<'a> Readings<'a> {
    /// `None` where they show too little of some screw.
    pub(super) fn new(
        platform: &'a Platform,
        homed: &[Metres],
        datum: Pose,
        all: &[Sighting],
    ) -> Option<Self> {
        let stops: Vec<Stop> = all.iter().filter_map(alone).collect();
        let count = platform.actuators().len();
        let shown = |screw| stops.iter().filter(|it| it.moved == screw).count() >= STOPS_MIN;
        (0..count).all(shown).then_some(Self {
            platform,
            datum,
            homed: homed.iter().map(|it| it.value()).collect(),
            stops,
        })
    }

    fn screws(&self) -> usize {
        self.platform.actuators().len()
    }

    /// The stroke of every screw by each stop's pose, metres, after `change`.
    fn strokes(&self, change: impl Fn(Pose) -> Pose) -> Vec<Vec<f64>> {
        self.strokes_from(Pose::default(), change)
    }

    /// The same, where the platform was in this pose when its screws stood at their zero.
    fn strokes_from(&self, zero: Pose, change: impl Fn(Pose) -> Pose) -> Vec<Vec<f64>> {
        let datum = change(self.datum);
        let of = |stop: &Stop| {
            let pose = change(stop.seen).where_datum_was_at(zero, datum);
            let strokes = self.platform.strokes(pose);
            strokes.into_iter().map(Metres::value).collect()
        };
        self.stops.iter().map(of).collect()
    }

    /// Where screws truly stand at their zero that go so many times as far as they are commanded:
    /// their coordinates begin where they were homed, at the other end where they go the other way.
    fn zeros(&self, factors: &[f64]) -> Vec<f64> {
        let zero = |(homed, factor): (&f64, &f64)| homed * (factor.signum() - factor);
        self.homed.iter().zip(factors).map(zero).collect()
    }

    /// The pose of screws that stand there.
    fn pose_of(&self, strokes: &[f64]) -> Pose {
        let strokes: Vec<_> = strokes.iter().copied().map(Metres).collect();
        let found = self.platform.forward(&strokes);
        found.map_or(Pose::default(), |it| it.pose)
    }

    /// What each screw was commanded at each stop.
    fn commands(&self) -> Vec<Vec<f64>> {
        let of = |stop: &Stop| {
            let mut commands = vec![0.0; self.screws()];
            commands[stop.moved] = stop.commanded;
            commands
        };
        self.stops.iter().map(of).collect()
    }
}

/// A stop with one screw away from its zero; others tell nothing of factors.
fn alone(sighting: &Sighting) -> Option<Stop> {
    let mut away = sighting.commanded.iter().enumerate();
    let (moved, commanded) = away.find(|(_, it)| **it != Metres::ZERO)?;
    away.all(|(_, it)| *it == Metres::ZERO).then_some(Stop {
        moved,
        commanded: commanded.value(),
        seen: sighting.seen,
    })
}

/// The deviations under a cause: of every screw while every screw is moved, metres.
pub(super) fn cells(readings: &Readings<'_>, cause: Option<&Cause>) -> Vec<Vec<f64>> {
    let count = readings.screws();
    let factors = cause.map_or_else(|| vec![1.0; count], |it| it.factors(count));
    let zeros = readings.zeros(&factors);
    let strokes = readings.strokes_from(readings.pose_of(&zeros), |pose| {
        cause.map_or(pose, |it| it.corrected(pose))
    });
    let mut cells = vec![Vec::new(); count * count];
    for (stop, (seen, commands)) in readings
        .stops
        .iter()
        .zip(strokes.iter().zip(readings.commands()))
    {
        let expected = cause.map_or_else(|| commands.clone(), |it| it.expected(&commands));
        for screw in 0..count {
            let deviation = seen[screw] - zeros[screw] - expected[screw];
            cells[stop.moved * count + screw].push(deviation);
        }
    }
    cells
}

/// The share of each screw's strokes (rows) that is seen of every screw (columns).
pub(super) fn gains(readings: &Readings<'_>) -> Vec<Vec<f64>> {
    let strokes = readings.strokes(|pose| pose);
    let gain = |moved: usize, screw: usize| {
        let stops = readings.stops.iter().zip(&strokes);
        let own = stops.filter(|(stop, _)| stop.moved == moved);
        quotient(own.map(|(stop, seen)| (seen[screw], stop.commanded)))
    };
    let row = |moved| {
        (0..readings.screws())
            .map(|screw| gain(moved, screw))
            .collect()
    };
    (0..readings.screws()).map(row).collect()
}

/// The `k` with which `b` multiplied is nearest to `a`.
fn quotient(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (mut product, mut square) = (0.0, 0.0);
    for (a, b) in pairs {
        product += a * b;
        square += b * b;
    }
    product / square
}

impl Cause {
    /// A pose as the camera would have given it without this cause.
    fn corrected(&self, pose: Pose) -> Pose {
        let scaled = |length: f64, angle: f64| Pose {
            x: pose.x / length,
            y: pose.y / length,
            angle: Radians(pose.angle.value() / angle),
        };
        match *self {
            Self::CameraFrame { mirrored, turn } => turned(pose, mirrored, sin_cos(turn.value())),
            Self::CameraLength { factor } => scaled(factor, 1.0),
            Self::CameraAngle { factor } => scaled(1.0, factor),
            Self::Exchanged { .. }
            | Self::Screw { .. }
            | Self::Screws { .. }
            | Self::Still { .. } => pose,
        }
    }

    /// How many times as far as commanded each screw goes.
    fn factors(&self, count: usize) -> Vec<f64> {
        let mut factors = vec![1.0; count];
        match self {
            Self::Screw { which, factor } => factors[*which] = *factor,
            Self::Screws { factor } => factors.fill(*factor),
            Self::CameraFrame { .. }
            | Self::CameraLength { .. }
            | Self::CameraAngle { .. }
            | Self::Exchanged { .. }
            | Self::Still { .. } => {}
        }
        factors
    }

    /// The strokes that follow from commands under this cause.
    fn expected(&self, commands: &[f64]) -> Vec<f64> {
        let factors = self.factors(commands.len());
        let far = commands.iter().zip(&factors);
        let mut strokes: Vec<f64> = far.map(|(it, factor)| it * factor).collect();
        match self {
            Self::Exchanged { order } => {
                for (screw, actuator) in order.iter().enumerate() {
                    strokes[*actuator] = commands[screw];
                }
            }
            Self::Still { which } => strokes[*which] = 0.0,
            Self::CameraFrame { .. }
            | Self::CameraLength { .. }
            | Self::CameraAngle { .. }
            | Self::Screw { .. }
            | Self::Screws { .. } => {}
        }
        strokes
    }
}

/// A pose mirrored in y where asked for, then turned.
fn turned(pose: Pose, mirrored: bool, (sin, cos): (f64, f64)) -> Pose {
    let sign = if mirrored { -1.0 } else { 1.0 };
    let (x, y) = (pose.x, pose.y * sign);
    Pose {
        x: x * cos - y * sin,
        y: x * sin + y * cos,
        angle: Radians(sign * pose.angle.value()),
    }
}

/// Everything that is looked at, but for changes too small to be mistakes.
pub(super) fn alternatives(readings: &Readings<'_>, tolerance: Tolerance) -> Vec<Cause> {
    let screws = 0..readings.screws();
    let mut all: Vec<Cause> = exchanges(readings.screws());
    all.extend([false, true].map(|mirrored| camera_frame(readings, mirrored)));
    all.push(Cause::CameraLength {
        factor: camera_length(readings),
    });
    all.push(Cause::CameraAngle {
        factor: camera_angle(readings),
    });
    all.extend(
        screws
            .clone()
            .map(|which| screw(readings, which, tolerance)),
    );
    all.push(Cause::Screws {
        factor: screw_factor(readings, screws),
    });
    all.retain(|it| is_mistake(it, tolerance.slope));
    all
}

/// Whether it is more than what a sound machine may show; false for what is not finite.
fn is_mistake(cause: &Cause, slope: f64) -> bool {
    let differs = |factor: f64| factor.is_finite() && (factor - 1.0).abs() > slope;
    match cause {
        Cause::CameraFrame { mirrored, turn } => {
            turn.is_finite() && (*mirrored || sin(turn.value() / 2.0).abs() > slope / 2.0)
        }
        Cause::CameraLength { factor } | Cause::CameraAngle { factor } => {
            *factor > 0.0 && differs(*factor)
        }
        Cause::Screw { factor, .. } | Cause::Screws { factor } => {
            *factor != 0.0 && differs(*factor)
        }
        Cause::Exchanged { .. } | Cause::Still { .. } => true,
    }
}

/// Every order of `count` screws but their own.
fn exchanges(count: usize) -> Vec<Cause> {
    let mut orders = vec![Vec::new()];
    for _ in 0..count {
        let longer = |order: Vec<usize>| {
            let free = (0..count).filter(|it| !order.contains(it));
            let grown = free.map(|it| [order.as_slice(), &[it]].concat());
            grown.collect::<Vec<_>>()
        };
        orders = orders.into_iter().flat_map(longer).collect();
    }
    let own: Vec<usize> = (0..count).collect();
    let others = orders.into_iter().filter(|order| *order != own);
    others.map(|order| Cause::Exchanged { order }).collect()
}

/// The turn that fits best: strokes are linear in its cosine and its sine.
fn camera_frame(readings: &Readings<'_>, mirrored: bool) -> Cause {
    let at = |pose: Pose, turn| turned(pose, mirrored, turn);
    let alone = readings.strokes(|pose| at(pose, (0.0, 0.0)));
    let cosine = minus(readings.strokes(|pose| at(pose, (0.0, 1.0))), &alone);
    let sine = minus(readings.strokes(|pose| at(pose, (1.0, 0.0))), &alone);
    let wanted = minus(readings.commands(), &alone);
    let (cc, ss, cs) = (
        product(&cosine, &cosine),
        product(&sine, &sine),
        product(&cosine, &sine),
    );
    let (c, s) = (product(&cosine, &wanted), product(&sine, &wanted));
    // Cramer's rule; the common determinant is positive and does not change the direction.
    let turn = atan2(cc * s - cs * c, ss * c - cs * s);
    Cause::CameraFrame {
        mirrored,
        turn: Radians(turn),
    }
}

/// Strokes are linear in the camera's lengths.
fn camera_length(readings: &Readings<'_>) -> f64 {
    let turn_alone = readings.strokes(|pose| Pose {
        x: Metres::ZERO,
        y: Metres::ZERO,
        ..pose
    });
    let lengths = minus(readings.strokes(|pose| pose), &turn_alone);
    let wanted = minus(readings.commands(), &turn_alone);
    product(&lengths, &lengths) / product(&lengths, &wanted)
}

/// By Gauss's and Newton's steps from no turn at all: there the strokes are linear in the turn,
/// however many turns too large it is seen.
fn camera_angle(readings: &Readings<'_>) -> f64 {
    let strokes = |share: f64| {
        readings.strokes(|pose| Pose {
            angle: Radians(share * pose.angle.value()),
            ..pose
        })
    };
    let mut share = 0.0;
    for _ in 0..STEPS {
        let here = strokes(share);
        let nudge = if share == 0.0 {
            NUDGE_FROM_NOTHING
        } else {
            NUDGE * share
        };
        let slope = minus(strokes(share + nudge), &here);
        let wanted = minus(readings.commands(), &here);
        share += nudge * product(&slope, &wanted) / product(&slope, &slope);
    }
    1.0 / share
}

fn screw(readings: &Readings<'_>, which: usize, tolerance: Tolerance) -> Cause {
    let factor = screw_factor(readings, which..which + 1);
    let own = readings.stops.iter().filter(|it| it.moved == which);
    let longest = own.map(|it| it.commanded.abs()).fold(0.0, f64::max);
    // What is seen to move by less than a deviation may be does not move.
    if factor.abs() * longest <= tolerance.size.value() {
        return Cause::Still { which };
    }
    Cause::Screw { which, factor }
}

/// How far these screws go, by their own strokes. Where they stand at their zero, and with that the
/// platform's geometry, depends on it.
fn screw_factor(readings: &Readings<'_>, screws: core::ops::Range<usize>) -> f64 {
    let mut factor = 1.0;
    for _ in 0..STEPS {
        let mut factors = vec![1.0; readings.screws()];
        factors[screws.clone()].fill(factor);
        let zeros = readings.zeros(&factors);
        let strokes = readings.strokes_from(readings.pose_of(&zeros), |pose| pose);
        let stops = readings.stops.iter().zip(&strokes);
        let own = stops.filter(|(stop, _)| screws.contains(&stop.moved));
        let moved = own.map(|(stop, seen)| (seen[stop.moved] - zeros[stop.moved], stop.commanded));
        factor = quotient(moved);
    }
    factor
}

fn minus(mut from: Vec<Vec<f64>>, other: &[Vec<f64>]) -> Vec<Vec<f64>> {
    for (a, b) in from.iter_mut().flatten().zip(other.iter().flatten()) {
        *a -= b;
    }
    from
}

fn product(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    pairs.map(|(a, b)| a * b).sum()
}
