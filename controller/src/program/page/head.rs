//! The head of every page: whose run it is, by which program, with which configuration and calibration, in which
//! surroundings, with which corrections; how uncertain it is, what it is judged by, and by what its files are known.
//!
//! What a journal says by itself is taken from it ([`facts_of`]); what each kind must say, too, is [`Stated`], so that
//! no page can leave it out.

use core::fmt::Write as _;

use machine::records::{IdentityRecord, InstrumentRecord, ReadJournal, ThermometersEntry};

use super::escape;

/// The names of the facts that are on every page, in this order.
#[cfg(test)]
pub(crate) const ALWAYS: [&str; 13] = [
    "machine",
    "run",
    "measured by",
    "configuration",
    IN_USE,
    "environment",
    CORRECTED,
    NOT_CORRECTED,
    "uncertainty",
    "tolerance",
    "conformity",
    "sign",
    "hashes",
];

/// The fact that names the calibration in use.
pub(crate) const IN_USE: &str = "calibration in use";
const CORRECTED: &str = "corrections on";
const NOT_CORRECTED: &str = "corrections off";

/// A line of the head.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Fact {
    pub(crate) name: &'static str,
    pub(crate) value: String,
    /// What nobody may overlook is red.
    pub(crate) is_warning: bool,
}

impl Fact {
    pub(crate) fn new(name: &'static str, value: impl Into<String>) -> Self {
        Self {
            name,
            value: value.into(),
            is_warning: false,
        }
    }

    pub(crate) fn red_if(self, is_warning: bool) -> Self {
        Self { is_warning, ..self }
    }
}

/// A correction: what it is called, and whether it was made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Made {
    pub(crate) name: String,
    pub(crate) is_made: bool,
    /// Whether it should have been made where it was not.
    pub(crate) is_missed: bool,
}

/// What a kind of machine says of a run, besides what every journal says.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Stated {
    /// How warm it was and the like; `None` where nothing measured it.
    pub(crate) environment: Option<String>,
    /// Corrections that no instrument makes.
    pub(crate) corrections: Vec<Made>,
    /// With its coverage factor.
    pub(crate) uncertainty: Option<String>,
    /// A figure, its tolerance and the verdict; and whether that is good.
    pub(crate) verdict: Option<(String, bool)>,
    /// How far the measurement is as a standard asks, and whether it is.
    pub(crate) conformity: Option<(String, bool)>,
    /// What a positive figure means.
    pub(crate) sign: &'static str,
    /// Calibrations that were made from the run: their kinds and names.
    pub(crate) made: Vec<(String, String)>,
}

/// The mean of what was `seen` of `name`, and from where to where it was; `None` where nothing was.
pub(crate) fn spread(name: &str, unit: &str, digits: usize, seen: &[f64]) -> Option<String> {
    let mean = compensator::uncertainty::mean(seen)?;
    let low = seen.iter().copied().fold(f64::INFINITY, f64::min);
    let high = seen.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    Some(format!(
        "{name} {mean:.digits$} {unit} ({low:.digits$} to {high:.digits$})"
    ))
}

/// How warm the machine was by its thermometers, each by its name; `None` where it has none, or none said anything.
pub(crate) fn warmth(entries: &[ThermometersEntry]) -> Option<String> {
    let names = &entries.first()?.names;
    let of = |name: &String| {
        let seen = entries.iter().filter_map(|it| {
            let at = it.names.iter().position(|own| own == name)?;
            it.temperatures_c.get(at).copied().flatten()
        });
        spread(name, "°C", 3, &seen.collect::<Vec<f64>>())
    };
    let told: Vec<String> = names.iter().filter_map(of).collect();
    (!told.is_empty()).then(|| format!("thermometers of the machine: {}", told.join(", ")))
}

/// That nothing was corrected for the temperature, where readings know no such correction.
pub(crate) fn not_for_temperature() -> Made {
    Made {
        name: "temperature".into(),
        is_made: false,
        is_missed: false,
    }
}

