//! A placement read line by line, by questions and answers.

use compensator::rotary::{Sighted, SightedPlan, pass_name};
use units::{Approach, Radians};

use super::answer::{Answer, Place, WORDS, parse};
use super::person::{Asked, Person, Question};
use super::stand::Stand;
use crate::failure::Failure;
use crate::rotary::estimate::check_passes;
use crate::rotary::failure::RotaryFailure;
use crate::rotary::log::position_of;
use crate::rotary::placed::{Placed, closed};
use crate::rotary::plate_journal::PlateJournal;
use crate::rotary::plate_run::PlateRun;
use crate::rotary::sighting::Sighting;
use crate::rotary::{PlacementEntry, PlateEntry, PlateLog, SightedEntry, SweepEntry};
use crate::run::utc_now;

/// From how many standard deviations on two readings of a line differ by more than noise: one in two
/// million does where the noise is as stated.
const SLIP: f64 = 5.0;

/// The placement of a plate that is being read.
pub(super) struct Dialog<'a> {
    axis: &'a str,
    run: &'a PlateRun,
    sighting: Sighting,
    plan: SightedPlan,
}

/// How the question for a line ended.
enum Next {
    /// With the line after it.
    Line,
    /// With another one that is to be read again.
    Again(Place),
}

impl<'a> Dialog<'a> {
    pub(super) fn new(axis: &'a str, run: &'a PlateRun, sighting: Sighting, offset: f64) -> Self {
        Self {
            axis,
            run,
            sighting,
            plan: sighting.plan(offset, run.lines, run.passes),
        }
    }

    /// Asks for every line of every pass that is not in the journal yet, until the placement is closed.
    pub(super) fn read(
        &self,
        stand: &mut dyn Stand,
        person: &mut dyn Person,
        journal: &mut PlateJournal,
    ) -> Result<Placed, Failure> {
        person.tell(&self.introduction(stand.turns()));
        let mut again = None;
        let mut before = None;
        loop {
            let Some(place) = again.take().or_else(|| self.unread(journal)) else {
                match self.close(stand, person, journal)? {
                    Ok(placed) => return Ok(placed),
                    Err(place) => again = Some(place),
                }
                continue;
            };
            match self.ask(stand, person, journal, (place, before))? {
                Next::Line => before = Some(place),
                Next::Again(other) => again = Some(other),
            }
        }
    }

    fn introduction(&self, turns: bool) -> String {
        let what = match self.sighting.value {
            Sighted::ToLine => {
                "the table stands at the line's nominal angle; type by how much it would have to turn on \
                 for the line to lie under the cross-hair, + towards larger angles"
            }
            Sighted::Angle => {
                "type what the table's encoder shows with the line under the cross-hair, counted from the \
                 table's zero"
            }
            Sighted::Deviation => {
                "type what the table's encoder shows with the line under the cross-hair, less the line's \
                 nominal angle"
            }
        };
        let power = match turns {
            true => {
                "\n  the table holds its place under power and turns as soon as you press Enter: keep out \
                 of its way"
            }
            false => "",
        };
        format!("  of each line: {what}; with its unit, 12.3arcsec\n  {WORDS}{power}")
    }

    /// The first line, in the order of the passes, that was not read.
    fn unread(&self, journal: &PlateJournal) -> Option<Place> {
        self.plan.passes().find_map(|(pass, approach)| {
            let sweep = self.sweep(journal, pass, approach);
            let is_read = |line: u32| sweep.is_some_and(|it| self.is_read(it, line));
            let mut lines = 0..self.run.lines;
            let line = match approach {
                Approach::Forward => lines.find(|it| !is_read(*it)),
                Approach::Reverse => lines.rfind(|it| !is_read(*it)),
            };
            line.map(|line| Place {
                pass,
                approach,
                line,
            })
        })
    }

