//! Reading a configuration file: syntax, structure, then sense.

use std::collections::HashMap;
use std::path::Path;

use machine::records::ConfigHash;
use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use toml::{Table, Value};

use super::certificates;
use super::consequences;
use super::dependence::hash_of;
use super::diagnostic::{ConfigError, Diagnostic, LineStarts};
use super::file::ConfigFile;
use super::lines;
use super::model::MachineConfig;
use super::other_units;
use super::place::{Part, Places};
use super::relocated::relocated;
use super::repair::{Repair, repaired};
use super::schema;
use super::structure::{self, Unread};
use super::syntax::{self, Recovered};
use super::twins;
use super::validate::{Finding, validate};
use super::warnings;
use super::whole;
use crate::certificate;
use machine::Patience;

/// A configuration that was read and judged sound.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// What the file says.
    pub config: MachineConfig,
    /// Of everything in it that a calibration depends on.
    pub hash: ConfigHash,
    /// Of the whole text: what a kept zero depends on.
    pub(crate) text: ConfigHash,
    /// What is doubtful of it, in the order of the file.
    pub warnings: Vec<Diagnostic>,
    /// What is still an example's value, marked as such by `truestage new`: a machine of it does not start.
    pub unfilled: Vec<Diagnostic>,
    /// Certificates that have ended, or are of a day to come: nothing is measured with what they certify.
    pub ended: Vec<Diagnostic>,
    /// By how much every supervision and answer time-out is longer than configured: not at all,
    /// except for emulated machines. One that lives faster than real time still meets a host whose
    /// own pauses do not shrink, so its time-outs must bear them.
    pub patience: Patience,
}

/// Reads and judges the configuration at `path`.
///
/// # Errors
/// When the file cannot be read, is no TOML, has unknown or missing keys, or asks for
/// something impossible; every finding names line and column.
pub fn load(path: &Path) -> Result<Loaded, ConfigError> {
    let text = whole::text_of(path)?;
    // Relative to the file, not to whoever calls: from another folder the machine must find the
    // same calibrations and take the same lease.
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut loaded = parse_at(&text, &path.display().to_string(), Some(folder))?;
    loaded.config.file = Some(ConfigFile::note_read(path, loaded.text.clone()));
    let section = &mut loaded.config.machine;
    section.data_dir = folder.join(&section.data_dir);
    Ok(loaded)
}

/// Reads and judges a configuration text; `file` is its name in findings.
///
/// ```
/// use truestage::config::{ConfigError, parse};
///
/// let text = include_str!("../../../configs/machines/linear.toml");
/// assert_eq!(parse(text, "linear.toml")?.config.machine.name, "linear");
///
/// let wrong = text.replace("soft_min_mm", "soft_mim_mm");
/// let Err(ConfigError::Invalid { findings }) = parse(&wrong, "linear.toml") else {
///     panic!("the key is not known")
/// };
/// assert!(findings[0].help.contains("did you mean `soft_min_mm`?"));
/// # Ok::<(), ConfigError>(())
/// ```
///
/// # Errors
/// As [`load`].
pub fn parse(text: &str, file: &str) -> Result<Loaded, ConfigError> {
    parse_at(text, file, None)
}

/// Likewise of a file whose folder is known: the paths of its certificates count from there.
fn parse_at(text: &str, file: &str, folder: Option<&Path>) -> Result<Loaded, ConfigError> {
    if let Some(error) = whole::no_machine(text, file) {
        return Err(error);
    }
    if let Some(error) = whole::too_many_sections(text, file) {
        return Err(error);
    }
    let mut config: MachineConfig = read_by(text, file, schema::inline(), validate)?;
    let mut findings = Vec::new();
    certificate::read(config.certificates_mut(), folder, &mut findings);
    let at_values = |it: Vec<Finding>| it.into_iter().map(|it| (it, Part::Value));
    if !findings.is_empty() {
        return Err(invalid(text, file, at_values(findings).collect()));
    }
    let mut warnings = warnings::of(&config);
    let glued = lines::glued(text, file);
    let ended = certificates::judged(&config, certificate::today(), &mut warnings);
    Ok(Loaded {
        hash: hash_of(&config),
        text: ConfigHash::of_texts(text, &[]),
        warnings: merged(placed(text, file, at_values(warnings)), glued),
        ended: placed(text, file, at_values(ended)),
        unfilled: lines::unfilled(text, file),
        config,
        patience: Patience::NONE,
    })
}

