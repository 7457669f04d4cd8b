//! Which calibrations are used from now on: what is chosen, and what in the store that changes.

use machine::records::{Store, StoreError};

use crate::failure::Failure;

/// What somebody wants to be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Choice {
    /// This calibration, by the beginning of its name.
    Activate(String),
    /// The one that was used before: of an axis, or of all that is called so and was made together.
    Rollback(String),
    /// None any more, under this name of the store: of what a machine does without.
    Clear(String),
}

impl Choice {
    /// What the store calls what it is about.
    pub(super) fn of(&self, store: &Store) -> Result<String, StoreError> {
        match self {
            Self::Activate(beginning) => {
                let id = store.resolve(beginning)?;
                Ok(store.glance(&id)?.head.axis)
            }
            Self::Rollback(name) | Self::Clear(name) => Ok(name.clone()),
        }
    }
}

/// What is used under one name of the store from now on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    /// What the store calls it: an axis, or what a kind keeps besides.
    pub pointer: String,
    /// The calibration; `None`: none.
    pub id: Option<String>,
    /// Whether it is the one that was used before the one in use.
    pub is_earlier: bool,
}

impl Change {
    /// Uses `id`, which is gone back to where it was used before.
    ///
    /// # Errors
    /// When the pointer cannot be read.
    pub(crate) fn to(store: &Store, pointer: &str, id: String) -> Result<Self, StoreError> {
        let used = store.active(pointer)?;
        Ok(Self {
            pointer: pointer.to_owned(),
            is_earlier: used.history.last() == Some(&id),
            id: Some(id),
        })
    }

    /// Uses nothing any more.
    pub(crate) fn to_nothing(pointer: &str) -> Self {
        Self {
            pointer: pointer.to_owned(),
            id: None,
            is_earlier: false,
        }
    }

    fn back(store: &Store, pointer: &str) -> Result<Self, StoreError> {
        Ok(Self {
            pointer: pointer.to_owned(),
            id: Some(store.earlier(pointer)?),
            is_earlier: true,
        })
    }
}

/// What `choice` itself changes of what is used under these `pointers`.
///
/// # Errors
/// When there is no such calibration, or none before.
pub(super) fn chosen_among(
    pointers: &[String],
    store: &Store,
    choice: &Choice,
) -> Result<Vec<Change>, StoreError> {
    match choice {
        Choice::Activate(beginning) => {
            let id = store.resolve(beginning)?;
            let pointer = store.glance(&id)?.head.axis;
            Ok(vec![Change {
                pointer,
                id: Some(id),
                is_earlier: false,
            }])
        }
        Choice::Clear(name) => Ok(vec![Change::to_nothing(name)]),
        Choice::Rollback(name) if pointers.contains(name) => Ok(vec![Change::back(store, name)?]),
        // All of them, or none.
        Choice::Rollback(_) => {
            let all = pointers.iter().map(|it| Change::back(store, it));
            all.collect()
        }
    }
}

/// Asks of each calibration that is used from now on, by its pointer and its name, whether it can be.
///
/// # Errors
/// Those of `usable`, at the first that cannot.
pub(crate) fn each_usable(
    changes: &[Change],
    mut usable: impl FnMut(&str, &str) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let mut used = changes.iter();
    used.try_for_each(|change| match &change.id {
        Some(id) => usable(&change.pointer, id),
        None => Ok(()),
    })
}

/// Writes what is used from now on; all of it was read and can be used.
///
/// # Errors
/// When a pointer cannot be written.
pub(crate) fn write(store: &Store, changes: &[Change]) -> Result<(), StoreError> {
    for Change {
        pointer,
        id,
        is_earlier,
    } in changes
    {
        match (id, is_earlier) {
            (Some(_), true) => drop(store.rollback(pointer)?),
            (Some(id), false) => store.activate(pointer, id)?,
            (None, _) => drop(store.put_out_of_use(pointer)?),
        }
    }
    Ok(())
}
