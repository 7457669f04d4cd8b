//! Journals of a linear axis: each line by itself, and against those before it.

use machine::records::sound::{
    ANGLE_RAD, ANGLE_U_RAD, COUNT_MAX, ERROR_U_M, Judged, LENGTH_M, PASSES_MAX, PLACE_M, RATIO,
    SECONDS, VOLTS, approach, as_many, counted, is, number, numbers, once, optional, unsound,
};
use machine::records::{ClosureEntry, JournalHeader, Log};
use serde::{Deserialize, Serialize};

use crate::linear::{
    CriterionEntry, HallSweepEntry, JobEntry, PointEntry, ReachedEntry, RotationEntry, SyncsEntry,
    WentOnEntry, ZeroEntry,
};
use crate::store::budget::FREEDOM;

/// A line of such a journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "entry", rename_all = "snake_case")]
pub enum LinearEntry {
    /// A measured point.
    Point(PointEntry),
    /// By what a verification is judged.
    Criterion(CriterionEntry),
    /// What a zero search read on its way.
    HallSweep(HallSweepEntry),
    /// How late the SYNCs of a bus were.
    Syncs(SyncsEntry),
    /// A zero.
    Zero(ZeroEntry),
    /// How far the stage of a gantry was turned.
    Rotation(RotationEntry),
    /// A run is whole, and the place of its datum still reads what it should.
    Closed(ClosureEntry),
    /// What a job is.
    Job(JobEntry),
    /// A point of it was reached.
    Reached(ReachedEntry),
    /// The next point of it was wanted.
    WentOn(WentOnEntry),
}

/// What such a journal holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LinearLog {
    /// Its points, in the order they were measured.
    pub points: Vec<PointEntry>,
    /// By what it is judged, if it is a verification.
    pub criterion: Option<CriterionEntry>,
    /// What zero searches read on their way.
    pub sweeps: Vec<SweepLog>,
    /// How late the SYNCs of each bus were.
    pub syncs: Vec<SyncsEntry>,
    /// Its zeros.
    pub zeros: Vec<ZeroEntry>,
    /// How far a gantry's stage was turned.
    pub rotations: Vec<RotationEntry>,
    /// How far each whole run had drifted at its end.
    pub closures: Vec<ClosureEntry>,
    /// The job that was done, if it was one.
    pub job: Option<JobEntry>,
    /// The points of it that were reached, in order.
    pub reached: Vec<ReachedEntry>,
    /// What made it go on from them.
    pub went_on: Vec<WentOnEntry>,
}

/// What one zero search read on its way.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepLog {
    /// What it read.
    pub read: HallSweepEntry,
    /// Which of the journal's zeros it led to; `None` where the journal broke off between the two.
    pub led_to: Option<usize>,
}

impl Log for LinearLog {
    type Entry = LinearEntry;

    const OPENED_BY: &'static [&'static str] = &[];

    fn judge(&self, header: &JournalHeader, entry: &LinearEntry) -> Judged {
        match entry {
            LinearEntry::Point(it) => point(header, it),
            LinearEntry::Criterion(it) => criterion(it),
            LinearEntry::HallSweep(it) => hall_sweep(it),
            LinearEntry::Syncs(it) => syncs(it),
            LinearEntry::Zero(it) => zero(it),
            LinearEntry::Rotation(it) => rotation(it),
            LinearEntry::Closed(it) => it.judge(header),
            LinearEntry::Job(it) => job(self, header, it),
            LinearEntry::Reached(it) => reached(self, header, it),
            LinearEntry::WentOn(it) => went_on(self, header, it),
        }
    }

    fn take(&mut self, entry: LinearEntry) {
        match entry {
            LinearEntry::Point(it) => self.points.push(it),
            LinearEntry::Criterion(it) => self.criterion = Some(it),
            LinearEntry::HallSweep(read) => self.sweeps.push(SweepLog { read, led_to: None }),
            LinearEntry::Syncs(it) => self.syncs.push(it),
            LinearEntry::Zero(it) => self.take_zero(it),
            LinearEntry::Rotation(it) => self.rotations.push(it),
            LinearEntry::Closed(it) => self.closures.push(it),
            LinearEntry::Job(it) => self.job = Some(it),
            LinearEntry::Reached(it) => self.reached.push(it),
            LinearEntry::WentOn(it) => self.went_on.push(it),
        }
    }

    fn keep_whole(&mut self, header: &JournalHeader) {
        // The datum of a continued measurement is a new one, so that only runs whose end was seen to
        // agree with their own datum are kept.
        let whole = header.targets_m.len() * 2;
        let points = core::mem::take(&mut self.points);
        let count = |run: u32| points.iter().filter(|point| point.run == run).count();
        self.closures.retain(|closure| count(closure.run) == whole);
        let is_kept = |run: u32| self.closures.iter().any(|closure| closure.run == run);
        self.points = points.into_iter().filter(|it| is_kept(it.run)).collect();
        // A point of a job that was not left is gone to again.
        let went_on = &self.went_on;
        self.reached.retain(|it| {
            let mut left = went_on.iter().map(|it| (it.repetition, it.number));
            left.any(|stop| stop == (it.repetition, it.number))
        });
    }
}

