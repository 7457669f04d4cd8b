//! A Digital Calibration Certificate (DCC) of a linear or a rotary axis, of a platform's screw, or of three axes.
//!
//! Source: Physikalisch-Technische Bundesanstalt, DCC schema 3.3.0 (`https://ptb.de/dcc`), and D-SI 2.2.1
//! (`https://ptb.de/si`) for values with units and standard uncertainties.
//!
//! It says what the record says, and that nobody has accredited whoever issues it. Who that is, the record does not
//! know: it is asked for. The certificates of what measured are named. Absent: a signature; what these certificates say.

mod screw;
mod volume;

use core::f64::consts::TAU;

use machine::records::RecordHead;
use serde_json::Map;
use units::Approach;

use super::exported::Written;
use crate::Failure;
use crate::linear::LinearContent;
use crate::linear::record::NodeRecord;
use crate::rotary::RotaryContent;

/// Who issues it.
pub(super) struct Issuer<'a> {
    pub(super) laboratory: Option<&'a str>,
    /// ISO 3166-1.
    pub(super) country: Option<&'a str>,
    pub(super) person: Option<&'a str>,
}

/// What it certifies.
#[derive(Default)]
pub(crate) struct Certifiable {
    title: String,
    results: String,
    /// Conditions that the head of a record does not have.
    conditions: String,
    /// The drives' serial numbers, where there are several.
    drives: Vec<u32>,
    /// What else its reader must know.
    remarks: Vec<String>,
}

impl Certifiable {
    /// # Errors
    /// When an uncertainty is not known.
    pub(crate) fn linear(axis: &str, content: &LinearContent) -> Result<Self, Failure> {
        let sides = content.approaches();
        let u = |it: &NodeRecord| (sides.iter()).all(|side| uncertainty(it, *side).is_some());
        if !content.nodes.iter().all(u) {
            return Err(without_uncertainty());
        }
        Ok(Self {
            title: format!("Positioning deviations of axis {axis}"),
            results: sides.iter().map(|it| result(content, *it)).collect(),
            ..Self::default()
        })
    }

    /// # Errors
    /// As [`Self::linear`].
    pub(crate) fn rotary(axis: &str, content: &RotaryContent) -> Result<Self, Failure> {
        let u = content.standard_uncertainty_rad.as_deref();
        let u = u.ok_or_else(without_uncertainty)?;
        let lines = content.table_error_rad.len();
        let angles: Vec<f64> = (0..lines)
            .map(|it| TAU * it as f64 / lines as f64)
            .collect();
        // A reading too large is an axis short of its target.
        let deviations: Vec<f64> = content.table_error_rad.iter().map(|it| -it).collect();
        let columns = [
            column("target angle", "\\radian", &angles, None),
            column(DEVIATION, "\\radian", &deviations, Some(u)),
        ];
        Ok(Self {
            title: format!("Angular positioning deviations of axis {axis}"),
            results: listed(
                "both directions, at the lines of a plate, mean zero",
                &columns.concat(),
            ),
            ..Self::default()
        })
    }
}

/// What is certified of an axis.
const DEVIATION: &str = "deviation, actual - target";

fn without_uncertainty() -> Failure {
    Failure::Usage {
        what: "--format dcc: a certificate states the uncertainty of every value, and this calibration does not".into(),
        help: "calibrate again with two runs at least, or import the table with --uncertainty-um".into(),
    }
}

pub(super) fn written(
    id: &str,
    head: &RecordHead,
    certified: &Certifiable,
    issuer: &Issuer<'_>,
) -> Result<Written, Failure> {
    let laboratory = given("--laboratory", issuer.laboratory)?;
    let person = given("--person", issuer.person)?;
    let country = country(given("--country", issuer.country)?)?;
    let Certifiable { title, results, .. } = certified;
    let contact = format!(
        "{}<dcc:location><dcc:countryCode>{country}</dcc:countryCode></dcc:location>",
        name(laboratory)
    );
    let text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<dcc:digitalCalibrationCertificate xmlns:dcc=\"https://ptb.de/dcc\" \
         xmlns:si=\"https://ptb.de/si\" schemaVersion=\"3.3.0\">\n<dcc:administrativeData>\n{}{}{}\
         <dcc:calibrationLaboratory><dcc:contact>{contact}</dcc:contact></dcc:calibrationLaboratory>\n\
         <dcc:respPersons><dcc:respPerson><dcc:person>{}</dcc:person><dcc:mainSigner>true</dcc:mainSigner>\
         </dcc:respPerson></dcc:respPersons>\n<dcc:customer>{contact}</dcc:customer>\n{}</dcc:administrativeData>\n\
         <dcc:measurementResults>\n{}{}<dcc:measurementResult>{}<dcc:results>\n{results}</dcc:results>\
         </dcc:measurementResult>\n</dcc:measurementResults>\n</dcc:digitalCalibrationCertificate>\n",
        software(),
        core(id, head, country),
        item(head, &certified.drives),
        name(person),
        statement(head, &certified.remarks),
        equipment(head),
        conditions(head, &certified.conditions),
        name(title),
    );
    Ok(Written {
        text,
        told: vec![
            "in-house, not accredited, not signed: the certificate says so; whoever signs it answers for it".into(),
            "its dates are the day on which the calibration was stored".into(),
        ],
        figures: Map::new(),
    })
}

