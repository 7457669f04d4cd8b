//! What users of `truestage` can name is a list that somebody reads, and the command is none of it.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::imports::{Imports, file_of, is_test};
use crate::root;

const LIBRARY: &str = "controller/src/lib.rs";
const LIST: &str = "tests/tidy/public_names.txt";

/// How many names somebody else's program may be promised; whoever takes one off the list lowers it. The last was
/// raised for the files that whoever keeps a machine gives to a run (decision 0067).
const PROMISED_MAX: usize = 91;

/// The packages whose modules may be offered under another roof.
const PACKAGES: &[&str] = &[
    "units",
    "wire",
    "drivers",
    "compensator",
    "mock-bus",
    "machine",
];

/// A module of a package, and where the files of those below it are looked for.
#[derive(Clone)]
struct Module {
    crate_root: PathBuf,
    path: Vec<String>,
    file: PathBuf,
    items: Vec<syn::Item>,
}

impl Module {
    fn root(file: &Path) -> Self {
        Self {
            crate_root: file.to_owned(),
            path: Vec::new(),
            file: file.to_owned(),
            items: items(file),
        }
    }

    /// The module that `mod name` declares in this one.
    fn below(&self, declared: &syn::ItemMod) -> Self {
        let name = declared.ident.to_string();
        let (file, items) = match &declared.content {
            Some((_, items)) => (self.file.clone(), items.clone()),
            None => {
                let file = file_of(&self.file, self.path.is_empty(), &name);
                let items = items(&file);
                (file, items)
            }
        };
        let path = [&self.path[..], &[name]].concat();
        Self {
            crate_root: self.crate_root.clone(),
            path,
            file,
            items,
        }
    }

    /// The module that `path` names here; `None` when it is something else.
    fn named(&self, path: &[String]) -> Option<Self> {
        let (first, rest) = path.split_first()?;
        let base = match first.as_str() {
            "crate" => Self::root(&self.crate_root),
            "self" => self.clone(),
            "super" => Self::root(&self.crate_root).descend(&self.path[..self.path.len() - 1])?,
            name => match self.child(name) {
                Some(child) => child,
                None => Self::root(&package(name)?),
            },
        };
        base.descend(rest)
    }

    fn descend(self, path: &[String]) -> Option<Self> {
        path.iter()
            .try_fold(self, |module, name| module.child(name))
    }

    /// What is called `name` in this module, when that is a module: its own, or one passed on.
    fn child(&self, name: &str) -> Option<Self> {
        let own = self.items.iter().find_map(|item| match item {
            syn::Item::Mod(it) if it.ident == name && !is_test(&it.attrs) => Some(it),
            _ => None,
        });
        if let Some(own) = own {
            return Some(self.below(own));
        }
        let uses = self.items.iter().filter_map(as_use);
        let leaves = uses.flat_map(|it| leaves(&it.tree));
        let passed_on = leaves.filter(|leaf| leaf.name.as_deref() == Some(name));
        // `use machine::Machine` in a module `machine` would ask for itself.
        let mut elsewhere = passed_on.filter(|leaf| leaf.path != [name]);
        elsewhere.find_map(|leaf| self.named(&leaf.path))
    }

    /// Everything that can be named from outside below `before`.
    fn offer(&self, before: &str, offered: &mut BTreeSet<String>) {
        for item in self.items.iter().filter(|it| is_public(it)) {
            match item {
                syn::Item::Mod(it) => {
                    self.below(it)
                        .offer(&format!("{before}{}::", it.ident), offered);
                }
                syn::Item::Use(it) => {
                    for leaf in leaves(&it.tree) {
                        self.offer_leaf(&leaf, before, offered);
                    }
                }
                other => {
                    offered.extend(name_of(other).map(|name| format!("{before}{name}")));
                }
            }
        }
    }

    fn offer_leaf(&self, leaf: &Leaf, before: &str, offered: &mut BTreeSet<String>) {
        match (&leaf.name, self.named(&leaf.path)) {
            (Some(name), Some(module)) => module.offer(&format!("{before}{name}::"), offered),
            (Some(name), None) => {
                offered.insert(format!("{before}{name}"));
            }
            (None, Some(module)) => module.offer(before, offered),
            (None, None) => panic!(
                "{before}: `{}::*` is of no package here",
                leaf.path.join("::")
            ),
        }
    }
}

