//! What the kinds of machine remember beyond what drives say, without knowing the kinds.

use core::any::{Any, TypeId};
use std::collections::BTreeMap;

/// What a kind remembers of a machine, or of one of its axes.
pub(crate) trait Memory: Any {
    /// The machine is started: nothing that was known of where things are holds any more.
    fn forget(&mut self) {}

    /// Every axis was stopped, wherever it was: a move that had begun did not end.
    fn interrupted_before_it_ends(&mut self) {}
}

/// The memories of all kinds, each by its type and the name of what it is of.
#[derive(Default)]
pub(crate) struct Memories(BTreeMap<(TypeId, String), Box<dyn Memory>>);

impl Memories {
    /// What is remembered of `name`.
    pub(crate) fn get<M: Memory>(&self, name: &str) -> Option<&M> {
        let memory: &dyn Any = &**self.0.get(&key::<M>(name))?;
        memory.downcast_ref()
    }

    /// What is remembered of `name`; at first what `fresh` says.
    pub(crate) fn of<M: Memory>(&mut self, name: &str, fresh: impl FnOnce() -> M) -> &mut M {
        let memory = self.0.entry(key::<M>(name));
        let memory: &mut dyn Any = &mut **memory.or_insert_with(|| Box::new(fresh()));
        memory.downcast_mut().expect("its type is in its key")
    }

    /// What is remembered of two of them, at once.
    pub(crate) fn both<M: Memory + Default>(&mut self, names: [&str; 2]) -> [&mut M; 2] {
        let keys = names.map(key::<M>);
        for key in &keys {
            self.0
                .entry(key.clone())
                .or_insert_with(|| Box::new(M::default()));
        }
        let mut found = [None, None];
        for (key, memory) in &mut self.0 {
            if let Some(at) = keys.iter().position(|it| it == key) {
                let memory: &mut dyn Any = &mut **memory;
                found[at] = memory.downcast_mut();
            }
        }
        found.map(|it| it.expect("each is there, its type is in its key, and their names differ"))
    }

    pub(crate) fn each(&mut self) -> impl Iterator<Item = &mut Box<dyn Memory>> {
        self.0.values_mut()
    }
}

fn key<M: Memory>(name: &str) -> (TypeId, String) {
    (TypeId::of::<M>(), name.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Default, PartialEq)]
    struct Place(u8);

    #[derive(Debug, Default, PartialEq)]
    struct Tables(u8);

    impl Memory for Place {
        fn forget(&mut self) {
            self.0 = 0;
        }
    }

    impl Memory for Tables {}

    #[test]
    fn two_kinds_remember_what_is_theirs_of_one_axis() {
        let mut memories = Memories::default();
        assert_eq!(memories.get::<Place>("x"), None);
        memories.of("x", Place::default).0 = 3;
        memories.of("x", || Tables(7));
        assert_eq!(memories.of("x", || Place(9)), &Place(3), "it was there");
        assert_eq!(memories.get("y"), None::<&Place>);
        let [second, first] = memories.both::<Place>(["y", "x"]);
        assert_eq!((&*first, &*second), (&Place(3), &Place(0)));
        second.0 = 5;
        assert_eq!(memories.get("y"), Some(&Place(5)));
        memories.each().for_each(|it| it.forget());
        assert_eq!(memories.get("x"), Some(&Place(0)));
        assert_eq!(memories.get("x"), Some(&Tables(7)));
    }
}
