//! Motions.

use axum::Json;
use axum::extract::State as Of;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::IntoResponse;

use super::super::guard::{Arrived, Asks, Body, By, Named, Waits, has_key, key_of};
use super::super::state::State;
use super::{MaybeQuery, Wait, keep_lease, obey, obey_since, query};
use crate::desk::named;
use crate::ledger::Noted;
use crate::order::Order;
use crate::problem::{Code, Problem, ProblemBody};
use crate::request::{JogRequest, MoveRequest};
use crate::view::MotionView;

/// The motions under way, and the last that ended.
#[utoipa::path(
    get, path = "/motions", tag = "motions",
    responses((status = 200, description = "Motions, the oldest first", body = Vec<MotionView>))
)]
pub(super) async fn motions(Of(state): Of<State>) -> Json<Vec<MotionView>> {
    Json(state.desk.motions())
}

/// Begins a motion. With an Idempotency-Key the same request never moves twice, not even after a restart.
#[utoipa::path(
    post, path = "/motions", tag = "motions", request_body = MoveRequest,
    params(Asks, ("Idempotency-Key" = Option<String>, Header, description = "A key of the client's own for this motion: visible ASCII", min_length = 1, max_length = 256, pattern = "^[!-~]*$")),
    responses(
        (status = 201, description = "It was accepted", body = MotionView, headers(("Location" = String, description = "Where it is asked for"))),
        (status = 200, description = "It was accepted before, with this key", body = MotionView),
        (status = "4XX", description = "Refused; nothing was moved", body = ProblemBody, content_type = "application/problem+json"),
        (status = "5XX", description = "The service", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn begin(
    Of(state): Of<State>,
    By(caller): By,
    Arrived(arrival): Arrived,
    headers: HeaderMap,
    Body(request): Body<MoveRequest>,
) -> Result<impl IntoResponse, Problem> {
    let key = key_of(&headers)?;
    let noting = {
        let (desk, caller, request) = (state.desk.clone(), caller.clone(), request.clone());
        // It waits for the disk: others are served meanwhile.
        tokio::task::spawn_blocking(move || desk.note_motion(&caller, &request, key.as_deref()))
    };
    let noted = noting
        .await
        .map_err(|it| Problem::new(Code::Storage, it.to_string(), ""))??;
    let (status, id) = match noted {
        (_, Noted::Before(id)) => (StatusCode::OK, id),
        (id, Noted::New) => {
            let order = Order::Move {
                id: id.clone(),
                request,
            };
            let answered = obey_since(arrival, &state.desk, &caller, order).await;
            let answered = answered.map(|_| ());
            (StatusCode::CREATED, state.desk.settle_motion(id, answered)?)
        }
    };
    let view = state.desk.motion(&id)?;
    let location = [(header::LOCATION, format!("/v1/motions/{id}"))];
    Ok((status, location, Json(view)))
}

/// A motion, once it has ended or the time to wait is over.
#[utoipa::path(
    get, path = "/motions/{id}", tag = "motions", params(("id" = String, Path, description = "Its name"), Wait, Waits),
    responses(
        (status = 200, description = "The motion", body = MotionView),
        (status = "4XX", description = "There is none", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn motion(
    Of(state): Of<State>,
    By(caller): By,
    Named(id): Named,
    wait: MaybeQuery<Wait>,
) -> Result<Json<MotionView>, Problem> {
    let asked = query(wait)?.until(
        || keep_lease(&state.desk, &caller),
        || state.desk.motion(&id),
    );
    Ok(Json(asked.await?))
}

/// Begins a jog, renews it, or ends it with a speed of 0. Ask again within 200 ms, or the axis stops; it stops at
/// the soft limit as well.
#[utoipa::path(
    post, path = "/jog", tag = "motions", request_body = JogRequest, params(Asks),
    responses(
        (status = 200, description = "The motion that it is", body = MotionView),
        (status = "4XX", description = "Refused; nothing was moved", body = ProblemBody, content_type = "application/problem+json"),
        (status = "5XX", description = "The service", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn jog(
    Of(state): Of<State>,
    By(caller): By,
    Arrived(arrival): Arrived,
    headers: HeaderMap,
    Body(request): Body<JogRequest>,
) -> Result<Json<MotionView>, Problem> {
    if has_key(&headers) {
        let what = "a jog has no Idempotency-Key: the same request again renews it";
        return Err(Problem::new(Code::BadRequest, what, "leave it out"));
    }
    let order = state.desk.jog_order(&request);
    let id = named(obey_since(arrival, &state.desk, &caller, order).await?)?;
    Ok(Json(state.desk.motion(&id)?))
}

/// The dead-man of a motion still holds.
#[utoipa::path(
    post, path = "/motions/{id}/renew", tag = "motions", params(Asks, ("id" = String, Path, description = "Its name")),
    responses(
        (status = 200, description = "Renewed", body = MotionView),
        (status = "4XX", description = "It is not under way", body = ProblemBody, content_type = "application/problem+json"),
        (status = "5XX", description = "The service", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn renew(
    Of(state): Of<State>,
    By(caller): By,
    Named(id): Named,
) -> Result<Json<MotionView>, Problem> {
    let order = Order::Renew { motion: id.clone() };
    obey(&state.desk, &caller, order).await?;
    Ok(Json(state.desk.motion(&id)?))
}