/// Both, in the order of the file.
fn merged(mut found: Vec<Diagnostic>, more: Vec<Diagnostic>) -> Vec<Diagnostic> {
    found.extend(more);
    found.sort_by_key(|it| (it.line, it.column));
    found
}

impl Loaded {
    /// Whether all its certificates hold.
    ///
    /// # Errors
    /// Names each that does not.
    #[cfg(feature = "program")]
    pub(crate) fn certified(&self) -> Result<(), ConfigError> {
        filled_in(&self.ended)
    }

    /// Whether it is a machine's own throughout.
    ///
    /// # Errors
    /// Names each value that is still an example's: nobody knows where that would send the axes.
    #[cfg(feature = "program")]
    pub(crate) fn filled_in(&self) -> Result<(), ConfigError> {
        filled_in(&self.unfilled)
    }
}

/// Likewise, of a machine that was made of it.
pub(crate) fn filled_in(unfilled: &[Diagnostic]) -> Result<(), ConfigError> {
    match unfilled {
        [] => Ok(()),
        _ => Err(ConfigError::Invalid {
            findings: unfilled.to_vec(),
        }),
    }
}

/// Reads a text that is not a machine's by the declarations of `C`, and lets `judge` find what cannot be; `file` is
/// its name in findings.
///
/// # Errors
/// As [`parse`].
pub(crate) fn read<C: DeserializeOwned + JsonSchema>(
    text: &str,
    file: &str,
    judge: impl FnMut(&C) -> Vec<Finding>,
) -> Result<C, ConfigError> {
    read_by(text, file, &schema::inline_of::<C>(), judge)
}

fn read_by<C: DeserializeOwned>(
    text: &str,
    file: &str,
    schema: &serde_json::Value,
    mut judge: impl FnMut(&C) -> Vec<Finding>,
) -> Result<C, ConfigError> {
    if let Some(error) = whole::told(text, file) {
        return Err(error);
    }
    let (document, recovered) = match text.parse::<Table>() {
        Ok(document) => (document, Recovered::of(text)),
        Err(error) => {
            let recovered = syntax::recovered(text, file, schema);
            match recovered.text.parse::<Table>() {
                // Where no line is wrong by itself, what is wrong with the whole is told.
                Ok(document) if !recovered.findings.is_empty() => (document, recovered),
                _ => return Err(unreadable(text, file, &error)),
            }
        }
    };
    let (document, relocated) = relocated(document, schema);
    let (document, regrouped) = structure::regrouped(document, schema);
    let unread = Unread {
        keys: &recovered.unread,
        cut_short: &recovered.cut_short,
        a_section: recovered.has_lost_heading,
    };
    let found = structure::judge((&document, &recovered.text), schema, unread);
    let has_nameless = found.has_nameless;
    let (mut findings, repairs, doubts) = (found.findings, found.repairs, found.doubts);
    let in_other_units = found.converted;
    findings.extend(relocated);
    findings.extend(regrouped);
    let document = repaired(document, &repairs);
    let config = Value::Table(document.clone()).try_into::<C>();
    let (config, document) = match config {
        // A number that its key cannot hold (`node_id = 300`) would hide what else is wrong.
        Err(_) if !doubts.is_empty() => {
            let document = consequences::within(document, &doubts);
            (Value::Table(document.clone()).try_into::<C>(), document)
        }
        config => (config, document),
    };
    let is_sound = findings.is_empty() && recovered.findings.is_empty();
    let config = match config {
        Ok(config) => Some(config),
        // The schema is made of the same declarations: what it lets pass can be read.
        Err(error) if is_sound => return Err(unreadable(text, file, &error)),
        Err(_) => None,
    };
    let of_findings = findings.iter().map(|(it, _)| it.key.clone());
    let told: Vec<_> = of_findings
        .chain(repairs.iter().flat_map(Repair::doubted))
        .collect();
    // By a value that cannot be read nothing else can be judged, not even by what it is when it is not there.
    let is_whole = recovered.unread.is_empty() && !recovered.has_lost_heading && !has_nameless;
    let judged: Vec<Finding> = config
        .iter()
        .filter(|_| is_whole)
        .flat_map(&mut judge)
        .collect();
    let mut found_in = |it: &Table| {
        let config = Value::Table(it.clone()).try_into::<C>();
        Some(judge(&config.ok()?))
    };
    let of_units = (document, &in_other_units[..]);
    let (judged, document) = other_units::judged(judged, of_units, &mut findings, &mut found_in);
    let judged = consequences::left_out(judged, &document, &doubts, found_in);
    for finding in judged {
        // What is impossible by itself is told once, and not again of the section around it.
        if !told.iter().any(|key| is_within(key, &finding.key)) {
            findings.push((finding, Part::Value));
        }
    }
    match config {
        Some(config) if is_sound && findings.is_empty() => Ok(config),
        _ => Err(refused(recovered, file, findings)),
    }
}

