//! Numbers with unit and uncertainty, as D-SI writes them.

use roxmltree::Node;

use super::unit::Unit;
use super::xml::{SI, at, child, children, text};
use super::{Unfit, unfit};

/// The values of one quantity, in SI units (temperatures in degrees Celsius).
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Values {
    pub(super) unit: Unit,
    /// As they were written.
    numbers: Vec<f64>,
    /// Their standard uncertainties, as they were written; none where none are stated.
    u: Vec<f64>,
}

impl Values {
    pub(super) fn len(&self) -> usize {
        self.numbers.len()
    }

    /// The values themselves.
    pub(super) fn values(&self) -> Vec<f64> {
        self.numbers.iter().map(|it| self.unit.value(*it)).collect()
    }

    /// The values, which are differences.
    pub(super) fn differences(&self) -> Vec<f64> {
        let each = self.numbers.iter();
        each.map(|it| self.unit.difference(*it)).collect()
    }

    /// Their standard uncertainties; `None` where none are stated.
    pub(super) fn u(&self) -> Option<Vec<f64>> {
        let each = self.u.iter().map(|it| self.unit.difference(*it));
        (!self.u.is_empty()).then(|| each.collect())
    }

    /// These and `more` of the same unit.
    pub(super) fn joined(mut self, more: Self) -> Result<Self, Unfit> {
        let is_alike = self.unit == more.unit && self.u.is_empty() == more.u.is_empty();
        if !is_alike {
            return unfit(
                "the values of one column differ in unit, or only some have an uncertainty",
                "ask the laboratory for a certificate with one unit for each column",
            );
        }
        self.numbers.extend(more.numbers);
        self.u.extend(more.u);
        Ok(self)
    }
}

/// What a `dcc:quantity` says: one entry for each unit that it is stated in and that is known here.
///
/// # Errors
/// When a number cannot be read, or counts do not agree.
pub(super) fn of_quantity(quantity: Node<'_, '_>) -> Result<Vec<Values>, Unfit> {
    let mut found = Vec::new();
    for it in quantity.children() {
        match it.tag_name().name() {
            "hybrid" if it.tag_name().namespace() == Some(SI) => {
                for own in it.children() {
                    found.extend(of_element(own)?);
                }
            }
            _ => found.extend(of_element(it)?),
        }
    }
    Ok(found)
}

fn of_element(node: Node<'_, '_>) -> Result<Option<Values>, Unfit> {
    if node.tag_name().namespace() != Some(SI) {
        return Ok(None);
    }
    let suffix = match node.tag_name().name() {
        "real" | "constant" => "",
        "realListXMLList" => "XMLList",
        _ => return Ok(None),
    };
    let units = own_text(node, "unit", suffix).unwrap_or_default();
    let mut names: Vec<&str> = units.split_whitespace().collect();
    names.dedup();
    let [name] = names.as_slice() else {
        return match names.as_slice() {
            [] => unfit("a quantity has no unit", "ask the laboratory for it"),
            _ => Ok(None),
        };
    };
    let Some(unit) = Unit::named(name) else {
        return Ok(None);
    };
    let numbers = numbers(&own_text(node, "value", suffix).unwrap_or_default())?;
    let u = uncertainties(node, suffix)?;
    let u = spread(u, numbers.len(), "uncertainties")?;
    Ok(Some(Values { unit, numbers, u }))
}

/// What stands in the child `name` with that suffix.
fn own_text(node: Node<'_, '_>, name: &str, suffix: &str) -> Option<String> {
    let wanted = format!("{name}{suffix}");
    let own = node
        .children()
        .find(|it| it.has_tag_name((SI, wanted.as_str())));
    own.map(text)
}

