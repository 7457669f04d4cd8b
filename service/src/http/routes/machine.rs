//! The machine as a whole, and its axes.

use axum::body::Bytes;
use axum::extract::State as Of;
use axum::{Extension, Json};
use serde::Serialize;
use utoipa::ToSchema;

use super::super::guard::{Arrived, Asks, Body, By, Known, NAME_MAX, Named, Unheard, plain};
use super::super::state::State;
use super::journals::from_disk;
use super::stops::{StopDone, StopRequest, understood};
use super::{obey, obey_at_last, obey_since};
use crate::desk::Desk;
use crate::order::{Answer, Order};
use crate::problem::{Code, Problem, ProblemBody};
use crate::request::{LeaseRequest, StopMode};
use crate::view::{AxisView, Leased, MachineView};

/// The machine.
#[utoipa::path(
    get, path = "/machine", tag = "machine",
    responses((status = 200, description = "The machine", body = MachineView))
)]
pub(super) async fn machine(Of(state): Of<State>) -> Json<MachineView> {
    Json(state.desk.machine())
}

/// Its axes.
#[utoipa::path(
    get, path = "/axes", tag = "machine",
    responses((status = 200, description = "All axes", body = Vec<AxisView>))
)]
pub(super) async fn axes(Of(state): Of<State>) -> Json<Vec<AxisView>> {
    Json(state.desk.axes())
}

