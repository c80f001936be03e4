//! Owns the table of addresses. Every answer is computed on a thread that may block; a panic there is an error of this answer alone.

use std::sync::Arc;

use axum::Router;
use axum::extract::rejection::{JsonRejection, QueryRejection};
use axum::extract::{DefaultBodyLimit, Json, Query, Request, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use serde::Deserialize;
use serde_json::{Value, json};
use skinrig_model::PressId;
use tokio::sync::Semaphore;

use crate::access::{self, Token};
use crate::folder::Folder;
use crate::lab::Lab;
use crate::live::Hub;
use crate::open_session::{Cache, OpenSession};
use crate::problem::Problem;
use crate::{assets, clusters, control, differences, document, download, events, poses, shelf};

/// Largest body of a request, bytes: a note of 2,000 characters and its names.
const MOST_BODY_BYTES: usize = 16 * 1024;
/// Answers that are computed at a time, at most; further requests wait.
const MOST_AT_ONCE: usize = 8;

/// State of the server.
#[derive(Clone)]
pub(crate) struct App(Arc<Shared>);

struct Shared {
    token: Token,
    folder: Folder,
    lab: Arc<dyn Lab>,
    has_control: bool,
    cache: Cache,
    hub: Hub,
    room: Semaphore,
}

impl App {
    pub(crate) fn new(token: Token, folder: Folder, lab: Arc<dyn Lab>, has_control: bool) -> Self {
        Self(Arc::new(Shared {
            token,
            folder,
            lab,
            has_control,
            cache: Cache::default(),
            hub: Hub::default(),
            room: Semaphore::new(MOST_AT_ONCE),
        }))
    }

    /// Computes an answer on a thread that may block.
    async fn compute<T: Send + 'static>(
        &self,
        answer: impl FnOnce(&Shared) -> Result<T, Problem> + Send + 'static,
    ) -> Result<T, Problem> {
        let permit = self.0.room.acquire().await.map_err(Problem::internal)?;
        let shared = Arc::clone(&self.0);
        let done = tokio::task::spawn_blocking(move || answer(&shared)).await;
        drop(permit);
        match done {
            Ok(answer) => answer,
            Err(e) if e.is_panic() => Err(Problem::panicked(&*e.into_panic())),
            Err(e) => Err(Problem::internal(e)),
        }
    }
}

impl Shared {
    fn open(&self, named: &SessionQuery) -> Result<OpenSession, Problem> {
        let path = self.folder.session(&named.session)?;
        self.cache
            .open(&*self.lab, &path, named.analysis.as_deref())
    }
}

/// A session of the folder.
#[derive(Debug, Deserialize)]
struct SessionQuery {
    session: String,
    /// A variant; the official analysis without.
    #[serde(default)]
    analysis: Option<String>,
}

/// A press, by its number from 1.
#[derive(Debug, Deserialize)]
struct PressQuery {
    press: u32,
}

type QueryInput<T> = Result<Query<T>, QueryRejection>;
type JsonInput<T> = Result<Json<T>, JsonRejection>;
type Answer = Result<Response, Problem>;

fn query<T>(parameters: QueryInput<T>) -> Result<T, Problem> {
    let parsed = parameters.map(|Query(parsed)| parsed);
    parsed.map_err(|e| Problem::request(e.body_text()))
}

fn body<T>(sent: JsonInput<T>) -> Result<T, Problem> {
    let parsed = sent.map(|Json(parsed)| parsed);
    parsed.map_err(|e| Problem::new(e.status(), e.body_text()))
}

fn bytes(kind: &'static str, bytes: Vec<u8>) -> Response {
    (
        [(header::CONTENT_TYPE, HeaderValue::from_static(kind))],
        bytes,
    )
        .into_response()
}

/// All addresses.
pub(crate) fn router(app: App) -> Router {
    Router::new()
        .route("/", get(|| async { assets::page() }))
        .route("/app/{file}", get(assets::file))
        .route("/api/about", get(about))
        .route("/api/shelf", get(shelf_route))
        .route("/api/session", get(session))
        .route("/api/events", get(events_route))
        .route("/api/poses", get(poses_route))
        .route("/api/clusters", get(clusters_route))
        .route("/api/download", get(download_route))
        .route("/api/differences", get(differences_route))
        .route("/api/live", get(live))
        .route("/api/control", post(control_route))
        .route("/api/note", post(note))
        .fallback(|| async {
            Problem::absent("expected an address of this server, found another one")
        })
        .layer(DefaultBodyLimit::max(MOST_BODY_BYTES))
        .layer(middleware::from_fn_with_state(app.clone(), guard))
        .with_state(app)
}