impl LinearLog {
    /// The sweep that was journalled last is that of this zero, unless another zero came of it.
    fn take_zero(&mut self, zero: ZeroEntry) {
        let number = self.zeros.len();
        let last = self.sweeps.last_mut();
        if let Some(sweep) = last.filter(|it| it.led_to.is_none()) {
            sweep.led_to = Some(number);
        }
        self.zeros.push(zero);
    }
}

fn point(header: &JournalHeader, it: &PointEntry) -> Judged {
    header.judge_run(it.run)?;
    approach("approach", it.approach)?;
    let places = [
        ("target_m", it.target_m),
        ("set_point_m", it.set_point_m),
        ("encoder_m", it.encoder_m),
        ("measured_m", it.measured_m),
    ];
    for (key, seen) in places {
        number(key, seen, &PLACE_M)?;
    }
    let targets = &header.targets_m;
    let is_target = targets.is_empty() || targets.contains(&it.target_m);
    let expected = || "one of the header's targets_m".to_owned();
    is("target_m", is_target, expected, || {
        format!("{:e}", it.target_m)
    })?;
    number("scatter_m", it.scatter_m, &ERROR_U_M)?;
    number("at_s", it.at_s, &SECONDS)?;
    it.environment.judge("environment")
}

fn criterion(it: &CriterionEntry) -> Judged {
    number("tolerance_m", it.tolerance_m, &ERROR_U_M)?;
    counted("targets", it.targets.len(), 0..=COUNT_MAX)?;
    for target in &it.targets {
        number("targets.position_m", target.position_m, &PLACE_M)?;
        for side in [target.forward, target.reverse].into_iter().flatten() {
            number("targets.u_m", side.u_m, &ERROR_U_M)?;
            number("targets.expanded_u_m", side.expanded_u_m, &ERROR_U_M)?;
            optional(
                "targets.degrees_of_freedom",
                side.degrees_of_freedom,
                &FREEDOM,
            )?;
        }
    }
    Ok(())
}

fn hall_sweep(it: &HallSweepEntry) -> Judged {
    numbers("positions_m", &it.positions_m, &PLACE_M)?;
    for (key, volts) in [("peak_v", &it.peak_v), ("slope_v", &it.slope_v)] {
        as_many(key, volts.len(), it.positions_m.len(), "the positions")?;
        numbers(key, volts, &VOLTS)?;
    }
    number("peak_m", it.peak_m, &PLACE_M)?;
    number("peak_max_v", it.peak_max_v, &VOLTS)?;
    for (key, held) in [("g1", &it.g1), ("g2", &it.g2), ("p0", &it.p0)] {
        number(format!("{key}.position_m"), held.position_m, &PLACE_M)?;
        number(format!("{key}.peak_v"), held.peak_v, &VOLTS)?;
        number(format!("{key}.slope_v"), held.slope_v, &VOLTS)?;
    }
    Ok(())
}

fn syncs(it: &SyncsEntry) -> Judged {
    numbers("shares", &it.shares, &RATIO)?;
    as_many("late_s", it.late_s.len(), it.shares.len(), "the shares")?;
    numbers("late_s", &it.late_s, &SECONDS)
}