/// One axis.
#[utoipa::path(
    get, path = "/axes/{axis}", tag = "machine", params(("axis" = String, Path, description = "Its name")),
    responses(
        (status = 200, description = "The axis", body = AxisView),
        (status = "4XX", description = "There is none", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn axis(
    Of(state): Of<State>,
    Named(axis): Named,
) -> Result<Json<AxisView>, Problem> {
    Ok(Json(state.desk.axis(&axis)?))
}

/// Switches an axis on.
#[utoipa::path(
    post, path = "/axes/{axis}/enable", tag = "machine", params(Asks, ("axis" = String, Path, description = "Its name")),
    responses(
        (status = 200, description = "It is on", body = AxisView),
        (status = "4XX", description = "Refused", body = ProblemBody, content_type = "application/problem+json"),
        (status = "5XX", description = "The drive, or the service", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn enable(
    Of(state): Of<State>,
    By(caller): By,
    Arrived(arrival): Arrived,
    Named(axis): Named,
) -> Result<Json<AxisView>, Problem> {
    let order = Order::Power {
        axis: axis.clone(),
        on: true,
    };
    obey_since(arrival, &state.desk, &caller, order).await?;
    Ok(Json(state.desk.axis(&axis)?))
}

/// Switches an axis off.
#[utoipa::path(
    post, path = "/axes/{axis}/disable", tag = "machine", params(Asks, ("axis" = String, Path, description = "Its name")),
    responses(
        (status = 200, description = "It is off", body = AxisView),
        (status = "4XX", description = "Refused", body = ProblemBody, content_type = "application/problem+json"),
        (status = "5XX", description = "The drive, or the service", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn disable(
    Of(state): Of<State>,
    By(caller): By,
    Arrived(arrival): Arrived,
    Named(axis): Named,
) -> Result<Json<AxisView>, Problem> {
    let order = Order::Power {
        axis: axis.clone(),
        on: false,
    };
    obey_since(arrival, &state.desk, &caller, order).await?;
    Ok(Json(state.desk.axis(&axis)?))
}

/// That it was done.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct Done {
    /// Always true.
    done: bool,
}

const DONE: Json<Done> = Json(Done { done: true });

/// Stops everything. Taken from anybody, whoever has the lease, and whatever the body says: where the mode is not understood,
/// axes slow down, and `warning` says why.
#[utoipa::path(
    post, path = "/stop", tag = "machine", request_body(content = StopRequest, description = "May be left out"), params(Asks),
    responses(
        (status = 200, description = "The stop is under way; motions and runs say when it has ended", body = StopDone),
        (status = "4XX", description = "Not let in", body = ProblemBody, content_type = "application/problem+json"),
        (status = "5XX", description = "The service", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn stop(
    Of(state): Of<State>,
    By(caller): By,
    unheard: Option<Extension<Unheard>>,
    said: Bytes,
) -> Result<Json<StopDone>, Problem> {
    let (mode, warning) = match unheard {
        Some(Extension(Unheard(problem))) => (StopMode::default(), Some(problem.detail())),
        None => understood(&said),
    };
    obey_at_last(&state.desk, &caller, Order::Stop { mode }).await?;
    let warning = warning.map(|it| format!("stopped ({}), and not understood: {it}", mode.word()));
    Ok(Json(StopDone {
        done: true,
        warning,
    }))
}

/// The machine after a reset.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct ResetDone {
    #[serde(flatten)]
    machine: MachineView,
    /// That the machine's file has changed since the service read it, and is not used before the service is restarted.
    #[serde(skip_serializing_if = "Option::is_none")]
    warning: Option<String>,
}

/// Starts the machine anew after a failure, and acknowledges each fault once. Axes must be zeroed again, but those whose drives prove that they kept their zero.
#[utoipa::path(
    post, path = "/reset", tag = "machine", params(Asks),
    responses(
        (status = 200, description = "It runs", body = ResetDone),
        (status = "4XX", description = "Refused", body = ProblemBody, content_type = "application/problem+json"),
        (status = "5XX", description = "A cause is still there", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn reset(
    Of(state): Of<State>,
    By(caller): By,
    Arrived(arrival): Arrived,
) -> Result<Json<ResetDone>, Problem> {
    obey_since(arrival, &state.desk, &caller, Order::Reset).await?;
    let looking = from_disk(state.clone(), move |desk| Ok(desk.config_change(&caller)));
    Ok(Json(ResetDone {
        // The reset is done, whatever the disk says.
        warning: looking.await.ok().flatten(),
        machine: state.desk.machine(),
    }))
}

/// Asks for the right to command, or renews it with the header `Truestage-Lease`.
#[utoipa::path(
    post, path = "/lease", tag = "machine", request_body = LeaseRequest, params(Asks),
    responses(
        (status = 200, description = "The lease; its token goes with every order, in `Truestage-Lease`", body = Leased),
        (status = "4XX", description = "Somebody else has it", body = ProblemBody, content_type = "application/problem+json"),
        (status = "5XX", description = "The service", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn lease(
    Of(state): Of<State>,
    By(caller): By,
    known: Known,
    Body(mut request): Body<LeaseRequest>,
) -> Result<Json<Leased>, Problem> {
    let length = request.name.chars().count();
    if !(1..=NAME_MAX).contains(&length) || !(1..=3600).contains(&request.seconds) {
        let what = format!(
            "a lease of {} s by a name of {length} characters; expected 1 to 3600 s and 1 to {NAME_MAX} characters",
            request.seconds
        );
        return Err(Problem::new(Code::BadRequest, what, ""));
    }
    // Who that is, whatever he calls himself; where nothing is left of it, as he is called otherwise.
    request.name = match plain(&request.name).is_empty() {
        true => caller.name.clone(),
        false => known.called(&request.name),
    };
    let order = Desk::lease_order(&request)?;
    match obey(&state.desk, &caller, order).await? {
        Answer::Leased(leased) => Ok(Json(leased)),
        Answer::Done | Answer::Named(_) | Answer::Chosen(..) => {
            Err(Problem::new(Code::Ending, "the service ends", ""))
        }
    }
}

/// Gives the lease back.
#[utoipa::path(
    delete, path = "/lease", tag = "machine", params(Asks),
    responses(
        (status = 200, description = "Nobody has it", body = Done),
        (status = "4XX", description = "Somebody else has it", body = ProblemBody, content_type = "application/problem+json"),
        (status = "5XX", description = "The service", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn release(Of(state): Of<State>, By(caller): By) -> Result<Json<Done>, Problem> {
    obey(&state.desk, &caller, Order::Release).await?;
    Ok(DONE)
}

/// Accepts that part of the ledger could not be read at the start: requests with a key are taken again. Those that stood there
/// would move again.
#[utoipa::path(
    post, path = "/ledger/accept", tag = "service", params(Asks),
    responses(
        (status = 200, description = "It is accepted, also when nothing was damaged", body = Done),
        (status = "4XX", description = "Not let in", body = ProblemBody, content_type = "application/problem+json"),
        (status = "5XX", description = "It cannot be written", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn accept_ledger(
    Of(state): Of<State>,
    By(caller): By,
) -> Result<Json<Done>, Problem> {
    from_disk(state, move |desk| desk.accept_damaged_ledger(&caller)).await?;
    Ok(DONE)
}
