use super::*;
use crate::certificate::xml::parsed;

/// What a result with these lists says.
fn read(measurand: Measurand, lists: &str) -> Result<Option<Figures>, Unfit> {
    let text = format!(
        "<dcc:result xmlns:dcc=\"https://ptb.de/dcc\" xmlns:si=\"https://ptb.de/si\"><dcc:name><dcc:content>here\
         </dcc:content></dcc:name><dcc:data>{lists}</dcc:data></dcc:result>"
    );
    let document = parsed(&text)?;
    of_result(document.root_element(), measurand)
}

fn list(quantities: &[String]) -> String {
    format!("<dcc:list>{}</dcc:list>", quantities.concat())
}

/// A column in degrees Celsius.
fn column(role: &str, values: &str, u: &str) -> String {
    let u = match u {
        "" => String::new(),
        u => format!(
            "<si:standardMUXMLList><si:valueStandardMUXMLList>{u}</si:valueStandardMUXMLList>\
                      </si:standardMUXMLList>"
        ),
    };
    format!(
        "<dcc:quantity refType=\"basic_{role}\"><si:realListXMLList><si:valueXMLList>{values}</si:valueXMLList>\
         <si:unitXMLList>\\degreecelsius</si:unitXMLList>{u}</si:realListXMLList></dcc:quantity>"
    )
}

fn light(value: &str, unit: &str, u: &str) -> String {
    format!(
        "<dcc:quantity refType=\"basic_measuredValue\"><si:real><si:value>{value}</si:value><si:unit>{unit}</si:unit>\
         <si:standardMU><si:valueStandardMU>{u}</si:valueStandardMU></si:standardMU></si:real></dcc:quantity>"
    )
}

#[track_caller]
fn check(lists: &str, expected: &[[f64; 3]]) {
    let seen = read(Measurand::Temperature, lists).unwrap().unwrap();
    let Figures::Table(points) = seen else {
        panic!("{seen:?}")
    };
    assert_eq!(points.len(), expected.len(), "{points:?}");
    for (it, expected) in points.iter().zip(expected) {
        let seen = [it.reading, it.correction, it.u];
        let alike = seen
            .iter()
            .zip(expected)
            .all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(alike, "{seen:?} is not {expected:?}");
    }
}

#[track_caller]
fn refused(lists: &str, says: &str) {
    let unfit = read(Measurand::Temperature, lists).unwrap_err();
    assert!(unfit.cause.contains(says), "{}", unfit.cause);
}

fn table_of(readings: &str, errors: &str) -> Vec<String> {
    vec![
        column("measuredValue", readings, ""),
        column("measurementError", errors, "0.01"),
    ]
}

#[test]
fn two_channels_of_one_result_are_never_joined() {
    let (one, other) = (
        table_of("10 20", "0.1 0.2"),
        table_of("10.5 20.5", "0.3 0.4"),
    );
    check(&list(&one), &[[10.0, -0.1, 0.01], [20.0, -0.2, 0.01]]);
    let two = "its result `here` says 2 tables; which is meant?";
    refused(&(list(&one) + &list(&other)), two);
    refused(&list(&[list(&one), list(&other)]), two);
    refused(&list(&[one, other].concat()), two);
    // Of both the reference once.
    let (one, other) = ("10.1 20.1", "10.2 20.2");
    let measured = |it: &str| list(&[column("measuredValue", it, "0.01 0.01")]);
    let reference = column("referenceValue", "10 20", "");
    refused(&list(&[reference, measured(one), measured(other)]), two);
}

#[test]
fn rows_of_one_list_are_joined_and_those_of_two_are_not() {
    let rows = |rows: &[(&str, &str)]| {
        let each = rows.iter().map(|it| list(&table_of(it.0, it.1)));
        list(&each.collect::<Vec<_>>())
    };
    let before = rows(&[("20", "0.2"), ("10", "0.1")]);
    check(&before, &[[10.0, -0.1, 0.01], [20.0, -0.2, 0.01]]);
    let after = rows(&[("10.5", "0.0"), ("20.5", "0.0")]);
    refused(&(before + &after), "says 2 tables");
}

#[test]
fn columns_in_lists_of_their_own_are_one_table_and_a_nominal_value_counts_where_nothing_else_is() {
    let each = table_of("10 20", "0.1 0.2")
        .into_iter()
        .map(|it| list(&[it]));
    let expected = [[10.0, -0.1, 0.01], [20.0, -0.2, 0.01]];
    check(&each.collect::<String>(), &expected);
    let with = |role: &str| vec![column(role, "9.9 19.8", "")];
    let nominal = vec![column("nominalValue", "10 20", "")];
    let measured = vec![column("measuredValue", "10 20", "0.01 0.01")];
    check(
        &list(&[with("nominalValue"), measured.clone()].concat()),
        &expected,
    );
    check(
        &list(&[nominal, with("referenceValue"), measured].concat()),
        &expected,
    );
}

#[test]
fn the_uncertainty_is_that_of_the_correction_of_the_error_or_of_the_measured_values() {
    let all = |correction: &str, error: &str, measured: &str| {
        list(&[
            column("referenceValue", "10", "0.001"),
            column("measuredValue", "10.1", measured),
            column("measurementError", "0.1", error),
            column("correction", "-0.1", correction),
        ])
    };
    check(&all("0.02", "0.03", "0.04"), &[[10.1, -0.1, 0.02]]);
    check(&all("", "0.03", "0.04"), &[[10.1, -0.1, 0.03]]);
    let both = 0.04_f64.hypot(0.001);
    check(&all("", "", "0.04"), &[[10.1, -0.1, both]]);
    refused(&all("", "", ""), "states no uncertainty");
}

#[test]
fn a_laser_is_taken_in_metres_where_its_frequency_stands_beside() {
    let metres = light("632.991", "\\nano\\metre", "0.000001");
    let hertz = light("473.6127", "\\tera\\hertz", "0.1");
    for both in [[&metres, &hertz], [&hertz, &metres]] {
        let both = both.map(String::clone);
        let lists = [list(&both), both.map(|it| list(&[it])).concat()];
        for lists in lists {
            let Some(Figures::Value { value, u }) = read(Measurand::Wavelength, &lists).unwrap()
            else {
                panic!("no wavelength")
            };
            assert!((value - 632.991e-9).abs() < 1e-20, "{value}");
            assert!((u - 1e-15).abs() < 1e-24, "{u}");
        }
    }
}