/// All findings, in the order of the file.
fn refused(mut recovered: Recovered, file: &str, findings: Vec<(Finding, Part)>) -> ConfigError {
    let findings = findings.into_iter();
    let findings = findings.filter(|(it, _)| !recovered.contested.contains(&it.key));
    let findings = with_sizes(findings.collect(), &mut recovered.findings).into_iter();
    let mut found = placed(&recovered.text, file, findings);
    let is_mistaken = |it: &&Diagnostic| {
        let is_of_value =
            it.cause.starts_with("expected") || it.cause.ends_with("is not known here");
        is_of_value && recovered.taken_for_text.contains(&it.line)
    };
    // A word where a number belongs is told as that.
    let mistaken: Vec<_> = found.iter().filter(is_mistaken).map(|it| it.line).collect();
    let of_syntax = recovered.findings.into_iter();
    found.extend(of_syntax.filter(|it| !mistaken.contains(&it.line)));
    let found = twins::told(in_order(found));
    ConfigError::Invalid { findings: found }
}

/// `findings` without the sizes of values that are told already because of how they are written: there they are added.
fn with_sizes(
    mut findings: Vec<(Finding, Part)>,
    written: &mut [Diagnostic],
) -> Vec<(Finding, Part)> {
    findings.retain(|(finding, part)| {
        let mut told = written.iter_mut().filter(|_| *part == Part::Size);
        let Some(own) = told.find(|it| it.key == finding.key) else {
            return true;
        };
        own.help += &format!("; but {}: {}", finding.cause, finding.help);
        false
    });
    findings
}

/// By lines, but what a section lacks behind what is wrong in it, which it may be.
fn in_order(mut found: Vec<Diagnostic>) -> Vec<Diagnostic> {
    let is_missing = |it: &Diagnostic| it.cause.starts_with("missing");
    let causes = found.iter().filter(|it| !is_missing(it));
    let causes = causes.map(|it| {
        (
            it.key.rsplit_once('.').map_or("", |it| it.0),
            &it.key,
            it.line,
        )
    });
    // Of each section, and of each key, the last line that says what is wrong.
    let mut last_of: HashMap<String, usize> = HashMap::new();
    for (section, key, line) in causes {
        for name in [section, key] {
            let last = last_of.entry(name.to_owned()).or_default();
            *last = line.max(*last);
        }
    }
    found.sort_by_cached_key(|it| {
        let last = last_of.get(&it.key).copied();
        let last = last.filter(|_| is_missing(it));
        (
            last.unwrap_or_default().max(it.line),
            last.is_some(),
            it.column,
        )
    });
    found
}