/// One name that a `use` brings in: under which name, and of what. A `*` has none.
struct Leaf {
    name: Option<String>,
    path: Vec<String>,
}

fn leaves(tree: &syn::UseTree) -> Vec<Leaf> {
    let below = |ident: &syn::Ident, mut leaves: Vec<Leaf>| {
        for leaf in &mut leaves {
            leaf.path.insert(0, ident.to_string());
            if leaf.path.last().is_some_and(|it| it == "self") && leaf.path.len() > 1 {
                leaf.path.pop();
                leaf.name = leaf.name.take().map(|name| match name.as_str() {
                    "self" => ident.to_string(),
                    _ => name,
                });
            }
        }
        leaves
    };
    let leaf = |name: Option<&syn::Ident>, of: Option<&syn::Ident>| {
        vec![Leaf {
            name: name.map(ToString::to_string),
            path: of.map(ToString::to_string).into_iter().collect(),
        }]
    };
    match tree {
        syn::UseTree::Path(it) => below(&it.ident, leaves(&it.tree)),
        syn::UseTree::Group(it) => it.items.iter().flat_map(leaves).collect(),
        syn::UseTree::Name(it) => leaf(Some(&it.ident), Some(&it.ident)),
        syn::UseTree::Rename(it) => leaf(Some(&it.rename), Some(&it.ident)),
        syn::UseTree::Glob(_) => leaf(None, None),
    }
}

fn as_use(item: &syn::Item) -> Option<&syn::ItemUse> {
    match item {
        syn::Item::Use(it) => Some(it),
        _ => None,
    }
}

/// The root of the package that code calls `name`.
fn package(name: &str) -> Option<PathBuf> {
    let folder = PACKAGES
        .iter()
        .find(|it| it.split('-').eq(name.split('_')))?;
    Some(root().join(folder).join("src/lib.rs"))
}