fn given<'a>(option: &str, value: Option<&'a str>) -> Result<&'a str, Failure> {
    let value = value.map(str::trim).filter(|it| !it.is_empty());
    value.ok_or_else(|| Failure::Usage {
        what: format!("--format dcc: a certificate names who issues it, and {option} does not say"),
        help: "add --laboratory NAME --country DE --person NAME".into(),
    })
}

fn country(text: &str) -> Result<&str, Failure> {
    match text.len() == 2 && text.bytes().all(|it| it.is_ascii_uppercase()) {
        true => Ok(text),
        false => Err(Failure::Usage {
            what: format!("--country {text}: it is two capital letters (ISO 3166-1)"),
            help: "write DE for Germany".into(),
        }),
    }
}

/// Text as XML holds it; what XML cannot hold at all is left out.
fn escaped(text: &str) -> String {
    let mut out = String::new();
    for it in text.chars() {
        match it {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '\t' | '\n' | '\r' => out.push(' '),
            it if it.is_control() || matches!(it, '\u{fffe}' | '\u{ffff}') => {}
            it => out.push(it),
        }
    }
    out
}

fn content(text: &str) -> String {
    format!("<dcc:content lang=\"en\">{}</dcc:content>", escaped(text))
}

fn name(text: &str) -> String {
    format!("<dcc:name>{}</dcc:name>", content(text))
}

fn software() -> String {
    format!(
        "<dcc:dccSoftware><dcc:software>{}<dcc:release>{}</dcc:release></dcc:software></dcc:dccSoftware>\n",
        name("truestage"),
        env!("CARGO_PKG_VERSION")
    )
}

fn core(id: &str, head: &RecordHead, country: &str) -> String {
    // RFC 3339 begins with the day.
    let day = head.created.get(..10).unwrap_or(&head.created);
    format!(
        "<dcc:coreData><dcc:countryCodeISO3166_1>{country}</dcc:countryCodeISO3166_1>\
         <dcc:usedLangCodeISO639_1>en</dcc:usedLangCodeISO639_1>\
         <dcc:mandatoryLangCodeISO639_1>en</dcc:mandatoryLangCodeISO639_1>\
         <dcc:uniqueIdentifier>truestage {id}</dcc:uniqueIdentifier>\
         <dcc:beginPerformanceDate>{day}</dcc:beginPerformanceDate>\
         <dcc:endPerformanceDate>{day}</dcc:endPerformanceDate>\
         <dcc:performanceLocation>other</dcc:performanceLocation></dcc:coreData>\n"
    )
}

fn item(head: &RecordHead, drives: &[u32]) -> String {
    let identification = |value: &str, what: &str| {
        let value = if value.is_empty() { "unknown" } else { value };
        format!(
            "<dcc:identification><dcc:issuer>owner</dcc:issuer><dcc:value>{}</dcc:value>{}</dcc:identification>",
            escaped(value),
            name(what)
        )
    };
    let drive = |serial: &u32| {
        let what = "serial number of the drive, 0 where unknown";
        identification(&serial.to_string(), what)
    };
    let drives: String = match drives {
        [] => drive(&head.drive.serial),
        several => several.iter().map(drive).collect(),
    };
    format!(
        "<dcc:items><dcc:item>{}<dcc:identifications>{}{drives}{}</dcc:identifications></dcc:item></dcc:items>\n",
        name(&format!("Axis {} of machine {}", head.axis, head.machine)),
        identification(&head.stage_serial, "serial number of the stage"),
        identification(&head.config_hash, "hash of the configuration")
    )
}

fn statement(head: &RecordHead, remarks: &[String]) -> String {
    let certificates = match head.instrument.certificates.as_slice() {
        [] => "The certificates of the instruments are not part of it.",
        _ => {
            "The certificates that corrected the readings are named with what measured; other instruments may have had \
             none."
        }
    };
    let remarks: String = remarks.iter().map(|it| format!(" {it}")).collect();
    format!(
        "<dcc:statements><dcc:statement>{}<dcc:declaration>{}</dcc:declaration></dcc:statement></dcc:statements>\n",
        name("In-house calibration, not accredited"),
        content(&format!(
            "This certificate was made by a program from a stored calibration. No accreditation body has assessed who \
             issues it. It is not signed. {certificates}{remarks}"
        ))
    )
}