/// The head of the page of `journal`.
pub(crate) fn facts_of<L>(journal: &ReadJournal<L>, stated: Stated) -> Vec<Fact> {
    let header = &journal.header;
    let mut facts = vec![Fact::new(
        "machine",
        format!(
            "{} (stage {}), {}",
            header.machine, header.stage_serial, header.axis
        ),
    )];
    facts.extend(run_of(journal));
    facts.push(Fact::new(
        "measured by",
        measured_by(header.program.as_deref()),
    ));
    facts.push(Fact::new("configuration", header.config_hash.clone()));
    let in_use = header.calibration.as_deref();
    facts.push(Fact::new(IN_USE, in_use.unwrap_or("none")));
    for (kind, id) in &stated.made {
        facts.push(Fact::new("made", format!("{kind} {id}")));
    }
    facts.extend(devices(journal));
    let unknown = |what: Option<String>, or: &str| what.unwrap_or_else(|| or.to_owned());
    facts.push(Fact::new(
        "environment",
        unknown(stated.environment, "not recorded"),
    ));
    facts.extend(corrections(&header.instrument, &stated.corrections));
    facts.push(Fact::new(
        "uncertainty",
        unknown(stated.uncertainty, "NOT STATED by this run"),
    ));
    let (verdict, is_good) = verdict_of(journal.complete, stated.verdict);
    facts.push(Fact::new("tolerance", verdict).red_if(!is_good));
    let (conformity, is_so) = stated
        .conformity
        .unwrap_or(("no standard applies to this run".into(), true));
    facts.push(Fact::new("conformity", conformity).red_if(!is_so));
    facts.push(Fact::new("sign", stated.sign));
    facts.push(Fact::new("hashes", hashes(journal, &stated.made)));
    facts
}

/// What was judged so far of a run that did not come to its end is no verdict.
fn verdict_of(is_complete: bool, judged: Option<(String, bool)>) -> (String, bool) {
    match judged {
        Some(judged) if is_complete => judged,
        Some(_) => ("NOT JUDGED: the run did not come to its end".into(), false),
        None => (
            "this run measures and judges nothing; a verification does".into(),
            true,
        ),
    }
}

/// What the run was, and how it went.
fn run_of<L>(journal: &ReadJournal<L>) -> Vec<Fact> {
    let header = &journal.header;
    let end = match (journal.complete, &journal.failure) {
        (true, _) => "complete",
        (false, None) => "NOT COMPLETE",
        (false, Some(_)) => "FAILED",
    };
    let run = format!("{}, started {}, {end}", header.verb, header.started);
    let mut facts = vec![Fact::new("run", run).red_if(!journal.complete)];
    if let Some(cause) = &journal.failure {
        facts.push(Fact::new("ended because", cause.clone()));
    }
    facts
}

fn measured_by(program: Option<&str>) -> String {
    program.map_or(
        "a program that did not write who it is".into(),
        str::to_owned,
    )
}

fn devices<L>(journal: &ReadJournal<L>) -> Vec<Fact> {
    let mut facts = Vec::new();
    // What several drives move together names none of them.
    let drive = &journal.header.drive;
    if *drive != IdentityRecord::default() {
        let value = format!(
            "{} {:#X}:{:#X}, serial {}",
            drive.name, drive.vendor, drive.product, drive.serial
        );
        facts.push(Fact::new("drive", value));
    }
    let it = &journal.header.instrument;
    if !it.name.is_empty() {
        // Who an instrument is may show only after the journal was begun.
        let value = match it.identity.is_empty() {
            true => it.name.clone(),
            false => format!("{} ({})", it.name, it.identity),
        };
        facts.push(Fact::new("instrument", value));
    }
    let certificates = it.certificates.iter();
    facts.extend(certificates.map(|it| Fact::new("certificate", it.text())));
    facts
}

