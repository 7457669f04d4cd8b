//! The resources.

mod calibrations;
mod journals;
mod machine;
mod motions;
mod runs;
mod secured;
mod stops;

use core::time::Duration;

use axum::http::Uri;
use axum::middleware::from_fn_with_state;
use axum::routing::get;
use axum::{Json, Router};
use serde::{Deserialize, Serialize};
use utoipa::openapi::schema::{Schema, SchemaType, Type};
use utoipa::openapi::{OpenApi, RefOr, Required};
use utoipa::{IntoParams, OpenApi as _, ToSchema};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use super::guard::{Guarded, guard};
use super::page::page;
use super::state::State;
use super::{events, metrics};
use crate::desk::Desk;
use crate::ledger::WRITE_LIMIT;
use crate::order::{Answer, Order};
use crate::problem::{Code, Problem};
use crate::request::Caller;
use crate::stops::Arrival;
use crate::view::{Ending, StorageView};

/// The longest that an answer is held back for an end.
const WAIT_MAX: Duration = Duration::from_secs(300);
/// How often an answer that is held back looks.
const LOOK_EVERY: Duration = Duration::from_millis(2);
/// How often a wait with the token of the lease keeps it.
const KEEP_EVERY: Duration = Duration::from_secs(5);

#[derive(utoipa::OpenApi)]
#[openapi(
    info(
        title = "truestage",
        description = "One machine, kept zeroed, enabled and supervised. Not a safety function: wire STO.",
        license(name = "MIT OR Apache-2.0", identifier = "MIT OR Apache-2.0")
    ),
    components(schemas(crate::quantity::PlaceIn)),
    tags(
        (name = "machine", description = "The machine and its axes"),
        (name = "motions", description = "Motions; their end is a level"),
        (name = "runs", description = "Procedures: plan, start, pause, resume, abort"),
        (name = "calibrations", description = "What corrects motions: activate, roll back"),
        (name = "journals", description = "What runs measured, and their pages"),
        (name = "events", description = "What happens"),
        (name = "service", description = "The service itself")
    )
)]
struct Described;

/// The resources and what they are.
pub(super) fn described() -> (Router<State>, OpenApi) {
    let (router, mut description) = routed();
    precise(&mut description);
    secured::describe(&mut description);
    (router, description)
}

fn routed() -> (Router<State>, OpenApi) {
    let v1 = OpenApiRouter::new()
        .routes(routes!(machine::machine))
        .routes(routes!(machine::axes))
        .routes(routes!(machine::axis))
        .routes(routes!(machine::enable))
        .routes(routes!(machine::disable))
        .routes(routes!(machine::stop))
        .routes(routes!(machine::reset))
        .routes(routes!(machine::lease, machine::release))
        .routes(routes!(machine::accept_ledger))
        .routes(routes!(motions::motions, motions::begin))
        .routes(routes!(motions::motion))
        .routes(routes!(motions::renew))
        .routes(routes!(motions::jog))
        .routes(routes!(calibrations::calibrations))
        .routes(routes!(calibrations::activate))
        .routes(routes!(calibrations::rollback))
        .routes(routes!(calibrations::clear))
        .routes(routes!(runs::runs, runs::plan))
        .routes(routes!(runs::run))
        .routes(routes!(runs::start))
        .routes(routes!(runs::abort))
        .routes(routes!(runs::pause))
        .routes(routes!(runs::resume))
        .routes(routes!(runs::answer))
        .routes(routes!(journals::journals))
        .routes(routes!(journals::journal))
        .routes(routes!(journals::report))
        .routes(routes!(events::events));
    OpenApiRouter::with_openapi(Described::openapi())
        .routes(routes!(healthz))
        .routes(routes!(metrics::metrics))
        .nest("/v1", v1)
        .split_for_parts()
}

/// What declarations cannot say: a parameter is left out and never null, and a stop needs no body.
fn precise(description: &mut OpenApi) {
    for item in description.paths.paths.values_mut() {
        let operations = [&mut item.get, &mut item.post, &mut item.delete];
        for operation in operations.into_iter().flatten() {
            for parameter in operation.parameters.iter_mut().flatten() {
                if let RefOr::T(parameter) = parameter {
                    parameter.schema.iter_mut().for_each(without_null);
                }
            }
            if operation.operation_id.as_deref() == Some("stop")
                && let Some(RefOr::T(body)) = &mut operation.request_body
            {
                body.required = Some(Required::False);
            }
        }
    }
}

fn without_null(schema: &mut RefOr<Schema>) {
    if let RefOr::T(Schema::Object(object)) = schema
        && let SchemaType::Array(types) = &mut object.schema_type
    {
        types.retain(|it| *it != Type::Null);
        if let [only] = &types[..] {
            object.schema_type = SchemaType::Type(only.clone());
        }
    }
}