    fn sweep<'j>(
        &self,
        journal: &'j PlateJournal,
        pass: u32,
        approach: Approach,
    ) -> Option<&'j SweepEntry> {
        let mut own = journal.so_far().sweeps_at(self.plan.offset);
        own.find(|it| (it.pass, it.approach) == (pass, approach.symbol()))
    }

    fn is_read(&self, sweep: &SweepEntry, line: u32) -> bool {
        let position = self.position(line);
        sweep.deviations_rad[position as usize].is_some() || sweep.missing.contains(&position)
    }

    fn position(&self, line: u32) -> u32 {
        position_of(line, self.plan.offset, self.plan.lines)
    }

    /// Asks for one line until there is an answer that can be taken.
    fn ask(
        &self,
        stand: &mut dyn Stand,
        person: &mut dyn Person,
        journal: &mut PlateJournal,
        (place, before): (Place, Option<Place>),
    ) -> Result<Next, Failure> {
        let nominal = self.plan.nominal(place.line as usize);
        stand.go_to(nominal, place.approach, self.plan.spacing())?;
        let question = self.question(place, nominal, journal, stand);
        loop {
            let answer = match parse(&answered(&question, stand, person)?) {
                Ok(answer) => answer,
                Err(why) => {
                    person.refuse(&why)?;
                    continue;
                }
            };
            let refused = match answer {
                Answer::Value(value) => {
                    let deviation = self.sighting.value.deviation(value, nominal);
                    let deviation = deviation + stand.beyond(nominal)?;
                    match self.plan.judge(deviation, &self.others(journal, place)) {
                        Ok(()) => {
                            self.warn_of_a_slip(person, journal, place, deviation);
                            self.keep(journal, place, Some(deviation))?;
                            return Ok(Next::Line);
                        }
                        Err(why) => why.to_string(),
                    }
                }
                Answer::Unreadable => {
                    self.keep(journal, place, None)?;
                    return Ok(Next::Line);
                }
                Answer::Before => match before {
                    Some(before) => return Ok(Next::Again(before)),
                    None => {
                        "nothing was read before; write `again` and the number of a line".into()
                    }
                },
                Answer::Again { line, pass } => match self.named(line, pass, place, journal) {
                    Ok(place) => return Ok(Next::Again(place)),
                    Err(why) => why,
                },
                Answer::Stop => return Err(stopped()),
                Answer::Discard => {
                    "a placement is discarded when all of its lines were asked for".into()
                }
                Answer::Enter => {
                    format!("type the value of this line, or one of the words. {WORDS}")
                }
            };
            person.refuse(&refused)?;
        }
    }

    fn question(
        &self,
        place: Place,
        nominal: Radians,
        journal: &PlateJournal,
        stand: &dyn Stand,
    ) -> Question {
        let read: usize = journal
            .so_far()
            .sweeps_at(self.plan.offset)
            .map(|it| it.deviations_rad.iter().flatten().count() + it.missing.len())
            .sum();
        let degrees = (nominal.degrees() + 1e-9).rem_euclid(360.0) - 1e-9;
        Question {
            asked: Asked::Line {
                line: place.line,
                value: self.sighting.value,
                nominal,
            },
            text: format!(
                "pass {}, line {} at {degrees:.4}° ({read} of {} read)",
                pass_name(place.pass, place.approach),
                place.line,
                self.plan.lines * self.plan.passes().count(),
            ),
            turns: stand.turns(),
            by_hand: !stand.turns(),
        }
    }

    /// Deviations from the nominal angle of what else was read of this placement.
    fn others(&self, journal: &PlateJournal, place: Place) -> Vec<f64> {
        let own = (place.pass, place.approach.symbol());
        let position = self.position(place.line) as usize;
        let mut others = Vec::new();
        for sweep in journal.so_far().sweeps_at(self.plan.offset) {
            let is_own = (sweep.pass, sweep.approach) == own;
            let read = sweep.deviations_rad.iter().enumerate();
            let read = read.filter(|(at, _)| !is_own || *at != position);
            others.extend(read.filter_map(|(_, it)| Some((*it)? - self.beside())));
        }
        others
    }

    /// By how much nominal angles are beyond the table positions that readings count from.
    fn beside(&self) -> f64 {
        self.plan.offset.fract() * self.plan.spacing().value()
    }

    /// A value that another pass contradicts is taken, but not in silence.
    fn warn_of_a_slip(
        &self,
        person: &mut dyn Person,
        journal: &PlateJournal,
        place: Place,
        deviation: Radians,
    ) {
        let (own, position) = (place.approach.symbol(), self.position(place.line) as usize);
        let limit = self.run.noise * (SLIP * core::f64::consts::SQRT_2);
        for sweep in journal.so_far().sweeps_at(self.plan.offset) {
            let read = sweep.deviations_rad[position];
            let apart = read.map(|it| deviation - Radians(it - self.beside()));
            let is_own = (sweep.pass, sweep.approach) == (place.pass, own);
            if let Some(apart) = apart.filter(|it| !is_own && it.abs() > limit) {
                person.tell(&format!(
                    "  line {} is {:+.3} arcsec from what was read in pass {}{}: if one of them was a slip, \
                     type `again {} {}{own}` or `again {} {}{}`",
                    place.line,
                    apart.arcsec(),
                    sweep.pass,
                    sweep.approach,
                    place.line,
                    place.pass,
                    place.line,
                    sweep.pass,
                    sweep.approach,
                ));
                return;
            }
        }
    }

    fn keep(
        &self,
        journal: &mut PlateJournal,
        place: Place,
        deviation: Option<Radians>,
    ) -> Result<(), Failure> {
        Ok(journal.write(PlateEntry::Sighted(SightedEntry {
            offset: self.plan.offset,
            pass: place.pass,
            approach: place.approach.symbol(),
            line: place.line,
            deviation_rad: deviation.map(|it| it.value() + self.beside()),
            at: utc_now(),
        }))?)
    }

    /// The line that is to be read again: one that was read.
    fn named(
        &self,
        line: u32,
        pass: Option<(u32, Approach)>,
        here: Place,
        journal: &PlateJournal,
    ) -> Result<Place, String> {
        let (pass, approach) = pass.unwrap_or((here.pass, here.approach));
        let known = line < self.run.lines;
        let sweep = self.sweep(journal, pass, approach).filter(|_| known);
        match sweep.filter(|it| self.is_read(it, line)) {
            Some(_) => Ok(Place {
                pass,
                approach,
                line,
            }),
            None => Err(format!(
                "line {line} of pass {} was not read yet",
                pass_name(pass, approach)
            )),
        }
    }

    /// Asks whether the placement shall be closed, and closes it if it can be; a line that is to be read
    /// again otherwise.
    fn close(
        &self,
        stand: &mut dyn Stand,
        person: &mut dyn Person,
        journal: &mut PlateJournal,
    ) -> Result<Result<Placed, Place>, Failure> {
        let judged = judged(
            self.axis,
            (self.run, &self.plan),
            journal.so_far(),
            stand.now_s(),
        );
        let question = Question {
            asked: Asked::Close,
            text: self.summary(&judged),
            turns: false,
            by_hand: !stand.turns(),
        };
        loop {
            let refused = match parse(&answered(&question, stand, person)?) {
                Ok(Answer::Enter) => match &judged {
                    Ok((placement, _)) => return Ok(Ok(journal.close(*placement)?)),
                    Err(why) => what_can_be_done(why),
                },
                Ok(Answer::Again {
                    line,
                    pass: Some(pass),
                }) => {
                    let (number, approach) = pass;
                    let here = Place {
                        pass: number,
                        approach,
                        line,
                    };
                    match self.named(line, Some(pass), here, journal) {
                        Ok(place) => return Ok(Err(place)),
                        Err(why) => why,
                    }
                }
                Ok(Answer::Discard) => {
                    let offset = self.plan.offset;
                    journal.write(PlateEntry::Discarded { offset })?;
                    journal.flush_to_disk()?;
                    return Err(stopped());
                }
                Ok(Answer::Stop) => return Err(stopped()),
                Ok(_) => "press Enter, or name line and pass: again 17 1-".into(),
                Err(why) => why,
            };
            person.refuse(&refused)?;
        }
    }

    fn summary(&self, judged: &Result<(PlacementEntry, Placed), Failure>) -> String {
        let found = match judged {
            Ok((placement, placed)) => format!(
                "the plate moved by {:+.3} arcsec while it was read; one line in one pass scatters by {}",
                Radians(placement.closure_rad).arcsec(),
                placed
                    .scatter
                    .map_or("an unknown amount".to_owned(), |it| format!(
                        "{:.3} arcsec",
                        it.arcsec()
                    )),
            ),
            Err(why) => format!("it cannot be closed as it is: {}", what_can_be_done(why)),
        };
        format!(
            "the placement at offset {} is read: {found}\n  Enter: close it; again 17 1-: read a line of a \
             pass again; discard: give it up, it is asked for again; stop",
            self.plan.offset
        )
    }
}

