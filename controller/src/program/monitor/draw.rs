//! A picture of what is known, for 80 columns and 24 lines and whatever is larger.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style, Stylize as _};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Cell, Paragraph, Row, Table};
use serde_json::Value;

use super::board::Board;
use super::words::one_line;

/// Of the newest runs.
const RUNS_SHOWN: usize = 4;
/// Inside the brackets of a bar.
const CELLS: u64 = 20;

/// Name, state, position, its expanded uncertainty, correction, target, who uses it: 79 columns with what is between.
const WIDTHS: [Constraint; 7] = [
    Constraint::Length(5),
    Constraint::Length(18),
    Constraint::Length(12),
    Constraint::Length(8),
    Constraint::Length(8),
    Constraint::Length(12),
    Constraint::Length(10),
];

/// How things that matter look. Without colours (`NO_COLOR`) they are bold.
#[derive(Clone, Copy, Debug)]
pub(super) struct Looks {
    bad: Style,
    good: Style,
}

impl Looks {
    pub(super) fn new(colours: bool) -> Self {
        let bold = Style::new().bold();
        match colours {
            true => Self {
                bad: bold.fg(Color::Red),
                good: Style::new().fg(Color::Green),
            },
            false => Self {
                bad: bold.add_modifier(Modifier::REVERSED),
                good: Style::new(),
            },
        }
    }
}

fn text(value: &Value) -> String {
    one_line(value.as_str().unwrap_or_default())
}

pub(super) fn draw(frame: &mut Frame<'_>, board: &Board, looks: Looks) {
    let lines = |count: usize| Constraint::Length(u16::try_from(count).unwrap_or(u16::MAX));
    let runs = board.runs.len().min(RUNS_SHOWN);
    let [head, axes, of_runs, events, keys] = Layout::vertical([
        lines(2),
        lines(2 + board.axes.len()),
        lines(if runs == 0 { 0 } else { runs + 1 }),
        Constraint::Min(1),
        lines(1),
    ])
    .areas(frame.area());
    frame.render_widget(Paragraph::new(head_lines(board, looks)), head);
    draw_axes(frame, axes, board, looks);
    let shown = board
        .runs_in_order()
        .take(runs)
        .map(|it| run_line(it, looks));
    frame.render_widget(Paragraph::new(shown.collect::<Vec<_>>()), of_runs);
    let happened = board.events.iter().map(|it| Line::raw(it.as_str()));
    frame.render_widget(Paragraph::new(happened.collect::<Vec<_>>()), events);
    // What stops the machine comes first: it is in view whatever else is said.
    let mut foot = Line::raw("Esc: STOP   S: quick stop, drives off   q: leave").reversed();
    if !board.answer.is_empty() {
        foot.push_span(Span::styled(format!("  {}", board.answer), looks.bad));
    }
    frame.render_widget(Paragraph::new(foot), keys);
}

/// Who it is and what it does; below it what is wrong, or who commands.
fn head_lines(board: &Board, looks: Looks) -> Vec<Line<'static>> {
    let machine = &board.machine;
    let state = text(&machine["state"]);
    let looks_of_state = match state.as_str() {
        "running" => looks.good,
        _ => looks.bad,
    };
    let mut first = Line::from(format!(
        "{} {}  ",
        text(&machine["name"]),
        text(&machine["stage_serial"])
    ))
    .bold();
    first.push_span(Span::styled(state.replace('_', " "), looks_of_state));
    let second = if let Some(why) = board.why_old() {
        let why = one_line(&why);
        Line::styled(
            format!("NOTHING IS HEARD, all below is old: {why}"),
            looks.bad,
        )
    } else if let Some(cause) = machine["cause"]["cause"].as_str() {
        Line::styled(one_line(cause), looks.bad)
    } else if let Some(name) = machine["lease"]["name"].as_str() {
        Line::raw(format!("{} commands it", one_line(name)))
    } else {
        Line::raw(board.at.clone())
    };
    vec![first, second]
}

fn draw_axes(frame: &mut Frame<'_>, area: Rect, board: &Board, looks: Looks) {
    let right = |it: &str| Cell::from(Line::raw(it.to_owned()).right_aligned());
    let head = Row::new([
        Cell::from("axis"),
        Cell::from("state"),
        right("mm"),
        right("±µm k=2"),
        right("corr µm"),
        right("target mm"),
        Cell::from("used by"),
    ]);
    let rows = board.axes.iter().map(|it| axis_row(it, looks));
    let table = Table::new(rows, WIDTHS)
        .header(head.underlined())
        .column_spacing(1);
    frame.render_widget(table, area);
}

fn axis_row(axis: &Value, looks: Looks) -> Row<'static> {
    // Of an axis that turns, in degrees and arcseconds.
    let turns = axis["encoder"]["unit"] == "deg";
    let (small, [whole, part]) = match turns {
        true => (3600.0, ["°", "″"]),
        false => (1e3, ["", ""]),
    };
    let number = |value: Option<f64>, digits: usize, unit: &str| {
        let shown = value.map_or_else(|| "-".to_owned(), |it| format!("{it:.digits$}{unit}"));
        Cell::from(Line::raw(shown).right_aligned())
    };
    let of = |name: &str| axis[name]["value"].as_f64();
    let (position, encoder) = (of("position"), of("encoder"));
    let corrected = axis["corrected"] == true;
    let correction = position
        .zip(encoder)
        .filter(|_| corrected)
        .map(|(point, drive)| (point - drive) * small);
    let state = text(&axis["state"]);
    let looks_of_state = match state.as_str() {
        "ErrorStop" => looks.bad,
        "Disabled" | "Standstill" => Style::new(),
        _ => looks.good,
    };
    let user = match (axis["used_by"].as_str(), axis["homed"] == true) {
        (None, false) => Cell::from("NOT ZEROED").style(looks.bad),
        _ => Cell::from(text(&axis["used_by"])),
    };
    Row::new([
        Cell::from(text(&axis["name"])),
        Cell::from(state).style(looks_of_state),
        number(position.or(encoder), 6, whole),
        number(of("standard_uncertainty").map(|it| 2.0 * it), 3, part),
        number(correction, 3, part),
        number(of("target"), 6, whole),
        user,
    ])
}