/// All that is served to `desk`'s clients.
pub(super) fn router(state: State, guarded: Guarded) -> Router {
    let (router, description) = described();
    router
        .route(
            "/openapi.json",
            get(async move || Json(description.clone())),
        )
        .merge(page())
        .fallback(async |uri: Uri| {
            let what = format!("there is no {}", super::guard::plain(uri.path()));
            Problem::new(Code::NotFound, what, "GET /openapi.json says what there is")
        })
        .method_not_allowed_fallback(async || {
            let what = "this resource knows no such method";
            Problem::new(
                Code::MethodNotAllowed,
                what,
                "GET /openapi.json says what there is",
            )
        })
        .layer(from_fn_with_state(guarded, guard))
        .with_state(state)
}

/// Whether the service is alive.
#[derive(Debug, Serialize, ToSchema)]
struct Health {
    /// What the machine is.
    state: crate::view::MachineState,
    /// The disk that motions and runs are written to before they begin.
    storage: StorageView,
}

/// Whether the service is alive, and what the machine is.
#[utoipa::path(
    get, path = "/healthz", tag = "service",
    responses((status = 200, description = "It is", body = Health))
)]
async fn healthz(axum::extract::State(state): axum::extract::State<State>) -> Json<Health> {
    let desk = &state.desk;
    Json(Health {
        state: desk.machine().state,
        storage: desk.storage(),
    })
}

/// How long an answer may be held back.
#[derive(Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub(super) struct Wait {
    /// Seconds to wait for the end; 300 at most. At once when left out.
    #[param(minimum = 0, maximum = 300)]
    wait_s: Option<f64>,
}

impl Wait {
    /// Asks until the end is on the disk or the time is over, and does `keep` now and then; once it has ended, no
    /// longer than a write may take.
    pub(super) async fn until<T: Ending>(
        self,
        keep: impl Fn(),
        ask: impl Fn() -> Result<T, Problem>,
    ) -> Result<T, Problem> {
        let wait_s = self.wait_s.unwrap_or_default();
        // Written so that NaN is refused too.
        if !(0.0..=WAIT_MAX.as_secs_f64()).contains(&wait_s) {
            let what = format!("wait_s = {wait_s} is no time to wait");
            let help = "give seconds from 0 to 300";
            return Err(Problem::new(Code::BadRequest, what, help));
        }
        let begun = tokio::time::Instant::now();
        let limit = begun + Duration::from_secs_f64(wait_s);
        let mut ended = None;
        let mut keep_at = begun;
        loop {
            let (asked, now) = (ask()?, tokio::time::Instant::now());
            let is_over = asked.has_ended()
                && (!asked.waits_for_disk() || now >= *ended.get_or_insert(now + WRITE_LIMIT));
            if is_over || now >= limit {
                return Ok(asked);
            }
            if now >= keep_at {
                keep_at = now + KEEP_EVERY;
                keep();
            }
            tokio::time::sleep(LOOK_EVERY).await;
        }
    }
}

/// Keeps the lease whose token a wait has, as long as its connection lives.
pub(super) fn keep_lease(desk: &Desk, caller: &Caller) {
    if caller.lease.is_some() {
        // Where too many orders wait, the next time is soon enough.
        let _ = desk.give(caller, Order::KeepLease);
    }
}

/// A query of a request, with its refusal as a problem.
pub(super) type MaybeQuery<T> =
    Result<axum::extract::Query<T>, axum::extract::rejection::QueryRejection>;

/// What a query says.
pub(super) fn query<T>(query: MaybeQuery<T>) -> Result<T, Problem> {
    let read = query.map(|it| it.0);
    read.map_err(|it| Problem::new(Code::BadRequest, it.body_text(), ""))
}

/// How often an order that must not be lost is given again while too many others wait.
const AGAIN: u32 = 500;

/// The same of a stop: that too many orders of others wait does not keep it away.
pub(super) async fn obey_at_last(
    desk: &Desk,
    caller: &Caller,
    order: Order,
) -> Result<Answer, Problem> {
    for _ in 0..AGAIN {
        match desk.give(caller, order.clone()) {
            Err(problem) if problem.code == Code::Busy => tokio::time::sleep(LOOK_EVERY).await,
            given => return given?.answer().await,
        }
    }
    obey(desk, caller, order).await
}

/// Gives an order that arrived then, and waits for its answer.
pub(super) async fn obey_since(
    arrival: Arrival,
    desk: &Desk,
    caller: &Caller,
    order: Order,
) -> Result<Answer, Problem> {
    desk.give_since(arrival, caller, order)?.answer().await
}

/// Gives an order and waits for its answer, without keeping anybody else waiting.
pub(super) async fn obey(desk: &Desk, caller: &Caller, order: Order) -> Result<Answer, Problem> {
    desk.give(caller, order)?.answer().await
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    struct Endless;

    impl Ending for Endless {
        fn has_ended(&self) -> bool {
            false
        }

        fn waits_for_disk(&self) -> bool {
            false
        }
    }

    #[test]
    fn a_wait_keeps_the_lease_at_once_and_each_five_seconds() {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_time()
            .start_paused(true)
            .build();
        let kept = Cell::new(0);
        let wait = Wait { wait_s: Some(12.0) };
        let waiting = wait.until(|| kept.set(kept.get() + 1), || Ok(Endless));
        runtime.unwrap().block_on(waiting).unwrap();
        assert_eq!(kept.get(), 3, "at 0, 5 and 10 s");
    }
}
