//! A section that there may be several of.

use schemars::JsonSchema;
use serde::Deserialize;

/// One section, or a list of them.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
pub enum OneOrMore<T> {
    One(T),
    More(Vec<T>),
}

impl<T> Default for OneOrMore<T> {
    fn default() -> Self {
        Self::More(Vec::new())
    }
}

impl<T> OneOrMore<T> {
    /// All of them, in the order of the file.
    pub fn each(&self) -> &[T] {
        match self {
            Self::One(one) => core::slice::from_ref(one),
            Self::More(all) => all,
        }
    }

    /// Where number `at` stands below `section`.
    pub(crate) fn place(&self, section: &str, at: usize) -> String {
        match self {
            Self::One(_) => section.to_owned(),
            Self::More(_) => format!("{section}.{at}"),
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use crate::config::parse;
    use crate::config::validate::told;
    use crate::edit::{self, Edit};
    use crate::volumetric::VolumeAxisName;

    const ONE: &str = include_str!("../../../../configs/machines/volumetric.toml");

    /// The shipped configuration with roll detectors on each slide.
    pub(crate) fn with_three_rolls() -> String {
        edit::with_three_rolls(ONE)
    }

    #[test]
    fn each_slide_may_have_roll_detectors_and_one_section_is_still_read() {
        let rolls = |text: &str| {
            let config = parse(text, "m.toml")
                .unwrap_or_else(|it| panic!("{it}"))
                .config;
            let own = config.volumetric.unwrap();
            own.rolls().map(|it| it.map(|it| (it.axis, it.channels)))
        };
        use VolumeAxisName::{X, Y, Z};
        assert_eq!(rolls(ONE), [Some((X, [0, 1])), None, None]);
        let three = [Some((X, [0, 1])), Some((Y, [0, 1])), Some((Z, [2, 3]))];
        assert_eq!(rolls(&with_three_rolls()), three);
        let list_of_one = ONE.edit("[volumetric.roll]", "[[volumetric.roll]]");
        assert_eq!(rolls(&list_of_one), [Some((X, [0, 1])), None, None]);
        let hash = |text: &str| parse(text, "m.toml").unwrap().hash;
        assert_eq!(
            hash(ONE),
            hash(&list_of_one),
            "its calibrations are still its own"
        );
        assert_ne!(hash(ONE), hash(&with_three_rolls()));
    }

    /// The place in the list is in the finding.
    #[test]
    fn what_is_missing_or_twice_is_named_in_the_list_too() {
        let three = with_three_rolls();
        let check = |from: &str, to: &str, key: &str, says: &str| {
            told::check(&three, from, to, &format!("volumetric.roll.{key}"), says);
        };
        let z = "axis = \"z\"\nanalog = \"roll_more\"\n";
        check(z, "axis = \"z\"\n", "1", "`analog`");
        check(
            z,
            &z.edit("\"z\"", "\"x\""),
            "1.axis",
            "the roll of x is read twice",
        );
        let channels = "analog = \"roll_more\"\nchannels = [2, 3]";
        check(
            channels,
            &channels.edit("3]", "1]"),
            "2.channels",
            "another detector",
        );
        check(
            channels,
            &channels.edit("3]", "9]"),
            "1.channels",
            "has no 9",
        );
    }
}