/// Whether a placement can be closed: read far enough, not moved, not scattering too much.
pub(super) fn judged(
    axis: &str,
    (run, plan): (&PlateRun, &SightedPlan),
    log: &PlateLog,
    now_s: f64,
) -> Result<(PlacementEntry, Placed), Failure> {
    let sweeps: Vec<SweepEntry> = log.sweeps_at(plan.offset).cloned().collect();
    for (pass, approach) in plan.passes() {
        let own = |it: &&SweepEntry| (it.pass, it.approach) == (pass, approach.symbol());
        let read = sweeps.iter().find(own);
        let seen = read.map_or(0, |it| it.deviations_rad.iter().flatten().count());
        if seen < plan.lines_needed() {
            return Err(Failure::Usage {
                what: format!(
                    "only {seen} of {} lines were read in pass {}, at least {} are needed",
                    plan.lines,
                    pass_name(pass, approach),
                    plan.lines_needed()
                ),
                help: "clean the plate, and read more of them".into(),
            });
        }
    }
    let placement = closed(axis, run, (plan.offset, now_s), &sweeps)?;
    let placed = Placed::in_plan(&placement, &sweeps, &run.plan(vec![plan.offset]));
    check_passes(axis, run, core::slice::from_ref(&placed))?;
    Ok((placement, placed))
}

