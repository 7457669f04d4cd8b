//! Which file of a package imports which, and where they import one another in a circle.
//!
//! A file is a module here. What a file names of another one counts wherever it does: in `use`, in a
//! signature, in the middle of a function. A name that a module only passes on counts for the file
//! that has it. A module and those below it may know each other: they are one idea in several files.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use petgraph::algo::tarjan_scc;
use petgraph::graph::DiGraph;
use syn::visit::Visit;

/// Segments from the root of its crate.
type ModulePath = Vec<String>;

/// The files of one crate by their modules, and what each imports.
#[derive(Debug, Default)]
pub(crate) struct Imports {
    modules: BTreeMap<ModulePath, Names>,
}

/// What one file names.
#[derive(Debug, Default)]
struct Names {
    /// Of its own crate, from the root.
    paths: BTreeSet<ModulePath>,
    /// What it brings in under a name: someone who imports it from here means the original.
    passed_on: BTreeMap<String, ModulePath>,
}

impl Imports {
    /// Of the crate whose root is `file`.
    pub(crate) fn of(file: &Path) -> Self {
        let mut imports = Self::default();
        imports.read(file, Vec::new());
        imports
    }

    fn read(&mut self, file: &Path, module: ModulePath) {
        let text =
            fs::read_to_string(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        let parsed =
            syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        let mut reader = Reader {
            module: module.clone(),
            children: BTreeSet::new(),
            names: Names::default(),
        };
        reader.visit_file(&parsed);
        for child in reader.children {
            let mut path = module.clone();
            path.push(child.clone());
            self.read(&file_of(file, module.is_empty(), &child), path);
        }
        self.modules.insert(module, reader.names);
    }

    /// The module in which `path` ends, after all that is passed on.
    fn home<'a>(&'a self, path: &[String]) -> &'a [String] {
        let mut path = path.to_vec();
        // Nobody passes a name on more often; a name that is passed on to itself would never end.
        for _ in 0..8 {
            let (module, names) = self.longest(&path);
            let next = path.get(module.len());
            let Some(original) = next.and_then(|name| names.passed_on.get(name)) else {
                return module;
            };
            let rest = path.split_off(module.len() + 1);
            path = original.iter().cloned().chain(rest).collect();
        }
        self.longest(&path).0
    }

    fn longest(&self, path: &[String]) -> (&[String], &Names) {
        (0..=path.len())
            .rev()
            .find_map(|length| self.modules.get_key_value(&path[..length]))
            .map(|(module, names)| (module.as_slice(), names))
            .expect("every crate has a root")
    }

    /// Every import: who, and what of the same crate.
    pub(crate) fn each(&self) -> impl Iterator<Item = (&[String], &[String])> {
        self.modules.iter().flat_map(|(module, names)| {
            let others = names.paths.iter().map(|path| self.home(path));
            others.map(move |other| (module.as_slice(), other))
        })
    }

    /// Circles of files, the largest first; each by the names of its modules.
    pub(crate) fn circles(&self) -> Vec<Vec<String>> {
        let mut graph = DiGraph::<&[String], ()>::new();
        let nodes: BTreeMap<&[String], _> = self
            .modules
            .keys()
            .map(|module| (module.as_slice(), graph.add_node(module)))
            .collect();
        for (module, other) in self.each() {
            if !other.starts_with(module) && !module.starts_with(other) {
                graph.update_edge(nodes[module], nodes[other], ());
            }
        }
        let mut circles: Vec<Vec<String>> = tarjan_scc(&graph)
            .into_iter()
            .filter(|circle| circle.len() > 1)
            .map(|circle| circle.iter().map(|it| graph[*it].join("::")).collect())
            .collect();
        circles.sort_by_key(|it| core::cmp::Reverse(it.len()));
        circles
    }
}

/// Where `mod child;` in `parent` looks for its file.
pub(crate) fn file_of(parent: &Path, is_root: bool, child: &str) -> PathBuf {
    let folder = parent.parent().expect("a file is in a folder");
    let is_folder = is_root || parent.ends_with("mod.rs");
    let folder = match parent.file_stem() {
        Some(stem) if !is_folder => folder.join(stem),
        _ => folder.to_owned(),
    };
    let file = folder.join(format!("{child}.rs"));
    match file.exists() {
        true => file,
        false => folder.join(child).join("mod.rs"),
    }
}

