//! Calibrations.

use axum::Json;
use axum::extract::State as Of;
use serde::Deserialize;
use utoipa::ToSchema;

use super::super::guard::{Asks, Body, By, Named, plain};
use super::super::state::State;
use super::journals::from_disk;
use super::obey;
use crate::desk::{Desk, named};
use crate::order::{Choice, Order};
use crate::problem::{Problem, ProblemBody};
use crate::request::Caller;
use crate::view::{AxisView, CalibrationView};

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
        (status = 200, description = "Its axis, which uses it", body = AxisView),
        (status = "4XX", description = "Refused; the one before is used still", body = ProblemBody, content_type = "application/problem+json"),
        (status = "5XX", description = "The service", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn activate(
    Of(state): Of<State>,
    By(caller): By,
    Named(id): Named,
) -> Result<Json<AxisView>, Problem> {
    choose(&state.desk, &caller, Choice::Activate(id)).await
}

/// Which axis goes back.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RollbackRequest {
    /// Its name.
    axis: String,
}

/// Uses the calibration that an axis used before. Nothing moves.
#[utoipa::path(
    post, path = "/calibrations/rollback", tag = "calibrations", request_body = RollbackRequest, params(Asks),
    responses(
        (status = 200, description = "The axis, which uses the earlier one", body = AxisView),
        (status = "4XX", description = "Refused; the one before is used still", body = ProblemBody, content_type = "application/problem+json"),
        (status = "5XX", description = "The service", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn rollback(
    Of(state): Of<State>,
    By(caller): By,
    Body(request): Body<RollbackRequest>,
) -> Result<Json<AxisView>, Problem> {
    choose(&state.desk, &caller, Choice::Rollback(plain(&request.axis))).await
}

async fn choose(desk: &Desk, caller: &Caller, choice: Choice) -> Result<Json<AxisView>, Problem> {
    let axis = named(obey(desk, caller, Order::Calibration(choice)).await?)?;
    Ok(Json(desk.axis(&axis)?))
}