fn items(file: &Path) -> Vec<syn::Item> {
    let text =
        fs::read_to_string(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let parsed = syn::parse_file(&text);
    parsed
        .unwrap_or_else(|error| panic!("{}: {error}", file.display()))
        .items
}

fn is_public(item: &syn::Item) -> bool {
    let (visibility, attributes) = match item {
        syn::Item::Const(it) => (&it.vis, &it.attrs),
        syn::Item::Enum(it) => (&it.vis, &it.attrs),
        syn::Item::Fn(it) => (&it.vis, &it.attrs),
        syn::Item::Mod(it) => (&it.vis, &it.attrs),
        syn::Item::Static(it) => (&it.vis, &it.attrs),
        syn::Item::Struct(it) => (&it.vis, &it.attrs),
        syn::Item::Trait(it) => (&it.vis, &it.attrs),
        syn::Item::Type(it) => (&it.vis, &it.attrs),
        syn::Item::Union(it) => (&it.vis, &it.attrs),
        syn::Item::Use(it) => (&it.vis, &it.attrs),
        syn::Item::Macro(it) => {
            return it.attrs.iter().any(|it| it.path().is_ident("macro_export"));
        }
        _ => return false,
    };
    matches!(visibility, syn::Visibility::Public(_)) && !is_test(attributes)
}

fn name_of(item: &syn::Item) -> Option<&syn::Ident> {
    match item {
        syn::Item::Const(it) => Some(&it.ident),
        syn::Item::Enum(it) => Some(&it.ident),
        syn::Item::Fn(it) => Some(&it.sig.ident),
        syn::Item::Macro(it) => it.ident.as_ref(),
        syn::Item::Static(it) => Some(&it.ident),
        syn::Item::Struct(it) => Some(&it.ident),
        syn::Item::Trait(it) => Some(&it.ident),
        syn::Item::Type(it) => Some(&it.ident),
        syn::Item::Union(it) => Some(&it.ident),
        _ => None,
    }
}

/// Everything that users of the crate at `file` can name.
fn offered(file: &Path) -> BTreeSet<String> {
    let mut offered = BTreeSet::new();
    Module::root(file).offer("", &mut offered);
    offered
}

#[test]
fn the_library_offers_what_is_listed() {
    let offered = offered(&root().join(LIBRARY));
    let text = fs::read_to_string(root().join(LIST)).unwrap();
    let listed: BTreeSet<String> = text
        .lines()
        .filter(|line| !line.is_empty() && !line.starts_with('#'))
        .map(str::to_owned)
        .collect();
    let promised = listed.iter().filter(|it| !it.starts_with("for_tests::"));
    let promised = promised.count();
    assert!(
        promised <= PROMISED_MAX,
        "{promised} names are promised, at most {PROMISED_MAX} should be"
    );
    let more: Vec<_> = offered.difference(&listed).collect();
    let fewer: Vec<_> = listed.difference(&offered).collect();
    assert!(
        more.is_empty() && fewer.is_empty(),
        "{LIBRARY} offers, and {LIST} does not have: {more:#?}\n\
         Keep it `pub(crate)` when only this package uses it. When a program of somebody else's has to \
         write the name, add it to the list.\n\
         {LIST} has, and {LIBRARY} does not offer: {fewer:#?}\n\
         Take it off the list, and say in CHANGELOG.md what users write instead."
    );
}

/// The files of the library that name something of the command.
fn names_the_command(imports: &Imports) -> BTreeSet<String> {
    let is_of_it = |module: &[String]| module.first().is_some_and(|it| it == "program");
    let offences = imports
        .each()
        .filter(|(from, to)| !from.is_empty() && !is_of_it(from) && is_of_it(to));
    offences.map(|(from, _)| from.join("::")).collect()
}

#[test]
fn the_library_knows_nothing_of_the_command() {
    let imports = Imports::of(&root().join(LIBRARY));
    let there = imports.each().any(|(from, _)| from == ["program"]);
    assert!(
        there,
        "there is no command: the rule would hold for nothing"
    );
    let offences = names_the_command(&imports);
    assert!(
        offences.is_empty(),
        "what the command has in `program/` is not compiled without it: {offences:?}"
    );
}

/// A crate of these files in a folder made for the occasion.
fn made_of(files: &[(&str, &str)]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        fs::write(folder.path().join(name), text).unwrap();
    }
    let file = folder.path().join("lib.rs");
    (folder, file)
}

#[test]
fn a_name_is_found_whatever_the_way_it_is_offered() {
    let text = "mod a; pub mod b { pub fn f() {} fn g() {} }
                pub use a::{One, Two as Deux, deep}; pub use a::deep as other; pub use a::all::*;
                pub(crate) use a::Hidden; #[cfg(test)] pub use a::Tested; pub use machine::records;";
    let a = "pub struct One; pub struct Two; pub struct Hidden; pub struct Tested;
             pub mod deep { pub use super::One as Uno; pub const C: u8 = 1; mod d {} }
             pub mod all { pub use super::deep::{self as deeper, C}; pub trait T {} }";
    let (_folder, file) = made_of(&[("lib.rs", text), ("a.rs", a)]);
    let (of_records, own): (Vec<_>, Vec<_>) =
        (offered(&file).into_iter()).partition(|it| it.starts_with("records::"));
    let expected = [
        "C",
        "Deux",
        "One",
        "T",
        "b::f",
        "deep::C",
        "deep::Uno",
        "deeper::C",
        "deeper::Uno",
        "other::C",
        "other::Uno",
    ];
    assert_eq!(own, expected);
    assert!(of_records.contains(&"records::Lease".to_owned()));
}

#[test]
fn whoever_names_the_command_is_seen_whatever_the_way_to_it() {
    for (code, is_seen) in [
        ("fn f() { crate::program::main(); }", true),
        ("use super::program as other;", true),
        ("use crate::main;", true),
        ("use crate::b::program;", false),
    ] {
        let text = "mod a; mod b; mod program; pub use program::main;";
        let files = [
            ("lib.rs", text),
            ("a.rs", code),
            ("b.rs", "pub mod program {}"),
            ("program.rs", "use crate::a; pub fn main() {}"),
        ];
        let (_folder, file) = made_of(&files);
        let seen = names_the_command(&Imports::of(&file));
        assert_eq!(!seen.is_empty(), is_seen, "{code}: {seen:?}");
    }
}
