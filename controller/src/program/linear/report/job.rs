//! What a job reached, on the page of its run.

use core::fmt::Write as _;

use units::{Metres, Short};

use crate::linear::{JobEntry, LinearLog, ReachedEntry, WentOnEntry};
use crate::program::page::escape;

/// Each point as often as it was reached, and what made the job go on.
pub(super) fn html(job: &JobEntry, log: &LinearLog) -> String {
    let mut html = format!(
        "<h2>Job</h2><p>{} of {} points reached</p><table><tr><th>point</th><th>repetition</th>\
         <th>target (mm)</th><th>at (mm)</th><th>U, k = 2 (µm)</th><th>interval (mm)</th>\
         <th>went on</th><th>waited (s)</th></tr>",
        log.reached.len(),
        job.names.len() * job.repetitions as usize
    );
    for it in &log.reached {
        let own = |on: &&WentOnEntry| (on.repetition, on.number) == (it.repetition, it.number);
        html += &row(job, it, log.went_on.iter().find(own));
    }
    html + "</table>"
}

fn row(job: &JobEntry, it: &ReachedEntry, on: Option<&WentOnEntry>) -> String {
    let mut html = String::new();
    let name = job.names.get(it.number - 1).map_or("", String::as_str);
    let u = it.expanded_u_m;
    let u = u.map_or("NOT STATED".to_owned(), |u| {
        format!("{:.3}", Metres(u).um())
    });
    let interval = it.interval_m.map_or("beyond".to_owned(), |it| {
        let [from, to] = it.map(|it| Short(Metres(it).mm()).to_string());
        format!("{from} to {to}")
    });
    let (by, waited) = on.map_or(("", String::new()), |on| {
        (on.by.as_str(), format!("{:.2}", on.waited_s))
    });
    let _ = write!(
        html,
        "<tr><td>{}</td><td>{}</td><td>{:.6}</td><td>{:.6}</td><td>{u}</td><td>{interval}</td>\
         <td>{}</td><td>{waited}</td></tr>",
        escape(name),
        it.repetition,
        Metres(it.target_m).mm(),
        Metres(it.place_m.unwrap_or(it.encoder_m)).mm(),
        escape(by)
    );
    html
}
