//! What a section can hold.

use std::collections::BTreeMap;

use serde_json::Value as Schema;
use toml::{Table, Value};

use crate::config::meant::key_meant;
use crate::config::schema::DEVICE;

/// What a section can hold, with the device that it is about, where it is about one.
pub(super) struct Section<'a> {
    pub(super) keys: BTreeMap<&'a str, &'a Schema>,
    pub(super) required: Vec<&'a str>,
    pub(super) device: Option<&'a str>,
    /// Of devices that it is not about.
    others: Vec<&'a str>,
}

impl<'a> Section<'a> {
    pub(super) fn of(schema: &'a Schema, seen: &Table) -> Self {
        let mut section = Self {
            keys: BTreeMap::new(),
            required: Vec::new(),
            device: None,
            others: Vec::new(),
        };
        section.add(schema);
        let word = seen.get(DEVICE).and_then(Value::as_str);
        let variants = schema["oneOf"].as_array().into_iter().flatten();
        for variant in variants.clone() {
            let device = variant["properties"][DEVICE]["const"].as_str();
            if device.is_some() && device == word {
                section.device = device;
                section.add(variant);
            } else {
                let keys = variant["properties"].as_object().into_iter().flatten();
                section.others.extend(keys.map(|(key, _)| key.as_str()));
            }
        }
        if let Some(device) = section.device {
            section.keys.retain(|key, own| {
                let is_own = own["x-device"].as_str().is_none_or(|it| it == device);
                if !is_own {
                    section.others.push(key);
                }
                is_own
            });
        }
        if section.device.is_none() && variants.clone().next().is_some() {
            // What it can be is told where the word stands.
            section.keys.insert(DEVICE, &schema["oneOf"]);
            section.required.push(DEVICE);
        }
        section
    }

    /// The devices that have all keys of `seen`, where the one that it names lacks several.
    pub(super) fn devices_meant(schema: &'a Schema, seen: &Table) -> Vec<&'a str> {
        let word = seen.get(DEVICE).and_then(Value::as_str);
        let lacks = |variant: &Schema| {
            let keys = seen.keys();
            keys.filter(|it| schema["properties"][it.as_str()].is_null())
                .filter(|it| variant["properties"][it.as_str()].is_null())
                .count()
        };
        let named = |variant: &'a Schema| variant["properties"][DEVICE]["const"].as_str();
        let variants = || schema["oneOf"].as_array().into_iter().flatten();
        let own = variants().find(|it| named(it) == word && word.is_some());
        match own.is_some_and(|it| lacks(it) > 1) {
            true => variants()
                .filter(|it| lacks(it) == 0)
                .filter_map(named)
                .collect(),
            false => Vec::new(),
        }
    }

    fn add(&mut self, part: &'a Schema) {
        let keys = part["properties"].as_object().into_iter().flatten();
        self.keys.extend(keys.map(|(key, own)| (key.as_str(), own)));
        let required = part["required"].as_array().into_iter().flatten();
        self.required.extend(required.filter_map(Schema::as_str));
    }

    /// The keys of `free` that must be there.
    pub(super) fn lacking(&self, free: &[&'a str]) -> Vec<&'a str> {
        let lacks = free.iter().filter(|it| self.required.contains(it));
        lacks.copied().collect()
    }

    /// What to say of a mistyped part of a section's name (`[axsi.x.zero]`), which other sections may have right.
    pub(super) fn part_meant(&self, key: &str, value: &Value) -> Option<&'a str> {
        let lists = value
            .as_array()
            .is_some_and(|it| it.iter().all(Value::is_table));
        if !(value.is_table() || lists) {
            return None;
        }
        let keys: Vec<&str> = self.keys.keys().copied().collect();
        key_meant(key, &keys)
    }

    pub(super) fn is_of_another_device(&self, key: &str) -> bool {
        self.others.contains(&key)
    }

    pub(super) fn has_no_such_key(&self) -> String {
        let device = self.device.unwrap_or_default();
        format!("`device = \"{device}\"` has no such key")
    }
}
