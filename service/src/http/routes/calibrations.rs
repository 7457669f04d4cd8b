//! Calibrations.

use axum::Json;
use axum::extract::State as Of;
use serde::Deserialize;
use truestage::runs::Choice;
use utoipa::ToSchema;

use super::super::guard::{Asks, Body, By, Named, plain};
use super::super::state::State;
use super::journals::from_disk;
use super::obey;
use crate::desk::Desk;
use crate::order::Order;
use crate::problem::{Problem, ProblemBody};
use crate::request::Caller;
use crate::view::{CalibrationView, ChosenView};

/// The calibrations that are stored, the oldest first.
#[utoipa::path(
    get, path = "/calibrations", tag = "calibrations",
    responses(
        (status = 200, description = "All that can be read", body = Vec<CalibrationView>),
        (status = "5XX", description = "The disk", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn calibrations(
    Of(state): Of<State>,
) -> Result<Json<Vec<CalibrationView>>, Problem> {
    from_disk(state, Desk::calibrations).await.map(Json)
}

/// Uses a calibration from now on. Nothing moves; the next motion is corrected by it.
#[utoipa::path(
    post, path = "/calibrations/{id}/activate", tag = "calibrations",
    params(Asks, ("id" = String, Path, description = "Its name, or the beginning of it")),
    responses(
        (status = 200, description = "What is used now, and by which axes", body = ChosenView),
        (status = "4XX", description = "Refused; the one before is used still", body = ProblemBody, content_type = "application/problem+json"),
        (status = "5XX", description = "The service", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn activate(
    Of(state): Of<State>,
    By(caller): By,
    Named(id): Named,
) -> Result<Json<ChosenView>, Problem> {
    choose(&state.desk, &caller, Choice::Activate(id)).await
}

/// What goes back.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RollbackRequest {
    /// An axis, or `platform` or `volume`; of three axes also `volume-references`, `volume-first-memory` or
    /// `volume-second-memory`.
    axis: String,
}

/// Uses what was used before. Nothing moves.
#[utoipa::path(
    post, path = "/calibrations/rollback", tag = "calibrations", request_body = RollbackRequest, params(Asks),
    responses(
        (status = 200, description = "What is used now, and by which axes", body = ChosenView),
        (status = "4XX", description = "Refused; the one before is used still", body = ProblemBody, content_type = "application/problem+json"),
        (status = "5XX", description = "The service", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn rollback(
    Of(state): Of<State>,
    By(caller): By,
    Body(request): Body<RollbackRequest>,
) -> Result<Json<ChosenView>, Problem> {
    choose(&state.desk, &caller, Choice::Rollback(plain(&request.axis))).await
}

/// What is forgotten.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ClearRequest {
    /// `volume-first-memory` or `volume-second-memory`.
    axis: String,
}

/// Uses a state memory of three axes no longer. What counted from it stays in use, and nothing is corrected until that is
/// recorded again or cleared, too: `warning` says so. Nothing moves.
#[utoipa::path(
    post, path = "/calibrations/clear", tag = "calibrations", request_body = ClearRequest, params(Asks),
    responses(
        (status = 200, description = "What is used now, and by which axes", body = ChosenView),
        (status = "4XX", description = "Refused; what was used is used still", body = ProblemBody, content_type = "application/problem+json"),
        (status = "5XX", description = "The service", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn clear(
    Of(state): Of<State>,
    By(caller): By,
    Body(request): Body<ClearRequest>,
) -> Result<Json<ChosenView>, Problem> {
    choose(&state.desk, &caller, Choice::Clear(plain(&request.axis))).await
}

async fn choose(desk: &Desk, caller: &Caller, choice: Choice) -> Result<Json<ChosenView>, Problem> {
    let answer = obey(desk, caller, Order::Calibration(choice)).await?;
    desk.chosen(answer).map(Json)
}
