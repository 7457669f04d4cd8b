//! Runs.

use axum::Json;
use axum::extract::State as Of;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::IntoResponse;
use serde::Deserialize;
use utoipa::IntoParams;

use super::super::guard::{Arrived, Asks, Body, By, Named, Waits, key_of};
use super::super::identity::Admitted;
use super::super::needs::{enough, of_run};
use super::super::state::State;
use super::{MaybeQuery, Wait, keep_lease, obey, obey_since, query};
use crate::desk::Prepared;
use crate::order::Order;
use crate::problem::{Code, Problem, ProblemBody};
use crate::request::{AnswerRequest, RunRequest};
use crate::view::RunView;

/// The runs that are known.
#[utoipa::path(
    get, path = "/runs", tag = "runs",
    responses((status = 200, description = "Runs, the oldest first", body = Vec<RunView>))
)]
pub(super) async fn runs(Of(state): Of<State>) -> Json<Vec<RunView>> {
    Json(state.desk.runs())
}

/// Plans a run, and starts it when `start` says so. With an Idempotency-Key the same request never makes two runs, not even
/// after a restart.
#[utoipa::path(
    post, path = "/runs", tag = "runs", request_body = RunRequest,
    params(Asks, ("Idempotency-Key" = Option<String>, Header, description = "A key of the client's own for this run: visible ASCII", min_length = 1, max_length = 256, pattern = "^[!-~]*$")),
    responses(
        (status = 201, description = "Planned, or started", body = RunView, headers(("Location" = String, description = "Where it is asked for"))),
        (status = 200, description = "It was asked for before, with this key", body = RunView),
        (status = "4XX", description = "Refused; nothing was moved", body = ProblemBody, content_type = "application/problem+json"),
        (status = "5XX", description = "The service", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn plan(
    Of(state): Of<State>,
    By(caller): By,
    Arrived(arrival): Arrived,
    admitted: Admitted,
    headers: HeaderMap,
    Body(request): Body<RunRequest>,
) -> Result<impl IntoResponse, Problem> {
    enough(admitted.role, of_run(request.kind))?;
    let key = key_of(&headers)?;
    let preparing = {
        let (desk, caller, key) = (state.desk.clone(), caller.clone(), key.clone());
        // Long paths take seconds, and disks their time: others are served meanwhile.
        tokio::task::spawn_blocking(move || desk.prepare_run(&caller, &request, key.as_deref()))
    };
    let prepared = preparing.await;
    let prepared = prepared.map_err(|it| Problem::new(Code::Busy, it.to_string(), ""))??;
    let (status, id) = match prepared {
        Prepared::Before(id) => (StatusCode::OK, id),
        Prepared::New(id, order) => {
            let planned = obey_since(arrival, &state.desk, &caller, *order).await;
            let planned = planned.map(|_| ());
            let id = state.desk.settle_run(id, key.as_deref(), planned)?;
            (StatusCode::CREATED, id)
        }
    };
    let location = [(header::LOCATION, format!("/v1/runs/{id}"))];
    Ok((status, location, Json(state.desk.run(&id)?)))
}

/// How long an answer may be held back, and what of it is known.
#[derive(Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub(super) struct Looked {
    /// Seconds to wait for the end; 300 at most. At once when left out.
    #[param(minimum = 0, maximum = 300)]
    wait_s: Option<f64>,
    /// So many of its `reached` points were heard before, and are left out.
    #[param(minimum = 0, maximum = 1000000000)]
    heard: Option<u64>,
}

/// No run reaches more points.
const HEARD_MAX: u64 = 1_000_000_000;

impl Looked {
    /// So many points are left out.
    fn left_out(&self) -> Result<usize, Problem> {
        let heard = self.heard.unwrap_or_default();
        let few = usize::try_from(heard).ok().filter(|_| heard <= HEARD_MAX);
        few.ok_or_else(|| {
            let what = format!("heard = {heard} is more than any run has points");
            let help = format!("give a number from 0 to {HEARD_MAX}");
            Problem::new(Code::BadRequest, what, help)
        })
    }
}

/// A run, once it has ended or the time to wait is over.
#[utoipa::path(
    get, path = "/runs/{id}", tag = "runs", params(("id" = String, Path, description = "Its name"), Looked, Waits),
    responses(
        (status = 200, description = "The run", body = RunView),
        (status = "4XX", description = "There is none", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn run(
    Of(state): Of<State>,
    By(caller): By,
    Named(id): Named,
    looked: MaybeQuery<Looked>,
) -> Result<Json<RunView>, Problem> {
    let looked = query(looked)?;
    let (left_out, wait_s) = (looked.left_out()?, looked.wait_s);
    let asked = Wait { wait_s }.until(|| keep_lease(&state.desk, &caller), || state.desk.run(&id));
    let mut run = asked.await?;
    run.reached.drain(..left_out.min(run.reached.len()));
    Ok(Json(run))
}

/// Begins a planned run.
#[utoipa::path(
    post, path = "/runs/{id}/start", tag = "runs", params(Asks, ("id" = String, Path, description = "Its name")),
    responses(
        (status = 200, description = "It begins", body = RunView),
        (status = "4XX", description = "Refused", body = ProblemBody, content_type = "application/problem+json"),
        (status = "5XX", description = "The service", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn start(
    Of(state): Of<State>,
    By(caller): By,
    Arrived(arrival): Arrived,
    admitted: Admitted,
    Named(id): Named,
) -> Result<Json<RunView>, Problem> {
    enough(admitted.role, of_run(state.desk.run(&id)?.kind))?;
    state.desk.require_storage()?;
    let order = Order::Start { run: id.clone() };
    obey_since(arrival, &state.desk, &caller, order).await?;
    Ok(Json(state.desk.run(&id)?))
}

/// Ends a run: its axes slow down, and what was measured is kept.
#[utoipa::path(
    post, path = "/runs/{id}/abort", tag = "runs", params(Asks, ("id" = String, Path, description = "Its name")),
    responses(
        (status = 200, description = "It ends", body = RunView),
        (status = "4XX", description = "There is none", body = ProblemBody, content_type = "application/problem+json"),
        (status = "5XX", description = "The service", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn abort(
    Of(state): Of<State>,
    By(caller): By,
    Named(id): Named,
) -> Result<Json<RunView>, Problem> {
    obey(&state.desk, &caller, Order::Abort { run: id.clone() }).await?;
    Ok(Json(state.desk.run(&id)?))
}

/// Lets a run end where it is, to go on later: its axes slow down and are free.
#[utoipa::path(
    post, path = "/runs/{id}/pause", tag = "runs", params(Asks, ("id" = String, Path, description = "Its name")),
    responses(
        (status = 200, description = "It is paused when its axes stand", body = RunView),
        (status = "4XX", description = "It is not under way, or cannot go on where it is left", body = ProblemBody, content_type = "application/problem+json"),
        (status = "5XX", description = "The service", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn pause(
    Of(state): Of<State>,
    By(caller): By,
    Named(id): Named,
) -> Result<Json<RunView>, Problem> {
    obey(&state.desk, &caller, Order::Pause { run: id.clone() }).await?;
    Ok(Json(state.desk.run(&id)?))
}

/// A run that was paused or stopped, has failed or timed out goes on with what its journal has (`can_resume`); so does one
/// that an earlier service or program left.
#[utoipa::path(
    post, path = "/runs/{id}/resume", tag = "runs", params(Asks, ("id" = String, Path, description = "Its name")),
    responses(
        (status = 200, description = "It goes on", body = RunView),
        (status = "4XX", description = "It cannot go on, or its axis is in use or has no zero", body = ProblemBody, content_type = "application/problem+json"),
        (status = "5XX", description = "The service", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn resume(
    Of(state): Of<State>,
    By(caller): By,
    Arrived(arrival): Arrived,
    admitted: Admitted,
    Named(id): Named,
) -> Result<Json<RunView>, Problem> {
    enough(admitted.role, of_run(state.desk.run(&id)?.kind))?;
    state.desk.require_storage()?;
    let order = Order::Resume { run: id.clone() };
    obey_since(arrival, &state.desk, &caller, order).await?;
    Ok(Json(state.desk.run(&id)?))
}

/// Answers what a run asks: it goes on.
#[utoipa::path(
    post, path = "/runs/{id}/answers", tag = "runs", request_body = AnswerRequest, params(Asks, ("id" = String, Path, description = "Its name")),
    responses(
        (status = 200, description = "It is answered", body = RunView),
        (status = "4XX", description = "It asks nothing, or something else, or is not answered so", body = ProblemBody, content_type = "application/problem+json"),
        (status = "5XX", description = "The service", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn answer(
    Of(state): Of<State>,
    By(caller): By,
    Arrived(arrival): Arrived,
    admitted: Admitted,
    Named(id): Named,
    Body(answer): Body<AnswerRequest>,
) -> Result<Json<RunView>, Problem> {
    // What is read becomes part of what the run finds.
    let text = enough(admitted.role, of_run(state.desk.run(&id)?.kind));
    let order = Order::Answer {
        run: id.clone(),
        answer,
        text,
    };
    obey_since(arrival, &state.desk, &caller, order).await?;
    Ok(Json(state.desk.run(&id)?))
}