/// Checks each request, and adds the headers of each answer.
async fn guard(State(app): State<App>, request: Request, next: Next) -> Response {
    let checked = access::check(
        &app.0.token,
        request.method(),
        request.uri(),
        request.headers(),
    );
    let mut answer = match checked {
        Ok(()) => next.run(request).await,
        Err(problem) => problem.into_response(),
    };
    for (name, value) in assets::HEADERS {
        answer
            .headers_mut()
            .insert(name, HeaderValue::from_static(value));
    }
    answer
}

async fn about(State(app): State<App>) -> Answer {
    let shared = &app.0;
    Ok(
        Json(json!({ "folder": shared.folder.path(), "control": shared.has_control }))
            .into_response(),
    )
}

async fn shelf_route(State(app): State<App>) -> Answer {
    let found = app.compute(|s| shelf::document(&*s.lab, &s.folder)).await?;
    Ok(Json(found).into_response())
}

async fn session(State(app): State<App>, named: QueryInput<SessionQuery>) -> Answer {
    let named = query(named)?;
    let answer = move |s: &Shared| document::document(&*s.lab, &s.open(&named)?);
    Ok(Json(app.compute(answer).await?).into_response())
}

async fn events_route(
    State(app): State<App>,
    named: QueryInput<SessionQuery>,
    window: QueryInput<events::Window>,
) -> Answer {
    let (named, window) = (query(named)?, query(window)?);
    window.check()?;
    let answer = move |s: &Shared| events::bytes(&s.open(&named)?, &window);
    Ok(bytes(
        "application/octet-stream",
        app.compute(answer).await?,
    ))
}

async fn poses_route(
    State(app): State<App>,
    named: QueryInput<SessionQuery>,
    interval: QueryInput<poses::Interval>,
) -> Answer {
    let (named, interval) = (query(named)?, query(interval)?);
    let answer = move |s: &Shared| poses::document(&s.open(&named)?, interval);
    Ok(Json(app.compute(answer).await?).into_response())
}

async fn clusters_route(
    State(app): State<App>,
    named: QueryInput<SessionQuery>,
    press: QueryInput<PressQuery>,
) -> Answer {
    let (named, number) = (query(named)?, query(press)?.press);
    let index = number
        .checked_sub(1)
        .ok_or_else(|| Problem::request("press: expected a number from 1, found 0"))?;
    let press = PressId::from_index(index);
    let answer = move |s: &Shared| clusters::document(&s.open(&named)?, press);
    Ok(Json(app.compute(answer).await?).into_response())
}

async fn download_route(
    State(app): State<App>,
    named: QueryInput<SessionQuery>,
    parameters: QueryInput<download::Request>,
) -> Answer {
    let (named, parameters) = (query(named)?, query(parameters)?);
    let answer = move |s: &Shared| download::file(&s.open(&named)?, parameters);
    let (name, found) = app.compute(answer).await?;
    let mut answer = bytes("application/octet-stream", found);
    let safe = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    let name: String = name
        .chars()
        .map(|c| if safe(c) { c } else { '_' })
        .collect();
    let disposition = HeaderValue::from_str(&format!("attachment; filename=\"{name}\""));
    let disposition = disposition.map_err(Problem::internal)?;
    answer
        .headers_mut()
        .insert(header::CONTENT_DISPOSITION, disposition);
    Ok(answer)
}

async fn differences_route(State(app): State<App>, pair: QueryInput<differences::Pair>) -> Answer {
    let pair = query(pair)?;
    let answer = move |s: &Shared| differences::document(&*s.lab, &s.folder, &pair);
    Ok(Json(app.compute(answer).await?).into_response())
}

async fn live(State(app): State<App>, named: QueryInput<SessionQuery>) -> Answer {
    let named = query(named)?;
    let path = app.0.folder.session(&named.session)?;
    app.0.hub.stream(&app.0.lab, &path)
}

async fn control_route(State(app): State<App>, sent: JsonInput<control::ControlRequest>) -> Answer {
    control::check(app.0.has_control)?;
    let parameters = body(sent)?;
    let answer = move |s: &Shared| control::control(&*s.lab, &s.folder, &parameters);
    Ok(Json(app.compute(answer).await?).into_response())
}

async fn note(State(app): State<App>, sent: JsonInput<control::NoteRequest>) -> Answer {
    control::check(app.0.has_control)?;
    let parameters = body(sent)?;
    let answer = move |s: &Shared| control::note(&*s.lab, &s.folder, &parameters);
    let found: Value = app.compute(answer).await?;
    Ok((StatusCode::OK, Json(found)).into_response())
}