fn numbers(text: &str) -> Result<Vec<f64>, Unfit> {
    let each = text.split_whitespace().map(|it| {
        let number: Option<f64> = it.parse().ok();
        // `inf` and `infinity` are words of Rust's, not of D-SI's; NaN says that there is no value.
        number.filter(|it| it.is_finite()).map_or_else(
            || {
                unfit(
                    format!("`{it}` is no number"),
                    "ask the laboratory for the value",
                )
            },
            Ok,
        )
    });
    each.collect()
}

/// One for each of `count`: those that there are, or one for all.
fn spread(list: Vec<f64>, count: usize, what: &str) -> Result<Vec<f64>, Unfit> {
    match list.as_slice() {
        [] => Ok(list),
        [one] => Ok(vec![*one; count]),
        all if all.len() == count => Ok(list),
        all => unfit(
            format!("{} {what} are stated for {count} values", all.len()),
            "ask the laboratory for one for each value",
        ),
    }
}

/// Standard uncertainties as they stand there; expanded ones divided by their coverage factor.
fn uncertainties(node: Node<'_, '_>, suffix: &'static str) -> Result<Vec<f64>, Unfit> {
    let is_list = !suffix.is_empty();
    let pick = |single: &'static str, list: &'static str| if is_list { list } else { single };
    let univariate = child(
        node,
        SI,
        pick(
            "measurementUncertaintyUnivariate",
            "measurementUncertaintyUnivariateXMLList",
        ),
    );
    let below = univariate.unwrap_or(node);
    let standard: [&[&'static str]; 4] = if is_list {
        [
            &["standardMUXMLList", "valueStandardMUXMLList"],
            &["coverageIntervalMUXMLList", "valueStandardMUXMLList"],
            &["coverageIntervalXMLList", "standardUncXMLList"],
            &["valueStandardMUXMLList"],
        ]
    } else {
        [
            &["standardMU", "valueStandardMU"],
            &["coverageIntervalMU", "valueStandardMU"],
            &["coverageInterval", "standardUnc"],
            &["valueStandardMU"],
        ]
    };
    if let Some(own) = standard.iter().find_map(|path| at(below, SI, path)) {
        return not_negative(numbers(&text(own))?);
    }
    let expanded = [
        (
            pick("expandedMU", "expandedMUXMLList"),
            pick("valueExpandedMU", "valueExpandedMUXMLList"),
        ),
        (
            pick("expandedUnc", "expandedUncXMLList"),
            pick("uncertainty", "uncertaintyXMLList"),
        ),
    ];
    let own = expanded.iter().find_map(|(outer, inner)| {
        let outer = child(below, SI, outer)?;
        Some((outer, child(outer, SI, inner)?))
    });
    let Some((outer, inner)) = own else {
        return Ok(Vec::new());
    };
    let expanded = not_negative(numbers(&text(inner))?)?;
    let factor = child(outer, SI, pick("coverageFactor", "coverageFactorXMLList"));
    let factor = numbers(&factor.map(text).unwrap_or_default())?;
    if factor.is_empty() || factor.iter().any(|it| *it < 1.0) {
        return unfit(
            "an expanded uncertainty has no coverage factor of 1 or more",
            "ask the laboratory for k: without it nobody knows the standard uncertainty",
        );
    }
    let factor = spread(factor, expanded.len(), "coverage factors")?;
    Ok(expanded.iter().zip(&factor).map(|(it, k)| it / k).collect())
}

fn not_negative(list: Vec<f64>) -> Result<Vec<f64>, Unfit> {
    match list.iter().find(|it| **it < 0.0) {
        Some(it) => unfit(
            format!("an uncertainty is {it}, which cannot be"),
            "ask the laboratory for the value",
        ),
        None => Ok(list),
    }
}

/// All quantities below `node` that state what was found: not those of conditions and methods.
pub(super) fn quantities<'a, 'i: 'a>(node: Node<'a, 'i>) -> Vec<Node<'a, 'i>> {
    use super::xml::DCC;
    let mut found: Vec<_> = children(node, DCC, "quantity").collect();
    for list in children(node, DCC, "list") {
        found.extend(quantities(list));
    }
    found
}
