//! What strangers found who know the interface by its description alone: each refusal that it promises, and each
//! request that it allows.

use serde_json::{Value, json};
use service::Caller;

use crate::client::Client;
use crate::edge::on_a_stage;

const MOTIONS: &str = "POST /v1/motions HTTP/1.1";
const LEASE: &str = "POST /v1/lease HTTP/1.1";

#[test]
fn what_the_description_excludes_is_refused_as_a_problem() {
    on_a_stage(|_, http| {
        let long = format!(r#"{{"name": "{}"}}"#, "n".repeat(65));
        let spaced = format!("{MOTIONS}\r\nidempotency-key: a b");
        let cases = [
            ("POST /v1/jog HTTP/1.1", r#"["x", "1mm/s"]"#, 400),
            ("POST /v1/jog HTTP/1.1", r#" ["x", "1mm/s"]"#, 400),
            (
                MOTIONS,
                r#"{"targets": {"x": "1mm"}, "dead_man_ms": 49}"#,
                400,
            ),
            (
                MOTIONS,
                r#"{"targets": {"x": "1mm"}, "dead_man_ms": 60001}"#,
                400,
            ),
            (
                MOTIONS,
                r#"{"targets": {"x": "1mm"}, "dead_man_ms": 50.5}"#,
                400,
            ),
            (MOTIONS, r#"{"targets": {"x": " 1mm"}}"#, 400),
            (
                MOTIONS,
                r#"{"targets": {"x": {"value": 1, "unit": "0mm"}}}"#,
                400,
            ),
            (&*spaced, r#"{"targets": {"x": "1mm"}}"#, 400),
            (
                "POST /v1/runs HTTP/1.1\r\nidempotency-key: a b",
                r#"{"kind": "zero"}"#,
                400,
            ),
            // A dead-man is renewed by the same request again and again.
            (
                "POST /v1/jog HTTP/1.1\r\nidempotency-key: a",
                r#"{"axis": "x", "speed": "1mm/s"}"#,
                400,
            ),
            (LEASE, &*long, 400),
            (LEASE, r#"{"name": ""}"#, 400),
            (LEASE, r#"{"name": "anna", "seconds": 0}"#, 400),
            ("GET /v1/motions/m0-0?wait_s=-1e-12 HTTP/1.1", "", 400),
            ("GET /v1/motions/m0-0?wait_s=300.5 HTTP/1.1", "", 400),
            ("GET /v1/motions/m0-0?wait_s=NaN HTTP/1.1", "", 400),
            ("GET /v1/events?sample_ms=0 HTTP/1.1", "", 400),
            ("GET /v1/events?kinds=motion,zzz HTTP/1.1", "", 400),
            ("GET /v1/events?sample_ms=60001 HTTP/1.1", "", 400),
            ("GET /v1/axes/%ff HTTP/1.1", "", 400),
            ("POST /v1/calibrations/0123/activate HTTP/1.1", "", 404),
            (
                "POST /v1/calibrations/rollback HTTP/1.1",
                r#"{"axis": "x"}"#,
                404,
            ),
        ];
        for (head, body, status) in cases {
            let answer = http.ask(head, body.as_bytes());
            assert_eq!(answer.status, status, "{head} {body}: {answer:?}");
            let kind = "application/problem+json";
            assert!(answer.head.contains(kind), "{head}: {answer:?}");
            assert_eq!(answer.json()["status"], status, "{head}: {answer:?}");
        }
    });
}

#[test]
fn what_the_description_allows_is_not_refused_for_its_form() {
    on_a_stage(|_, http| {
        // Nobody has zeroed the axis: a request that is understood is refused for that.
        for body in [
            r#"{"targets": {"x": "+1.5e+0 mm"}, "speed": {"value": 1e-3, "unit": "m/s"}}"#,
            r#"{"targets": {"x": {"value": -1, "unit": "um"}}, "dead_man_ms": 60000.0}"#,
        ] {
            let answer = http.ask(MOTIONS, body.as_bytes());
            assert_eq!(answer.status, 409, "{body}: {answer:?}");
        }
        let answer = http.ask("POST /v1/stop HTTP/1.1", b"");
        assert_eq!(answer.status, 200, "{answer:?}");
    });
}

/// Nothing of such a name is left for people to read; the holder has one all the same.
#[test]
fn a_lease_under_a_name_that_nobody_can_read_is_by_whoever_asked() {
    on_a_stage(|_, http| {
        let body = json!({"name": "\u{1b}\u{7f}"}).to_string();
        let head = format!("{LEASE}\r\ntruestage-client: anna");
        let answer = http.ask(&head, body.as_bytes());
        assert_eq!(answer.status, 200, "{answer:?}");
        let lease = http.machine().lease.expect("somebody has it");
        assert_eq!(lease.name, "anna");
        let token = answer.json()["token"].as_str().map(str::to_owned);
        let anna = Caller {
            lease: token,
            ..Caller::named("anna")
        };
        http.release(&anna).unwrap();
    });
}

/// From a description that says less, a client is generated that leaves something out.
#[test]
fn the_description_says_where_each_parameter_stands_and_what_a_quantity_is() {
    let description = serde_json::to_value(service::openapi()).unwrap();
    let mut orders = 0;
    for (path, methods) in description["paths"].as_object().unwrap() {
        for (method, operation) in methods.as_object().unwrap() {
            let parameters = operation["parameters"].as_array();
            for parameter in parameters.into_iter().flatten() {
                check_parameter(path, parameter);
            }
            let has = |name: &str| {
                let mut parameters = parameters.into_iter().flatten();
                parameters.any(|parameter| parameter["name"] == name)
            };
            let is_order = method != "get";
            // A wait keeps its lease.
            let expected = is_order || has("wait_s");
            assert_eq!(has("Truestage-Lease"), expected, "{method} {path}");
            orders += u32::from(is_order);
        }
    }
    assert!(orders > 10, "{orders}");
    let schemas = &description["components"]["schemas"];
    for name in ["PlaceIn", "SpeedIn", "TravelSpeedIn"] {
        let [text, object] = &schemas[name]["oneOf"].as_array().unwrap()[..] else {
            panic!("{}", schemas[name]);
        };
        assert_eq!(text["type"], "string");
        assert!(text["pattern"].is_string(), "{text}");
        assert_eq!(object["required"], json!(["value", "unit"]));
        assert_eq!(object["additionalProperties"], false);
    }
    let result = &schemas["RunView"]["properties"]["result"];
    assert_eq!(result["type"], json!(["object", "null"]));
    let stop = &description["paths"]["/v1/stop"]["post"]["requestBody"];
    assert_eq!(stop["required"], false);
}

#[track_caller]
fn check_parameter(path: &str, parameter: &Value) {
    let name = parameter["name"].as_str().unwrap();
    let is_in_path = path.contains(&format!("{{{name}}}"));
    assert_eq!(parameter["in"] == "path", is_in_path, "{path}: {parameter}");
    // A parameter is left out; there is no null in an address.
    assert!(
        parameter["schema"]["type"].is_string(),
        "{path}: {parameter}"
    );
}
