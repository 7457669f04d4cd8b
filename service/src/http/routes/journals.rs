//! Journals of runs, and their pages.

use std::fs::File;
use std::io::{self, Read as _, Take};

use axum::Json;
use axum::body::Body;
use axum::extract::State as Of;
use axum::http::header;
use axum::response::IntoResponse;
use futures_util::stream;

use super::super::guard::Named;
use super::super::state::State;
use crate::desk::Desk;
use crate::problem::{Code, Problem, ProblemBody};
use crate::view::JournalView;

/// A page of a run has everything in itself and runs nothing.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; \
                      form-action 'none'; frame-ancestors 'none'";

/// So many bytes of a journal are in memory at once.
const PIECE: usize = 64 << 10;

/// The newest hundred journals of runs, the newest first.
#[utoipa::path(
    get, path = "/journals", tag = "journals",
    responses(
        (status = 200, description = "Which there are", body = Vec<JournalView>),
        (status = "5XX", description = "The disk", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn journals(Of(state): Of<State>) -> Result<Json<Vec<JournalView>>, Problem> {
    from_disk(state, Desk::journals).await.map(Json)
}

/// A journal, as it is stored: a line of JSON for each thing that was measured.
#[utoipa::path(
    get, path = "/journals/{name}", tag = "journals", params(("name" = String, Path, description = "Its name, or that of its run")),
    responses(
        (status = 200, description = "JSON Lines", body = String, content_type = "text/plain"),
        (status = "4XX", description = "There is none", body = ProblemBody, content_type = "application/problem+json"),
        (status = "5XX", description = "The disk", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn journal(
    Of(state): Of<State>,
    Named(name): Named,
) -> Result<impl IntoResponse, Problem> {
    let file = from_disk(state, move |desk| desk.journal_file(&name)).await?;
    let headers = [
        (header::CONTENT_TYPE, "text/plain; charset=utf-8".to_owned()),
        (header::CONTENT_LENGTH, file.limit().to_string()),
    ];
    let said = Body::from_stream(stream::try_unfold(file, next_piece));
    Ok((headers, said))
}

/// The next bytes of a file, `None` at its end, while others are served.
async fn next_piece(mut file: Take<File>) -> io::Result<Option<(Vec<u8>, Take<File>)>> {
    let reading = tokio::task::spawn_blocking(move || {
        let mut piece = Vec::with_capacity(PIECE);
        file.by_ref().take(PIECE as u64).read_to_end(&mut piece)?;
        Ok((!piece.is_empty()).then_some((piece, file)))
    });
    reading.await.map_err(io::Error::other)?
}

/// The page of a run: what `truestage report` makes of its journal.
#[utoipa::path(
    get, path = "/reports/{run}", tag = "journals", params(("run" = String, Path, description = "Its name, or that of its journal")),
    responses(
        (status = 200, description = "One page, with everything in it", body = String, content_type = "text/html"),
        (status = "4XX", description = "There is none, or nothing can be shown of it", body = ProblemBody, content_type = "application/problem+json"),
        (status = "5XX", description = "The disk", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(super) async fn report(
    Of(state): Of<State>,
    Named(name): Named,
) -> Result<impl IntoResponse, Problem> {
    let page = from_disk(state, move |desk| desk.report(&name)).await?;
    let headers = [
        (header::CONTENT_TYPE, "text/html; charset=utf-8"),
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    ];
    Ok((headers, page))
}

/// It waits for the disk: others are served meanwhile.
pub(super) async fn from_disk<T: Send + 'static>(
    state: State,
    read: impl FnOnce(&Desk) -> Result<T, Problem> + Send + 'static,
) -> Result<T, Problem> {
    let read = tokio::task::spawn_blocking(move || read(&state.desk)).await;
    read.unwrap_or_else(|it| Err(Problem::new(Code::Storage, it.to_string(), "")))
}