/// What is corrected, and what is not: red where it should have been.
fn corrections(instrument: &InstrumentRecord, others: &[Made]) -> [Fact; 2] {
    let of_instrument = [
        ("air", instrument.air_corrected),
        ("material", instrument.material_corrected),
        ("dead path", instrument.dead_path_corrected),
        ("cosine", instrument.cosine_corrected),
    ];
    let list = |names: Vec<&str>| match names.is_empty() {
        true => "none".to_owned(),
        false => names.join(", "),
    };
    let others_made = others
        .iter()
        .filter(|it| it.is_made)
        .map(|it| it.name.as_str());
    let on = of_instrument.iter().filter(|it| it.1).map(|it| it.0);
    let on = list(on.chain(others_made).collect());
    let missed = others.iter().filter(|it| !it.is_made);
    let is_missed = instrument.warning().is_some() || missed.clone().any(|it| it.is_missed);
    let mut off: Vec<String> = instrument.warning().into_iter().collect();
    off.extend(unmentioned(instrument).map(String::from));
    off.extend(missed.map(|it| it.name.clone()));
    let off = list(off.iter().map(String::as_str).collect());
    [
        Fact::new(CORRECTED, on),
        Fact::new(NOT_CORRECTED, off).red_if(is_missed),
    ]
}

/// A dead path that is not corrected is told as switched off only where there is anything of it to correct by: of an
/// instrument whose light the air bends, whoever reads the page must know it all the same.
fn unmentioned(instrument: &InstrumentRecord) -> Option<&'static str> {
    const PATH: &str = "dead path";
    let switched_off = |name: &str| instrument.switched_off.iter().any(|it| it == name);
    let is_in_air = instrument.air_corrected || switched_off("air");
    let is_told = instrument.dead_path_corrected || switched_off(PATH);
    (is_in_air && !is_told).then_some(PATH)
}

/// By what files are known again: they are named by, and can be compared with, their BLAKE3.
fn hashes<L>(journal: &ReadJournal<L>, made: &[(String, String)]) -> String {
    let mut hashes = vec![format!("journal {}", journal.blake3)];
    hashes.extend(made.iter().map(|(kind, id)| format!("{kind} {id}")));
    format!("BLAKE3: {}", hashes.join("; "))
}

/// The head as HTML.
pub(crate) fn facts(facts: &[Fact]) -> String {
    let rows = facts.iter().fold(String::new(), |mut rows, it| {
        let class = if it.is_warning { "warning" } else { "fact" };
        let _ = write!(
            rows,
            "<tr class=\"{class}\"><th>{}</th><td>{}</td></tr>",
            escape(it.name),
            escape(&it.value)
        );
        rows
    });
    format!("<table class=\"head\">{rows}</table>")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(instrument: &InstrumentRecord, others: &[Made]) -> String {
        facts(&corrections(instrument, others))
    }

    #[test]
    fn a_correction_that_should_have_been_made_is_a_red_line_and_one_left_out_on_purpose_is_none() {
        let mut instrument = InstrumentRecord {
            material_corrected: true,
            ..InstrumentRecord::default()
        };
        let table = Made {
            name: "error table".into(),
            is_made: false,
            is_missed: false,
        };
        let html = lines(&instrument, core::slice::from_ref(&table));
        assert!(html.contains("<td>material</td>") && html.contains("<td>error table</td>"));
        assert!(!html.contains("class=\"warning\""), "{html}");
        instrument.switched_off = vec!["air".into()];
        let html = lines(&instrument, core::slice::from_ref(&table));
        let red = html.split("class=\"warning\"").nth(1).expect("a red line");
        assert!(
            red.contains("NOT CORRECTED for air, dead path, error table"),
            "{html}"
        );
        instrument.switched_off = vec!["dead path".into()];
        let html = lines(&instrument, &[]);
        assert!(
            html.contains("<td>NOT CORRECTED for dead path</td>"),
            "{html}"
        );
    }
}
