//! The pictures of a page by themselves, for slides and papers.

use super::COLOURS_LIGHT;

/// A picture and what its file is called.
pub(crate) struct Picture {
    pub(crate) file: String,
    pub(crate) svg: String,
}

/// Fonts by a name that every program knows.
const FONT: &str = "sans-serif";

/// Every picture of the page `html`, with a size, a white ground and colours of its own: dark on light.
pub(crate) fn pictures(html: &str) -> Vec<Picture> {
    let each = html.split("<svg ").skip(1);
    let each = each.filter_map(|it| it.split_once("</svg>"));
    (1..)
        .zip(each)
        .filter_map(|(number, (svg, _))| picture(number, svg))
        .collect()
}

/// `svg` is what stands between its tags, and the rest of the first one.
fn picture(number: usize, svg: &str) -> Option<Picture> {
    let (_, rest) = svg.split_once("viewBox=\"0 0 ")?;
    let (size, rest) = rest.split_once('"')?;
    let (width, height) = size.split_once(' ')?;
    let (_, title) = rest.split_once("<title>")?;
    let (title, _) = title.split_once("</title>")?;
    let (_, drawn) = svg.split_once('>')?;
    Some(Picture {
        file: format!("{number:02}-{}.svg", file_name(title)),
        svg: format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {size}\" width=\"{width}\" height=\"{height}\" \
             font-family=\"{FONT}\"><rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>{}</svg>\n",
            coloured(drawn)
        ),
    })
}

/// With colours in place of their names: programs that are no browsers know no variables, and would draw all of it black.
fn coloured(drawn: &str) -> String {
    let colours = COLOURS_LIGHT.split(';').filter_map(|it| it.split_once(':'));
    colours.fold(drawn.to_owned(), |drawn, (name, colour)| {
        drawn.replace(&format!("var({name})"), colour)
    })
}

/// Letters and digits of a title; all else becomes a hyphen.
fn file_name(title: &str) -> String {
    let each = title.split(|it: char| !it.is_ascii_alphanumeric());
    let words: Vec<_> = each.filter(|it| !it.is_empty()).collect();
    words.join("-").to_lowercase()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::program::page::chart::{BLUE, Mark, Series, chart};
    use crate::program::page::document;

    #[test]
    fn each_picture_of_a_page_stands_by_itself() {
        let series = [Series::new(
            "seen",
            BLUE,
            Mark::Dots,
            vec![(0.0, 1.0), (1.0, 2.0)],
        )];
        let svg = |title: &str| chart(title, ("x", "y"), &series, None);
        let html = document("both", &(svg("Error < table") + &svg("Drift, 2nd day")), "");
        let all = pictures(&html);
        let files: Vec<_> = all.iter().map(|it| it.file.as_str()).collect();
        assert_eq!(files, ["01-error-lt-table.svg", "02-drift-2nd-day.svg"]);
        for it in &all {
            // Of the page's style sheet nothing is left to be known.
            assert!(
                !it.svg.contains("var(") && it.svg.contains("xmlns"),
                "{}",
                it.svg
            );
            assert!(it.svg.contains("fill=\"#0b66c3\"") && it.svg.contains("fill=\"#fff\""));
            assert_eq!(it.svg.matches("<svg").count(), 1);
            assert_eq!(it.svg.matches("<circle").count(), 2);
        }
    }
}
