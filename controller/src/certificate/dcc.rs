//! Who certifies what, when, and for how long.

use jiff::Span;
use jiff::civil::Date;
use roxmltree::{Document, Node};

use super::xml::{DCC, at, child, children, is, name_of, text};
use super::{Unfit, unfit};

const ASK: &str = "ask the laboratory for the certificate as it was issued";

/// The parts of a certificate.
pub(super) struct Parts<'a, 'i> {
    core: Node<'a, 'i>,
    administrative: Node<'a, 'i>,
    results: Node<'a, 'i>,
}

impl<'a, 'i: 'a> Parts<'a, 'i> {
    /// # Errors
    /// When the document is no certificate that is read here.
    pub(super) fn of(document: &'a Document<'i>) -> Result<Self, Unfit> {
        let root = document.root_element();
        if !is(root, DCC, "digitalCalibrationCertificate") {
            let name = root.tag_name().name();
            return unfit(
                format!("it is no Digital Calibration Certificate: it begins with `{name}`"),
                "a DCC begins with dcc:digitalCalibrationCertificate (https://ptb.de/dcc)",
            );
        }
        let version = root.attribute("schemaVersion").unwrap_or("none");
        if !version.starts_with("3.") {
            return unfit(
                format!("it is of DCC schema {version}"),
                "schemas 3.0 to 3.3 are read; ask the laboratory for one of these",
            );
        }
        let part = |node: Node<'a, 'i>, name: &'static str| {
            child(node, DCC, name).map_or_else(|| unfit(format!("it has no {name}"), ASK), Ok)
        };
        let administrative = part(root, "administrativeData")?;
        Ok(Self {
            core: part(administrative, "coreData")?,
            administrative,
            results: part(root, "measurementResults")?,
        })
    }

    pub(super) fn identifier(&self) -> Result<String, Unfit> {
        let own = child(self.core, DCC, "uniqueIdentifier").map(text);
        own.filter(|it| !it.is_empty())
            .map_or_else(|| unfit("it has no uniqueIdentifier", ASK), Ok)
    }

    pub(super) fn laboratory(&self) -> Result<String, Unfit> {
        let contact = at(
            self.administrative,
            DCC,
            &["calibrationLaboratory", "contact"],
        );
        let name = contact.map(name_of).unwrap_or_default();
        match name.is_empty() {
            true => unfit("it does not say which laboratory issued it", ASK),
            false => Ok(name),
        }
    }

    /// Whether what is certified is `serial_number`.
    pub(super) fn require_of(&self, serial_number: &str) -> Result<(), Unfit> {
        let items = child(self.administrative, DCC, "items");
        let items: Vec<_> = items
            .into_iter()
            .flat_map(|it| children(it, DCC, "item"))
            .collect();
        if items.len() > 1 {
            return unfit(
                format!(
                    "it certifies {} items, and which results are whose is not read",
                    items.len()
                ),
                "ask the laboratory for a certificate of each",
            );
        }
        let identified = items
            .first()
            .and_then(|it| child(*it, DCC, "identifications"));
        let values: Vec<String> = identified
            .into_iter()
            .flat_map(|it| children(it, DCC, "identification"))
            .filter_map(|it| child(it, DCC, "value"))
            .map(text)
            .collect();
        if values.iter().any(|it| it == serial_number.trim()) {
            return Ok(());
        }
        let known = match values.as_slice() {
            [] => "nothing that says which".to_owned(),
            all => all.join(", "),
        };
        unfit(
            format!("it is of another item: its identifications are {known}, not {serial_number}"),
            "name the certificate of this item, or its right `serial_number`",
        )
    }

    /// The last day of the calibration.
    pub(super) fn calibrated(&self) -> Result<Date, Unfit> {
        let begin = self.day("beginPerformanceDate")?;
        let end = self.day("endPerformanceDate")?;
        match end < begin {
            true => unfit(
                format!("its calibration ended on {end}, before it began on {begin}"),
                ASK,
            ),
            false => Ok(end),
        }
    }

    fn day(&self, name: &'static str) -> Result<Date, Unfit> {
        let own = child(self.core, DCC, name).map(text).unwrap_or_default();
        day(&own).map_or_else(
            || unfit(format!("{name} is `{own}`, which is no day"), ASK),
            Ok,
        )
    }

    /// The last day that it holds: what it says of that (a statement with a `period`), and `months` from the end of
    /// its calibration; the earlier of both.
    pub(super) fn valid_until(&self, calibrated: Date, months: Option<u32>) -> Result<Date, Unfit> {
        let beyond = |what: &str| {
            let cause = format!("{what} ends beyond the calendar");
            move || unfit(cause, "give a shorter one")
        };
        let mut known = Vec::new();
        for it in self.statements() {
            if child(it, DCC, "valid")
                .map(text)
                .is_some_and(|it| it == "false" || it == "0")
            {
                return unfit(
                    format!("it says of itself that it does not hold: {}", name_of(it)),
                    "ask the laboratory for the one that holds",
                );
            }
            let Some(period) = child(it, DCC, "period").map(text) else {
                continue;
            };
            let span: Option<Span> = period.parse().ok();
            let span = span.filter(|it| it.is_positive());
            let span =
                span.map_or_else(|| unfit(format!("its period `{period}` is none"), ASK), Ok)?;
            let from = child(it, DCC, "date").map(text);
            let from = match from {
                None => calibrated,
                Some(own) => day(&own)
                    .map_or_else(|| unfit(format!("its date `{own}` is no day"), ASK), Ok)?,
            };
            known.push(from.checked_add(span).or_else(|_| beyond("its period")())?);
        }
        if let Some(months) = months {
            let span = Span::new().months(i64::from(months));
            known.push(
                calibrated
                    .checked_add(span)
                    .or_else(|_| beyond("`valid_months`")())?,
            );
        }
        known.into_iter().min().map_or_else(
            || {
                unfit(
                    "it does not say how long it holds",
                    "give `valid_months`: after how long this is calibrated again",
                )
            },
            Ok,
        )
    }

    fn statements(&self) -> impl Iterator<Item = Node<'a, 'i>> + use<'a, 'i> {
        let all = child(self.administrative, DCC, "statements");
        all.into_iter()
            .flat_map(|it| children(it, DCC, "statement"))
    }

    /// Every `dcc:result`.
    pub(super) fn results(&self) -> Vec<Node<'a, 'i>> {
        let measured = children(self.results, DCC, "measurementResult");
        let lists = measured.filter_map(|it| child(it, DCC, "results"));
        lists.flat_map(|it| children(it, DCC, "result")).collect()
    }
}

/// A day of XML Schema, whatever its time zone.
fn day(text: &str) -> Option<Date> {
    let (day, zone) = text.split_at_checked(10)?;
    let is_zone = matches!(zone, "" | "Z") || (zone.len() == 6 && zone.starts_with(['+', '-']));
    is_zone.then_some(())?;
    day.parse().ok()
}