/// Whether `key` is `section` or stands in it.
fn is_within(key: &str, section: &str) -> bool {
    let rest = key.strip_prefix(section);
    rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}

/// What can be said of neither its lines nor its keys.
fn unreadable(text: &str, file: &str, error: &toml::de::Error) -> ConfigError {
    let span = error.span().unwrap_or(0..0);
    let cause = error.message().lines().next().unwrap_or("not valid");
    let help = "compare it with configs/README.md, which describes every key";
    let finding = Diagnostic::at(file, text, &span, "", cause.to_owned(), help.into());
    ConfigError::Invalid {
        findings: vec![finding],
    }
}

/// Each finding at its place, in the order of the file.
fn invalid(text: &str, file: &str, findings: Vec<(Finding, Part)>) -> ConfigError {
    ConfigError::Invalid {
        findings: placed(text, file, findings.into_iter()),
    }
}

fn placed(
    text: &str,
    file: &str,
    findings: impl Iterator<Item = (Finding, Part)>,
) -> Vec<Diagnostic> {
    let (places, lines) = (Places::of(text), LineStarts::find(text));
    let placed = findings.map(|(finding, part)| {
        let span = places.span_of(&finding.key, part).unwrap_or(0..0);
        let (line, column) = lines.place_of(span.start);
        Diagnostic {
            file: file.to_owned(),
            line,
            column,
            key: finding.key,
            cause: finding.cause,
            help: finding.help,
        }
    });
    let mut placed: Vec<_> = placed.collect();
    placed.sort_by_key(|it| (it.line, it.column));
    placed.dedup();
    placed
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Edit;

    const LINEAR: &str = include_str!("../../../configs/machines/linear.toml");
    const ROTARY: &str = include_str!("../../../configs/machines/rotary.toml");

    #[track_caller]
    fn findings(text: &str) -> Vec<Diagnostic> {
        match parse(text, "m.toml") {
            Err(ConfigError::Invalid { findings }) => findings,
            other => panic!("{other:?}"),
        }
    }

    #[track_caller]
    fn line_of(needle: &str) -> usize {
        LINEAR
            .lines()
            .position(|line| line.starts_with(needle))
            .expect(needle)
            + 1
    }

    #[test]
    fn the_shipped_configuration_is_sound() {
        parse(LINEAR, "linear.toml").unwrap_or_else(|error| panic!("{error}"));
    }

    #[test]
    fn a_key_with_the_wrong_unit_is_named_with_line_and_the_right_one() {
        let text = LINEAR.edit("soft_min_mm", "soft_min_um");
        let found = &findings(&text)[0];
        assert_eq!((found.line, found.column), (line_of("soft_min_mm"), 1));
        assert!(found.help.contains("`soft_min_mm`"), "{found}");
    }

    /// 1875 us are no 255 units of anything: every `follow` would fail.
    #[test]
    fn a_period_that_a_drive_cannot_be_told_is_refused_when_it_is_loaded() {
        let cyclic = "synchronous_start = true\n[axis.x.cyclic]\njerk_mm_per_s3 = 100000.0\n\
                      deviation_limit_um = 1000.0\n[axis.x.identity]";
        let text = LINEAR.edit("[axis.x.identity]", cyclic);
        let with = |ms: &str| text.edit("sync_period_ms = 5.0", &format!("sync_period_ms = {ms}"));
        parse(&with("5.0"), "m.toml").unwrap_or_else(|error| panic!("{error}"));
        let found = &findings(&with("1.875"))[0];
        assert!(found.cause.contains("0x60C2"), "{found}");
        assert!(found.help.ends_with("to 1.88"), "{found}");
        parse(&with("1.88"), "m.toml").unwrap_or_else(|error| panic!("{error}"));
    }

    #[test]
    fn a_missing_key_is_named() {
        let text = LINEAR.edit("resolution_nm = 10.0", "#");
        assert!(findings(&text)[0].cause.contains("resolution_nm"));
    }

    #[test]
    fn impossible_values_are_found_where_they_stand() {
        let text = LINEAR.edit("soft_max_mm = 63.0", "soft_max_mm = -9.0");
        let found = &findings(&text)[0];
        assert_eq!(found.key, "axis.x.soft_max_mm");
        assert_eq!((found.line, found.column), (line_of("soft_max_mm"), 15));
    }

    /// What TOML can write and no machine can be.
    #[test]
    fn values_that_would_move_an_axis_where_it_must_not_go_are_refused() {
        for (from, to, key) in [
            (
                "soft_min_mm = -3.0",
                "soft_min_mm = nan",
                "axis.x.soft_min_mm",
            ),
            (
                "soft_max_mm = 63.0",
                "soft_max_mm = nan",
                "axis.x.soft_max_mm",
            ),
            (
                "negative_limit_mm = -6.0",
                "negative_limit_mm = 6.0",
                "axis.x.zero.negative_limit_mm",
            ),
            (
                "negative_limit_mm = -6.0",
                "negative_limit_mm = nan",
                "axis.x.zero.negative_limit_mm",
            ),
            (
                "standard_uncertainty_limit_um = 0.2",
                "standard_uncertainty_limit_um = nan",
                "axis.x.zero.standard_uncertainty_limit_um",
            ),
            (
                "rail_high_v = 4.9",
                "rail_high_v = 9.9",
                "axis.x.zero.rail_high_v",
            ),
            (
                "turn_below_peak_v = 0.3",
                "turn_below_peak_v = 3.0",
                "axis.x.zero.turn_below_peak_v",
            ),
            (
                "overrun_mm = 0.5",
                "overrun_mm = 0.0",
                "axis.x.calibrate.overrun_mm",
            ),
            (
                "approach_mm = 1.0",
                "approach_mm = 34.0",
                "axis.x.compensation.approach_mm",
            ),
            (
                "approach_mm = 1.0",
                "approach_mm = 2.96",
                "axis.x.calibrate.end_mm",
            ),
            (
                "baud_bit_per_s = 115200",
                "baud_bit_per_s = 0",
                "serial.laser.baud_bit_per_s",
            ),
            ("[axis.x]", "[axis.\"../x\"]", "axis.../x"),
        ] {
            let text = LINEAR.edit(from, to).edit(
                "[axis.x.",
                match key {
                    "axis.../x" => "[axis.\"../x\".",
                    _ => "[axis.x.",
                },
            );
            let found = findings(&text);
            assert!(found.iter().any(|it| it.key == key), "{to}: {found:?}");
        }
    }

    #[test]
    fn the_shipped_rotary_table_is_sound_and_what_it_cannot_be_is_refused() {
        parse(ROTARY, "rotary.toml").unwrap_or_else(|error| panic!("{error}"));
        for (from, to, key) in [
            (
                "speed_deg_per_s = 30.0",
                "speed_deg_per_s = 300.0",
                "rotary.c.speed_deg_per_s",
            ),
            (
                "counts_per_turn = 129600000",
                "counts_per_turn = 4294967295",
                "rotary.c.counts_per_turn",
            ),
            (
                "quick_stop_deceleration_deg_per_s2 = 720.0",
                "quick_stop_deceleration_deg_per_s2 = 7200.0",
                "rotary.c.quick_stop_deceleration_deg_per_s2",
            ),
            (
                "index_deg = 0.0",
                "index_deg = nan",
                "rotary.c.zero.index_deg",
            ),
            (
                "move_timeout_s = 60.0",
                "move_timeout_s = nan",
                "rotary.c.move_timeout_s",
            ),
            ("node_id = 1\n", "node_id = 127\n", "rotary.c.node_id"),
            ("bus = \"can0\"", "bus = \"can9\"", "rotary.c.bus"),
        ] {
            let found = findings(&ROTARY.edit(from, to));
            assert!(found.iter().any(|it| it.key == key), "{to}: {found:?}");
        }
    }

    /// What is changed into what, and which key is told what.
    const REFUSED: &[(&str, &str, &str, &str)] = &[
        ("\"GP-360-0001\"", "\" \"", "calibrate.plate", "is empty"),
        (
            "lines = 360",
            "lines = 7",
            "calibrate.lines",
            "7 is impossible",
        ),
        (
            "placements = 4 ",
            "# ",
            "calibrate.offsets",
            "either `offsets`",
        ),
        (
            "placements = 4 ",
            "placements = 1 ",
            "calibrate.placements",
            "1",
        ),
        (
            "placements = 4 ",
            "offsets = [0, 1] ",
            "calibrate.optimise",
            "nothing to optimise",
        ),
        (
            "placements = 4 ",
            "offsets = [0, 12] ",
            "calibrate.offsets",
            "harmonic",
        ),
        (
            "placements = 4 ",
            "offsets = [0, 1] ",
            "calibrate.offsets",
            "harmonic 1",
        ),
        (
            "placements = 4 ",
            "offsets = [0, 1, 1] ",
            "calibrate.offsets",
            "1",
        ),
        (
            "amplification_limit = 3.0",
            "amplification_limit = 1.0",
            "calibrate.placements",
            "harmonic",
        ),
        (
            "speed_deg_per_s = 60.0\nreading",
            "speed_deg_per_s = 90.0\nreading",
            "calibrate.speed_deg_per_s",
            "SYNC",
        ),
        (
            "reading_noise_arcsec = 0.06",
            "reading_noise_arcsec = nan",
            "calibrate.reading_noise_arcsec",
            "impossible",
        ),
        (
            "[rotary.c.line_detector]",
            "[rotary.c.option_codes]",
            "calibrate",
            "`line_detector`",
        ),
        (
            "offset_lines = 200.5",
            "offset_lines = 73",
            "verify.offset_lines",
            "already",
        ),
        (
            "offset_lines = 200.5",
            "offset_lines = 360",
            "verify.offset_lines",
            "impossible",
        ),
        (
            "offset_lines = 200.5",
            "offset_lines = 200.3",
            "verify.offset_lines",
            "hard to set",
        ),
        (
            "slope_limit = 0.01",
            "slope_limit = 1.0",
            "compensation.slope_limit",
            "impossible",
        ),
    ];

    #[test]
    fn a_rotary_cycle_that_cannot_be_is_refused_before_anybody_turns_a_plate() {
        for (from, to, key, says) in REFUSED {
            let text = ROTARY.edit(from, to).edit("edge = \"positive\"", "#");
            let found = findings(&text);
            let key = format!("rotary.c.{key}");
            let told = |it: &Diagnostic| it.key == key && it.cause.contains(says);
            assert!(found.iter().any(told), "{to}: {found:?}");
        }
    }

    #[test]
    fn an_axis_and_a_rotary_axis_have_two_names() {
        let rotary = ROTARY.find("[rotary.c]").unwrap();
        let text = format!("{LINEAR}\n{}", &ROTARY[rotary..]).edit("rotary.c", "rotary.x");
        let found = findings(&text);
        assert!(found.iter().any(|it| it.key == "rotary.x"), "{found:?}");
    }

    #[test]
    fn a_calibration_run_without_limits_for_its_result_is_refused() {
        let end = LINEAR.find("[axis.x.compensation]").unwrap();
        let found = &findings(&LINEAR[..end])[0];
        assert!(found.help.contains("[axis.x.compensation]"), "{found}");
    }

    #[test]
    fn two_devices_with_one_node_id_are_refused() {
        let text = LINEAR.edit("node_id = 2", "node_id = 1");
        assert!(
            findings(&text)
                .iter()
                .any(|it| it.cause.contains("already")),
            "{text}"
        );
    }

    #[test]
    fn a_reference_to_nothing_lists_what_there_is() {
        let text = LINEAR.edit("instrument = \"laser\"", "instrument = \"lasre\"");
        assert!(findings(&text)[0].help.contains("laser"));
    }

    #[test]
    fn a_sync_period_too_short_for_the_bus_names_one_that_fits() {
        let text = LINEAR.edit("sync_period_ms = 5.0", "sync_period_ms = 0.4");
        let found = &findings(&text)[0];
        assert_eq!(found.key, "can.can0.sync_period_ms");
        assert!(found.help.contains("ms"), "{found}");
    }

    #[test]
    fn what_a_drive_does_on_its_own_is_written_only_where_the_file_says_so() {
        use crate::config::DriveConfig;
        use drivers::device::cia402::HomeOffset;
        let settings = |text: &str| {
            let config = parse(text, "m").unwrap().config;
            let axis = &config.axis["x"];
            let DriveConfig::Cia402(drive) = &axis.drive else {
                panic!("{:?}", axis.drive)
            };
            drive.settings(axis.task(), config.wiring(), Patience::NONE)
        };
        let usual = settings(LINEAR);
        assert_eq!(usual.options.quick_stop, None);
        assert_eq!(usual.home_offset, HomeOffset::IsPositionAtHome);
        let keys = "\nnode_id = 1\nhome_offset = \"zero_from_home\"\n\
                    option_codes = { quick_stop = 2, fault_reaction = -1 }\n";
        let told = settings(&LINEAR.edit_first("\nnode_id = 1\n", keys));
        assert_eq!(told.options.quick_stop, Some(2));
        assert_eq!(told.options.fault_reaction, Some(-1));
        assert_eq!(
            told.options.abort_connection,
            usual.options.abort_connection
        );
        assert_eq!(told.home_offset, HomeOffset::IsZeroFromHome);
    }

    #[test]
    fn a_platform_that_nothing_holds_or_reaches_is_refused_with_the_reason() {
        const UVW: &str = include_str!("../../../configs/machines/uvw.toml");
        let refused = |from: &str, to: &str| {
            let text = UVW.edit_first(from, to);
            assert_ne!(text, UVW, "{from}");
            parse(&text, "m").unwrap_err().to_string()
        };
        let all_along_x = refused("direction = [0.0, 1.0]", "direction = [1.0, 0.0]");
        assert!(all_along_x.contains("actuator"), "{all_along_x}");
        let too_far = refused("x_max_mm = 1.5", "x_max_mm = 4.5");
        assert!(too_far.contains("the screws cannot reach"), "{too_far}");
        let blind = refused("camera = \"eye\"", "camera = \"ear\"");
        assert!(blind.contains("there is no camera `ear`"), "{blind}");
        let turning = refused("overrun_mm = 0.1", "overrun_mm = 0.001");
        assert!(turning.contains("overrun_mm"), "{turning}");
        let twice = refused("axis = \"v\"", "axis = \"u\"");
        assert!(
            twice.contains("another screw has the axis `u` already"),
            "{twice}"
        );
        let nowhere = refused("direction = [0.0, 1.0]", "direction = [0.0, 0.0]");
        assert!(nowhere.contains("[0, 0] shows nowhere"), "{nowhere}");
        let beyond = refused("first_mm = -2.5", "first_mm = -25.0");
        assert!(
            beyond.contains("platform.calibrate.first_mm: strokes and overrun"),
            "{beyond}"
        );
        let fast = refused("speed_mm_per_s = 10.0  ", "speed_mm_per_s = 500.0  ");
        assert!(
            fast.contains("500 is more than the least speed_max_mm_per_s"),
            "{fast}"
        );
    }

    #[test]
    fn a_key_of_another_kind_of_module_is_refused() {
        let keys = "device = \"cia401\"\npoll_period_ms = 50.0";
        let text = LINEAR.edit_first("device = \"cia401\"", keys);
        let error = parse(&text, "m").unwrap_err().to_string();
        let says = "`device = \"cia401\"` has no such key";
        assert!(error.contains(says), "{error}");
    }
}