fn equipment(head: &RecordHead) -> String {
    let instrument = &head.instrument;
    let is_corrected = [
        ("air", instrument.air_corrected),
        ("material temperature", instrument.material_corrected),
        ("dead path", instrument.dead_path_corrected),
        ("cosine", instrument.cosine_corrected),
    ];
    let corrected: Vec<&str> = is_corrected
        .iter()
        .filter(|it| it.1)
        .map(|it| it.0)
        .collect();
    let corrected = match corrected.as_slice() {
        [] => "nothing".to_owned(),
        all => all.join(", "),
    };
    let lacks = instrument
        .warning()
        .map_or(String::new(), |it| format!("; {it}"));
    let certified: String = instrument
        .certificates
        .iter()
        .map(|it| format!("; {}", it.text()))
        .collect();
    let what = format!(
        "{} {}; corrected for: {corrected}{lacks}{certified}; source: {}",
        instrument.name, instrument.identity, head.source
    );
    format!(
        "<dcc:measuringEquipments><dcc:measuringEquipment>{}<dcc:description>{}</dcc:description></dcc:measuringEquipment>\
         </dcc:measuringEquipments>\n",
        name(&instrument.name),
        content(&what)
    )
}

fn conditions(head: &RecordHead, others: &str) -> String {
    let environment = &head.environment;
    let known = [
        (
            "air temperature",
            environment.air_temperature_c,
            "\\degreecelsius",
        ),
        (
            "material temperature",
            environment.material_temperature_c,
            "\\degreecelsius",
        ),
        ("air pressure", environment.pressure_pa, "\\pascal"),
        ("relative humidity", environment.relative_humidity, "\\one"),
    ];
    let each = known.iter().filter_map(|(what, value, unit)| {
        let value = (*value)?;
        Some(condition(
            &format!("{what}, mean over the run"),
            value,
            unit,
        ))
    });
    match each.collect::<String>() + others {
        none if none.is_empty() => none,
        each => format!("<dcc:influenceConditions>{each}</dcc:influenceConditions>\n"),
    }
}

fn condition(what: &str, value: f64, unit: &str) -> String {
    format!(
        "<dcc:influenceCondition>{}<dcc:data><dcc:quantity><si:real><si:value>{value}</si:value>\
         <si:unit>{unit}</si:unit></si:real></dcc:quantity></dcc:data></dcc:influenceCondition>",
        name(what)
    )
}

fn uncertainty(node: &NodeRecord, side: Approach) -> Option<f64> {
    match side {
        Approach::Forward => node.forward_u_m,
        Approach::Reverse => node.reverse_u_m,
    }
}

fn deviation(node: &NodeRecord, side: Approach) -> Option<f64> {
    match side {
        Approach::Forward => node.forward_m,
        Approach::Reverse => node.reverse_m,
    }
}

fn result(content: &LinearContent, side: Approach) -> String {
    let list = |of: &dyn Fn(&NodeRecord) -> Option<f64>| -> Vec<f64> {
        content.nodes.iter().filter_map(of).collect()
    };
    let approach = match side {
        Approach::Forward => "forward approach (growing coordinates)",
        Approach::Reverse => "reverse approach (falling coordinates)",
    };
    let (positions, deviations) = (
        list(&|it| Some(it.position_m)),
        list(&|it| deviation(it, side)),
    );
    let u = list(&|it| uncertainty(it, side));
    let columns = [
        column("target position", "\\metre", &positions, None),
        column(DEVIATION, "\\metre", &deviations, Some(&u)),
    ];
    listed(approach, &columns.concat())
}

fn listed(title: &str, columns: &str) -> String {
    format!(
        "<dcc:result>{}<dcc:data><dcc:list>\n{columns}</dcc:list></dcc:data></dcc:result>\n",
        name(title)
    )
}

/// A result of quantities that each stand by themselves.
fn quantities(title: &str, each: &str) -> String {
    format!(
        "<dcc:result>{}<dcc:data>\n{each}</dcc:data></dcc:result>\n",
        name(title)
    )
}

/// One value, with its standard uncertainty where it has one.
fn real(what: &str, unit: &str, value: f64, u: Option<f64>) -> String {
    let u = u.map_or_else(String::new, |u| {
        format!(
            "<si:measurementUncertaintyUnivariate><si:standardMU><si:valueStandardMU>{u}</si:valueStandardMU>\
             </si:standardMU></si:measurementUncertaintyUnivariate>"
        )
    });
    format!(
        "<dcc:quantity>{}<si:real><si:value>{value}</si:value><si:unit>{unit}</si:unit>{u}</si:real></dcc:quantity>\n",
        name(what)
    )
}

/// Values, with their standard uncertainties where they have some.
fn column(what: &str, unit: &str, values: &[f64], u: Option<&[f64]>) -> String {
    let joined = |values: &[f64]| {
        let each: Vec<String> = values.iter().map(f64::to_string).collect();
        each.join(" ")
    };
    let u = u.map_or_else(String::new, |u| {
        format!(
            "<si:measurementUncertaintyUnivariateXMLList><si:standardMUXMLList><si:valueStandardMUXMLList>{}\
             </si:valueStandardMUXMLList></si:standardMUXMLList></si:measurementUncertaintyUnivariateXMLList>",
            joined(u)
        )
    });
    format!(
        "<dcc:quantity>{}<si:realListXMLList><si:valueXMLList>{}</si:valueXMLList><si:unitXMLList>{unit}\
         </si:unitXMLList>{u}</si:realListXMLList></dcc:quantity>\n",
        name(what),
        joined(values)
    )
}