fn run_line(run: &Value, looks: Looks) -> Line<'static> {
    let axes: Vec<String> = run["axes"]
        .as_array()
        .into_iter()
        .flatten()
        .map(text)
        .collect();
    let name = format!(
        "{} {} {}",
        text(&run["id"]),
        text(&run["kind"]),
        axes.join(" ")
    );
    let state = text(&run["state"]);
    let looks_of_state = match state.as_str() {
        "failed" | "timed_out" => looks.bad,
        "running" => looks.good,
        _ => Style::new(),
    };
    let asks = run["question"]["text"].as_str();
    let detail = match (state.as_str(), run["steps"].as_u64().unwrap_or_default()) {
        ("running", _) if asks.is_some() => format!("ASKS: {}", one_line(asks.unwrap_or_default())),
        ("running", steps) if steps > 0 => bar(
            run["steps_done"].as_u64().unwrap_or_default(),
            steps,
            &text(&run["stage"]),
        ),
        _ => text(&run["cause"]["cause"]),
    };
    let mut line = Line::raw(format!("{name:<24} "));
    line.push_span(Span::styled(format!("{state:<9}"), looks_of_state));
    line.push_span(detail);
    line
}

fn bar(done: u64, steps: u64, stage: &str) -> String {
    let filled = (done.min(steps) * CELLS / steps) as usize;
    let (full, width) = ("#".repeat(filled), CELLS as usize);
    format!("[{full:<width$}] {done} of {steps} {stage}")
}

#[cfg(test)]
mod tests {
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;
    use serde_json::json;

    use super::*;
    use crate::program::monitor::feed::Heard;

    fn picture(board: &Board, columns: u16, lines: u16) -> Vec<String> {
        let mut terminal = Terminal::new(TestBackend::new(columns, lines)).unwrap();
        terminal
            .draw(|frame| draw(frame, board, Looks::new(false)))
            .unwrap();
        let cells = terminal.backend().buffer().content().chunks(columns.into());
        let line = |it: &[ratatui::buffer::Cell]| {
            it.iter()
                .map(ratatui::buffer::Cell::symbol)
                .collect::<String>()
        };
        cells.map(|it| line(it).trim_end().to_owned()).collect()
    }

    fn board() -> Board {
        let mm = |value: f64| json!({"value": value, "unit": "mm"});
        let mut board = Board::new("unix:truestage.sock");
        board.hear(Heard::Machine(
            json!({"name": "linear", "stage_serial": "TS-1", "state": "running"}),
        ));
        board.hear(Heard::Axes(json!([
            {"name": "x", "state": "SynchronizedMotion", "position": mm(-1012.3457), "encoder": mm(-1012.3467),
             "corrected": true, "standard_uncertainty": {"value": 0.1234, "unit": "um"}, "target": mm(-1012.5),
             "homed": true, "used_by": "m12-345"},
            {"name": "y", "state": "Disabled", "encoder": mm(1.0), "corrected": false, "homed": false},
        ])));
        board.hear(Heard::Runs(
            json!([{"id": "r1-1", "kind": "calibrate", "axes": ["x"], "state": "running",
                                       "stage": "runs", "steps_done": 42, "steps": 84}]),
        ));
        let event = json!({"at": "2026-03-01T08:00:01.123Z", "kind": "stop", "of": "", "data": {"by": "anna\u{7}", "mode": "quick"}});
        board.hear(Heard::Event(event));
        board
    }

    #[test]
    fn all_of_it_is_readable_in_80_columns_and_24_lines() {
        let lines = picture(&board(), 80, 24);
        assert_eq!(
            lines[..10],
            [
                "linear TS-1  running",
                "unix:truestage.sock",
                "axis  state                        mm  ±µm k=2  corr µm    target mm used by",
                "x     SynchronizedMotion -1012.345700    0.247    1.000 -1012.500000 m12-345",
                "y     Disabled               1.000000        -        -            - NOT ZEROED",
                "",
                "r1-1 calibrate x         running  [##########          ] 42 of 84 runs",
                "",
                "08:00:01.123 stop quick by anna",
                "",
            ]
        );
        assert!(lines[23].contains("STOP"), "{lines:?}");
    }

    #[test]
    fn what_is_wrong_stands_below_the_name_and_stop_stays_on_a_small_terminal() {
        let mut board = board();
        board.hear(Heard::Machine(
            json!({"name": "linear", "state": "error_stop", "cause": {"cause": "x: \u{1b}fault"}}),
        ));
        assert_eq!(
            picture(&board, 80, 24)[..2],
            ["linear   error stop", "x: fault"]
        );
        board.hear(Heard::Ended);
        assert_eq!(
            picture(&board, 80, 24)[1],
            "NOTHING IS HEARD, all below is old: the service has ended"
        );
        assert!(picture(&board, 40, 8)[7].starts_with("Esc: STOP"));
    }
}
