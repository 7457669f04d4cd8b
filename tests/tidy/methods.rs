//! How much one type can do. A machine consists of parts, and what only one part does is a method of
//! that part.

use crate::imports::is_test;
use crate::sources;

/// How many methods `Machine` has, in `machine` and in `controller`. It only goes down: whoever takes one
/// away lowers it.
const METHODS_OF_MACHINE: [(&str, usize); 2] = [("machine", 61), ("controller", 13)];

/// The methods of every `impl Machine` in a file, those of traits left out.
fn methods_of_machine(text: &str) -> Vec<String> {
    let file = syn::parse_file(text).expect("what compiles can be read");
    methods_in(&file.items)
}

fn methods_in(items: &[syn::Item]) -> Vec<String> {
    let mut found = Vec::new();
    for item in items {
        match item {
            syn::Item::Impl(it) if it.trait_.is_none() && is_machine(&it.self_ty) => {
                found.extend(it.items.iter().filter_map(name_of_method));
            }
            syn::Item::Mod(it) if !is_test(&it.attrs) => {
                let below = it.content.as_ref().map(|(_, items)| methods_in(items));
                found.extend(below.unwrap_or_default());
            }
            _ => {}
        }
    }
    found
}

fn is_machine(of: &syn::Type) -> bool {
    matches!(of, syn::Type::Path(it) if it.path.segments.last().is_some_and(|it| it.ident == "Machine"))
}

fn name_of_method(item: &syn::ImplItem) -> Option<String> {
    match item {
        syn::ImplItem::Fn(it) => Some(it.sig.ident.to_string()),
        _ => None,
    }
}

#[test]
fn the_machine_gets_no_more_methods() {
    for (package, expected) in METHODS_OF_MACHINE {
        let files = sources(&format!("{package}/src"));
        let found: Vec<_> = files
            .iter()
            .flat_map(|(name, text)| {
                let methods = methods_of_machine(text).into_iter();
                methods.map(move |method| format!("{name}: {method}"))
            })
            .collect();
        assert_eq!(
            found.len(),
            expected,
            "more: let one of its parts have them; fewer: lower the number in this test\n{}",
            found.join("\n")
        );
    }
}

#[test]
fn methods_of_a_machine_are_counted_wherever_they_stand() {
    let text = "impl Machine { pub fn a(&self) {} const B: u8 = 1; fn c() {} }
                impl crate::machine::Machine { fn d(&self) {} }
                impl Deref for Machine { fn deref(&self) {} }
                impl Machines { fn e(&self) {} }
                mod f { impl super::Machine { fn g(&self) {} } }
                #[cfg(test)] mod tests { impl super::Machine { fn h(&self) {} } }";
    assert_eq!(methods_of_machine(text), ["a", "c", "d", "g"]);
}