/// Why a placement cannot be closed, for somebody who can still read its lines again.
fn what_can_be_done(why: &Failure) -> String {
    match why.of_kind() {
        Some(RotaryFailure::Slipped { seen, limit, .. }) => format!(
            "the lines moved by {:+.3} arcsec while they were read, the limit is {:.3} arcsec \
             (closure_limit_arcsec): read those again that are wrong; or fix plate and microscope, let the \
             temperature settle, and discard the placement",
            seen.arcsec(),
            limit.arcsec()
        ),
        Some(RotaryFailure::Noise { seen, expected, .. }) => format!(
            "one line in one pass scatters by {:.3} arcsec between the directions, {:.3} arcsec was expected \
             (reading_noise_arcsec): read those again that are wrong; or stop, state the real noise, and go on \
             with --resume",
            seen.arcsec(),
            expected.arcsec()
        ),
        _ => why.to_string(),
    }
}

/// Asks, and lives on until there is an answer.
fn answered(
    question: &Question,
    stand: &mut dyn Stand,
    person: &mut dyn Person,
) -> Result<String, Failure> {
    person.question(question)?;
    loop {
        if let Some(text) = person.answer()? {
            return Ok(text);
        }
        let idle = stand.live()?;
        person.wait(idle);
    }
}

fn stopped() -> Failure {
    Failure::Machine(machine::Failure::Interrupted)
}