/// Collects what a file names, without its tests.
struct Reader {
    module: ModulePath,
    children: BTreeSet<String>,
    names: Names,
}

impl Reader {
    /// From the root of the crate, when `path` is one of this crate.
    fn absolute(&self, path: &[String]) -> Option<ModulePath> {
        let mut base = self.module.clone();
        let mut rest = path;
        match path.first()?.as_str() {
            "crate" => (base, rest) = (Vec::new(), &path[1..]),
            "self" => rest = &path[1..],
            "super" => {
                while let Some((_, tail)) = rest.split_first().filter(|(it, _)| *it == "super") {
                    base.pop();
                    rest = tail;
                }
            }
            child if self.children.contains(child) => {}
            _ => return None,
        }
        base.extend_from_slice(rest);
        Some(base)
    }

    fn import(&mut self, tree: &syn::UseTree, before: &mut Vec<String>) {
        match tree {
            syn::UseTree::Path(it) => {
                before.push(it.ident.to_string());
                self.import(&it.tree, before);
                before.pop();
            }
            syn::UseTree::Group(it) => {
                for tree in &it.items {
                    self.import(tree, before);
                }
            }
            syn::UseTree::Name(it) => self.bring_in(before, &it.ident, &it.ident),
            syn::UseTree::Rename(it) => self.bring_in(before, &it.ident, &it.rename),
            syn::UseTree::Glob(_) => {
                if let Some(path) = self.absolute(before) {
                    self.names.paths.insert(path);
                }
            }
        }
    }

    fn bring_in(&mut self, before: &[String], name: &syn::Ident, here: &syn::Ident) {
        let mut path = before.to_vec();
        if name != "self" {
            path.push(name.to_string());
        }
        if let Some(path) = self.absolute(&path) {
            self.names.passed_on.insert(here.to_string(), path.clone());
            self.names.paths.insert(path);
        }
    }
}

impl<'ast> Visit<'ast> for Reader {
    fn visit_file(&mut self, file: &'ast syn::File) {
        // Children first: a path may begin with one before it is declared.
        for item in &file.items {
            if let syn::Item::Mod(it) = item
                && it.content.is_none()
                && !is_test(&it.attrs)
            {
                self.children.insert(it.ident.to_string());
            }
        }
        syn::visit::visit_file(self, file);
    }

    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        if !is_test(&item.attrs) {
            syn::visit::visit_item_mod(self, item);
        }
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        if !is_test(&item.attrs) {
            self.import(&item.tree, &mut Vec::new());
        }
    }

    fn visit_item_fn(&mut self, item: &'ast syn::ItemFn) {
        if !is_test(&item.attrs) {
            syn::visit::visit_item_fn(self, item);
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let segments = path.segments.iter().map(|it| it.ident.to_string());
        let segments: Vec<String> = segments.collect();
        if segments.len() > 1
            && let Some(path) = self.absolute(&segments)
        {
            self.names.paths.insert(path);
        }
        syn::visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, item: &'ast syn::Macro) {
        // What stands in a macro is no syntax tree; of the paths in it those from the root show.
        let text = item.tokens.to_string();
        for (at, _) in text.match_indices("crate ::") {
            let words = text[at..].split("::").map(str::trim);
            let path = words.map_while(|word| {
                let end = word.find(|it: char| !it.is_alphanumeric() && it != '_');
                let ident = &word[..end.unwrap_or(word.len())];
                (!ident.is_empty()).then(|| ident.to_owned())
            });
            let path: Vec<String> = path.collect();
            if let Some(path) = self.absolute(&path) {
                self.names.paths.insert(path);
            }
        }
        syn::visit::visit_macro(self, item);
    }
}

/// `#[cfg(test)]`, alone or among others.
pub(crate) fn is_test(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|it| {
        it.path().is_ident("cfg")
            && it
                .meta
                .require_list()
                .is_ok_and(|list| list.tokens.to_string() == "test")
    })
}
