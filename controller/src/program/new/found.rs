//! What `truestage scan --json` found, given to the sections that it can be.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::draft::Draft;

/// What the scan printed.
#[derive(Debug, Deserialize)]
pub(super) struct Scan {
    devices: Vec<Device>,
}

#[derive(Clone, Debug, Deserialize)]
struct Device {
    port: String,
    node: Option<u8>,
    identity: Option<Who>,
}

#[derive(Clone, Debug, Deserialize)]
struct Who {
    device_type: u32,
    vendor: u32,
    product: u32,
    revision: u32,
    serial: u32,
}

/// A bus, and the device profile that a node on it has (0x1000, its low half).
type Sort = (String, u32);

const PROFILE: u32 = 0xFFFF;
const DEVICE_TYPE: &str = ".identity.device_type";

/// Takes node numbers and identities from the scan, by profile and in the order of the numbers; says what does not
/// come out even, and what somebody must look at.
pub(super) fn fill(draft: &mut Draft, scan: &Scan) -> Vec<String> {
    let mut notes = Vec::new();
    let mut found = by_sort(scan);
    for (sort, sections) in sections(draft) {
        let nodes = found.remove(&sort).unwrap_or_default();
        let is_only = sections.len() == 1 && nodes.len() == 1;
        for (section, (node, who)) in sections.iter().zip(&nodes) {
            give(draft, section, *node, who, is_only);
        }
        let (bus, profile) = &sort;
        if sections.len() > 1 && !nodes.is_empty() {
            notes.push(format!(
                "{bus}: {} are given the nodes of profile CiA {profile} in the order of their numbers; look whether \
                 that is so",
                sections.join(", ")
            ));
        }
        for section in sections.iter().skip(nodes.len()) {
            notes.push(format!(
                "{bus}: no node of profile CiA {profile} is there for [{section}]"
            ));
        }
        for (node, who) in nodes.iter().skip(sections.len()) {
            notes.push(unused(bus, *node, who));
        }
    }
    for ((bus, _), nodes) in &found {
        notes.extend(nodes.iter().map(|(node, who)| unused(bus, *node, who)));
    }
    notes
}

fn unused(bus: &str, node: u8, who: &Who) -> String {
    format!(
        "{bus}: node {node} (type {:#010X}) is in no section of this file",
        who.device_type
    )
}

fn by_sort(scan: &Scan) -> BTreeMap<Sort, Vec<(u8, Who)>> {
    let mut found: BTreeMap<Sort, Vec<(u8, Who)>> = BTreeMap::new();
    for device in &scan.devices {
        if let (Some(node), Some(who)) = (device.node, &device.identity) {
            let sort = (device.port.clone(), who.device_type & PROFILE);
            found.entry(sort).or_default().push((node, who.clone()));
        }
    }
    for nodes in found.values_mut() {
        nodes.sort_by_key(|(node, _)| *node);
    }
    found
}

/// The sections of nodes, in the order of the file.
fn sections(draft: &Draft) -> BTreeMap<Sort, Vec<String>> {
    let mut sections: BTreeMap<Sort, Vec<String>> = BTreeMap::new();
    for path in draft.paths() {
        let Some(section) = path.strip_suffix(DEVICE_TYPE) else {
            continue;
        };
        let value = |key: &str| draft.at(key).map(|it| it.value);
        let bus = value(&format!("{section}.bus")).unwrap_or_default();
        let device_type = value(&path).unwrap_or_default().replace('_', "");
        let digits = device_type.trim_start_matches("0x");
        let profile = u32::from_str_radix(digits, 16).unwrap_or_default() & PROFILE;
        let sort = (bus.trim_matches('"').to_owned(), profile);
        sections.entry(sort).or_default().push(section.to_owned());
    }
    sections
}

fn give(draft: &mut Draft, section: &str, node: u8, who: &Who, is_only: bool) {
    let number = format!("{section}.node_id");
    match is_only {
        true => draft.set(&number, &node.to_string()),
        false => draft.propose(&number, &node.to_string()),
    };
    for (key, value) in [
        ("device_type", who.device_type),
        ("vendor_id", who.vendor),
        ("product_code", who.product),
        ("revision", who.revision),
        ("serial_number", who.serial),
    ] {
        // What an example leaves open stays open.
        draft.set(
            &format!("{section}.identity.{key}"),
            &format!("{value:#010X}"),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::parse;

    fn filled(example: &str, devices: &str) -> (Draft, Vec<String>) {
        let scan = serde_json::from_str(&format!("{{\"devices\": [{devices}]}}"));
        let mut draft = Draft::of(example);
        let notes = fill(&mut draft, &scan.expect("it is what a scan prints"));
        parse(&draft.text(), "new.toml").unwrap_or_else(|error| panic!("{error}"));
        (draft, notes)
    }

    fn device(node: u8, profile: u32) -> String {
        let device_type = 0x0002_0000 + profile;
        format!(
            "{{\"port\": \"can0\", \"node\": {node}, \"name\": null, \"mismatches\": [], \"identity\": \
             {{\"device_type\": {device_type}, \"vendor\": 5, \"product\": 6, \"revision\": 7, \"serial\": {node}, \
             \"name\": \"\"}}}}"
        )
    }

    #[track_caller]
    fn check(draft: &Draft, path: &str, value: &str, is_marked: bool) {
        assert_eq!(draft.at(path).expect("it is there").value, value);
        let marked = draft.marked();
        assert_eq!(marked.iter().any(|it| it.path == path), is_marked, "{path}");
    }

    #[test]
    fn the_only_drive_and_the_only_module_are_known_and_what_is_more_is_told() {
        let example = include_str!("../../../../configs/machines/linear.toml");
        let devices = [device(9, 401), device(4, 402), device(30, 406)].join(",");
        let (draft, notes) = filled(example, &devices);
        check(&draft, "axis.x.node_id", "4", false);
        check(&draft, "axis.x.identity.vendor_id", "0x00000005", false);
        check(&draft, "analog.hall.node_id", "9", false);
        assert_eq!(notes.len(), 1);
        assert!(
            notes[0].contains("node 30 (type 0x00020196) is in no section"),
            "{notes:?}"
        );
    }

    #[test]
    fn which_of_several_drives_is_which_axis_somebody_must_look_at() {
        let example = include_str!("../../../../configs/machines/uvw.toml");
        let (draft, notes) = filled(example, &[device(8, 402), device(7, 402)].join(","));
        check(&draft, "axis.u.node_id", "7", true);
        check(&draft, "axis.v.identity.serial_number", "0x00000008", false);
        assert!(
            notes[0].contains("in the order of their numbers"),
            "{notes:?}"
        );
        assert!(
            notes[1].contains("no node of profile CiA 402 is there for [axis.w]"),
            "{notes:?}"
        );
    }
}