fn zero(it: &ZeroEntry) -> Judged {
    number("origin_m", it.origin_m, &PLACE_M)?;
    let u = it.standard_uncertainty_m;
    number("standard_uncertainty_m", u, &ERROR_U_M)?;
    number("patent_p0_m", it.patent_p0_m, &PLACE_M)?;
    number("peak_max_v", it.peak_max_v, &VOLTS)?;
    number("mid_v", it.mid_v, &VOLTS)?;
    number("at_s", it.at_s, &SECONDS)?;
    let budget = it.budget.as_ref();
    budget.map_or(Ok(()), |it| it.judge(&[(0, u)]))
}

fn rotation(it: &RotationEntry) -> Judged {
    for origin in &it.origins_m {
        number("origins_m", *origin, &PLACE_M)?;
    }
    let is_side = it.axes.contains(&it.ahead_when_positive);
    let expected = || format!("`{}` or `{}`", it.axes[0], it.axes[1]);
    is("ahead_when_positive", is_side, expected, || {
        format!("`{}`", it.ahead_when_positive.escape_debug())
    })?;
    number("distance_m", it.distance_m, &LENGTH_M)?;
    number("distance_u_m", it.distance_u_m, &ERROR_U_M)?;
    number("scale_u", it.scale_u, &RATIO)?;
    number("angle_rad", it.angle_rad, &ANGLE_RAD)?;
    let u = it.standard_uncertainty_rad;
    number("standard_uncertainty_rad", u, &ANGLE_U_RAD)?;
    optional("degrees_of_freedom", it.degrees_of_freedom, &FREEDOM)?;
    let accepted = it.angle_at_acceptance_rad;
    optional("angle_at_acceptance_rad", accepted, &ANGLE_RAD)?;
    optional("angle_limit_rad", it.angle_limit_rad, &ANGLE_U_RAD)?;
    number("zero_u_rad", it.zero_u_rad, &ANGLE_U_RAD)?;
    number("at_s", it.at_s, &SECONDS)
}

fn job(read: &LinearLog, header: &JournalHeader, it: &JobEntry) -> Judged {
    once("job", read.job.is_none())?;
    as_many(
        "names",
        it.names.len(),
        header.targets_m.len(),
        "the targets",
    )?;
    if !it.go_on.is_empty() {
        as_many("go_on", it.go_on.len(), it.names.len(), "the names")?;
    }
    counted("repetitions", it.repetitions as usize, 1..=PASSES_MAX)?;
    number("settle_s", it.settle_s, &SECONDS)?;
    optional("end_m", it.end_m, &PLACE_M)
}

/// Whether a job was there, and has such a point.
fn point_of_job(
    read: &LinearLog,
    header: &JournalHeader,
    (repetition, number): (u32, usize),
) -> Judged {
    let missing = || unsound("entry", "a job before it", "none");
    let job = read.job.as_ref().ok_or_else(missing)?;
    header.judge_run(repetition)?;
    counted("number", number, 1..=job.names.len())
}

fn reached(read: &LinearLog, header: &JournalHeader, it: &ReachedEntry) -> Judged {
    point_of_job(read, header, (it.repetition, it.number))?;
    approach("approach", it.approach)?;
    for (key, seen) in [
        ("target_m", it.target_m),
        ("set_point_m", it.set_point_m),
        ("encoder_m", it.encoder_m),
    ] {
        number(key, seen, &PLACE_M)?;
    }
    if let Some(interval) = &it.interval_m {
        numbers("interval_m", interval, &PLACE_M)?;
    }
    optional("place_m", it.place_m, &PLACE_M)?;
    optional("u_m", it.u_m, &ERROR_U_M)?;
    optional("expanded_u_m", it.expanded_u_m, &ERROR_U_M)?;
    number("at_s", it.at_s, &SECONDS)
}

fn went_on(read: &LinearLog, header: &JournalHeader, it: &WentOnEntry) -> Judged {
    point_of_job(read, header, (it.repetition, it.number))?;
    let is_known = ["time", "operator", "input"].contains(&it.by.as_str());
    let expected = || "`time`, `operator` or `input`".to_owned();
    is("by", is_known, expected, || {
        format!("`{}`", it.by.escape_debug())
    })?;
    number("waited_s", it.waited_s, &SECONDS)?;
    optional("seen_v", it.seen_v, &VOLTS)?;
    number("at_s", it.at_s, &SECONDS)
}

#[cfg(test)]
mod tests;
