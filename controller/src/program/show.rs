//! Stored calibrations on the screen: what each kind of content shows of one, and of two.

use machine::records::{Content, Store};
use serde_json::Value;

use super::controls::dcc::Certifiable;
use crate::Failure;

/// Lines for people, and values for programs.
pub(crate) type Changes = (Vec<String>, Vec<Value>);

/// What is shown of a content.
pub(crate) trait Show: Content {
    /// It, in lines.
    fn lines(&self) -> String;

    /// What is otherwise in `after`; `None` for what is not compared.
    fn changes(&self, after: &Self) -> Option<Changes>;

    /// What both look like, for a page; nothing where there is nothing to draw.
    fn drawn(&self, _after: &Self) -> String {
        String::new()
    }

    /// What a certificate says of `axis`.
    ///
    /// # Errors
    /// When it certifies nothing, as what detectors of a machine read, or an uncertainty is not known.
    fn certifiable(&self, _axis: &str) -> Result<Certifiable, Failure> {
        Err(Failure::Usage {
            what: format!(
                "--format dcc: a record of the kind {} says what detectors of this machine read, which certifies nothing",
                Self::KIND
            ),
            help: "export the calibration that it counts from; `cal list` names all, `cal show --json` prints this one"
                .into(),
        })
    }
}

/// A stored calibration in lines, and as it lies in its file.
type One = fn(&Store, &str) -> Result<(String, Value), Failure>;
/// What is otherwise in the second; `None` for what is not compared.
type Two = fn(&Store, &str, &str) -> Result<Option<Changes>, Failure>;
/// What two look like.
type Drawn = fn(&Store, &str, &str) -> Result<String, Failure>;
/// What a certificate says of one.
type Certified = fn(&Store, &str) -> Result<Certifiable, Failure>;

/// A kind of content that can be shown.
#[derive(Clone, Copy)]
pub(crate) struct Shown {
    pub(crate) kind: &'static str,
    pub(crate) one: One,
    pub(crate) two: Two,
    pub(crate) drawn: Drawn,
    pub(crate) certifiable: Certified,
}

impl Shown {
    pub(crate) const fn of<C: Show>() -> Self {
        Self {
            kind: C::KIND,
            one: one::<C>,
            two: two::<C>,
            drawn: drawn::<C>,
            certifiable: certifiable::<C>,
        }
    }
}

fn one<C: Show>(store: &Store, id: &str) -> Result<(String, Value), Failure> {
    let record = store.load::<C>(id)?;
    let value = serde_json::to_value(&record).expect("plain data always serialises");
    Ok((record.content.lines(), value))
}

fn two<C: Show>(store: &Store, before: &str, after: &str) -> Result<Option<Changes>, Failure> {
    let (before, after) = (store.load::<C>(before)?, store.load::<C>(after)?);
    Ok(before.content.changes(&after.content))
}

fn drawn<C: Show>(store: &Store, before: &str, after: &str) -> Result<String, Failure> {
    let (before, after) = (store.load::<C>(before)?, store.load::<C>(after)?);
    Ok(before.content.drawn(&after.content))
}

fn certifiable<C: Show>(store: &Store, id: &str) -> Result<Certifiable, Failure> {
    let record = store.load::<C>(id)?;
    record.content.certifiable(&record.head.axis)
}
