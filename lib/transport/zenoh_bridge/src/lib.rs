//! Zenoh as lib/transport needs it, for C++ through `cxx`: sessions, publishers and subscribers with
//! history, liveliness, queries. Every failure is a `Result` here and a `rust::Error` there.

mod refusals;

use std::{io::IsTerminal, time::Duration};

use cxx::SharedPtr;
use tracing_subscriber::{layer::SubscriberExt, EnvFilter, Layer};
use zenoh::{
    bytes::Encoding,
    handlers::Callback,
    key_expr::KeyExpr,
    pubsub,
    qos::{CongestionControl, Priority},
    query::{ConsolidationMode, QueryTarget},
    sample::{Sample, SampleKind},
    Config, Wait,
};
use zenoh_ext::{
    AdvancedPublisher, AdvancedPublisherBuilderExt, AdvancedSubscriber,
    AdvancedSubscriberBuilderExt, CacheConfig, HistoryConfig, MissDetectionConfig, RecoveryConfig,
    SampleMissListener,
};

type Outcome<T> = Result<T, Box<dyn std::error::Error + Send + Sync>>;

/// How often a publisher with history tells its last sequence number, so that a lost last sample is noticed.
const HEARTBEAT: Duration = Duration::from_millis(500);
/// How long live samples are held back while a publisher is asked for its history.
const HISTORY_TIMEOUT: Duration = Duration::from_secs(2);

#[cxx::bridge(namespace = "imprint::bridge")]
mod ffi {
    struct PublisherSetup {
        /// 1 (real time) to 7 (background), as Zenoh counts.
        priority: u8,
        /// Wait when the link is full; otherwise the sample is dropped.
        block: bool,
        /// Send at once instead of gathering a batch.
        express: bool,
        /// Samples kept for late or lossy subscribers; 0: none.
        history: usize,
    }

    struct Reply {
        ok: bool,
        /// Nobody answered in time; `payload` says nothing.
        timed_out: bool,
        key: String,
        payload: Vec<u8>,
    }

    // `-> Result<()>`: a C++ exception comes back as an error instead of ending the process.
    unsafe extern "C++" {
        include!("lib/transport/zenoh_bridge/handlers.h");
        type SampleHandler;
        fn on_sample(self: &SampleHandler, key: &str, payload: &[u8]) -> Result<()>;
        fn on_miss(self: &SampleHandler, source: &str, count: u32) -> Result<()>;
        type LivenessHandler;
        fn on_change(self: &LivenessHandler, key: &str, alive: bool) -> Result<()>;
        type PeerHandler;
        fn on_link(self: &PeerHandler, opened: bool, id: &str, name: &str, address: &str) -> Result<()>;
        fn on_denied(self: &PeerHandler, id: &str, action: &str, key: &str) -> Result<()>;
        fn on_handshake_refused(self: &PeerHandler, reason: &str) -> Result<()>;
        fn on_not_let_in(self: &PeerHandler, endpoint: &str, reason: &str) -> Result<()>;
        type RequestHandler;
        fn on_request(self: &RequestHandler, request: Box<Request>) -> Result<()>;
    }

    extern "Rust" {
        /// Zenoh's own messages go to stderr; `RUST_LOG` overrides the level.
        fn log_to_stderr(level: &str);
        /// Who is told what sessions of this program refuse; the last one given.
        fn report_refusals_to(handler: SharedPtr<PeerHandler>);

        type Session;
        fn open_session(config_json: &str) -> Result<Box<Session>>;
        /// Tells of every link of the session, those there are first, until the session closes.
        fn watch_links(self: &Session, handler: SharedPtr<PeerHandler>) -> Result<()>;
        fn declare_publisher(self: &Session, key: &str, setup: &PublisherSetup) -> Result<Box<Publisher>>;
        fn declare_subscriber(
            self: &Session,
            key: &str,
            history: usize,
            handler: SharedPtr<SampleHandler>,
        ) -> Result<Box<Subscriber>>;
        fn declare_token(self: &Session, key: &str) -> Result<Box<Token>>;
        fn watch_tokens(
            self: &Session,
            key: &str,
            handler: SharedPtr<LivenessHandler>,
        ) -> Result<Box<TokenWatch>>;
        fn declare_queryable(
            self: &Session,
            key: &str,
            handler: SharedPtr<RequestHandler>,
        ) -> Result<Box<Queryable>>;
        /// The replies travel with the query's priority.
        fn get(
            self: &Session,
            selector: &str,
            payload: &[u8],
            timeout_ms: u64,
            setup: &PublisherSetup,
        ) -> Result<Vec<Reply>>;

        type Publisher;
        fn put(self: &Publisher, payload: &[u8]) -> Result<()>;

        type Subscriber;
        type Token;
        type TokenWatch;
        type Queryable;

        /// A query that waits for its answer; dropped unanswered, it ends without a reply.
        type Request;
        fn key(self: &Request) -> &str;
        fn parameters(self: &Request) -> &str;
        fn payload(self: &Request) -> Vec<u8>;
        fn reply(self: &Request, payload: &[u8]) -> Result<()>;
        fn reply_error(self: &Request, message: &str) -> Result<()>;
    }
}

// The contract of handlers.h: their methods may be called from any thread, several at once.
unsafe impl Send for ffi::SampleHandler {}
unsafe impl Sync for ffi::SampleHandler {}
unsafe impl Send for ffi::LivenessHandler {}
unsafe impl Sync for ffi::LivenessHandler {}
unsafe impl Send for ffi::PeerHandler {}
unsafe impl Sync for ffi::PeerHandler {}
unsafe impl Send for ffi::RequestHandler {}
unsafe impl Sync for ffi::RequestHandler {}

pub struct Session(zenoh::Session);
pub struct Publisher(AdvancedPublisher<'static>);
pub struct Subscriber {
    _samples: AdvancedSubscriber<()>,
    _misses: SampleMissListener<()>,
}
pub struct Token(#[allow(dead_code)] zenoh::liveliness::LivelinessToken);
pub struct TokenWatch(#[allow(dead_code)] pubsub::Subscriber<()>);
pub struct Queryable(#[allow(dead_code)] zenoh::query::Queryable<()>);
pub struct Request {
    query: zenoh::query::Query,
    /// What the queryable was declared on: the key of the reply when the query's own has wildcards.
    declared: KeyExpr<'static>,
}

fn log_to_stderr(level: &str) {
    // In a journal the colours would be noise.
    if !std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none() {
        std::env::set_var("NO_COLOR", "1");
    }
    let spoken = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(level));
    let to_stderr = tracing_subscriber::fmt::layer().with_writer(std::io::stderr).with_filter(spoken);
    let subscriber = tracing_subscriber::registry().with(to_stderr).with(refusals::layer());
    let _ = tracing::subscriber::set_global_default(subscriber); // fails when there is one: then that one stays
}

fn report_refusals_to(handler: SharedPtr<ffi::PeerHandler>) {
    refusals::report_to(handler);
}

fn open_session(config_json: &str) -> Outcome<Box<Session>> {
    let config = Config::from_json5(config_json)?;
    Ok(Box::new(Session(zenoh::open(config).wait()?)))
}

fn report(what: &str, outcome: Result<(), cxx::Exception>) {
    if let Err(error) = outcome {
        eprintln!("zenoh bridge: {what} failed: {error}");
    }
}

impl Session {
    fn watch_links(&self, handler: SharedPtr<ffi::PeerHandler>) -> Outcome<()> {
        self.0
            .info()
            .link_events_listener()
            .history(true)
            .callback(move |event| {
                let link = event.link();
                let opened = event.kind() == SampleKind::Put;
                let name = link.auth_identifier().unwrap_or_default();
                let (id, address) = (link.zid().to_string(), link.dst().to_string());
                report("on_link", handler.on_link(opened, &id, name, &address));
            })
            .background()
            .wait()?;
        Ok(())
    }

    fn declare_publisher(&self, key: &str, setup: &ffi::PublisherSetup) -> Outcome<Box<Publisher>> {
        let congestion = if setup.block { CongestionControl::Block } else { CongestionControl::Drop };
        let mut builder = self
            .0
            .declare_publisher(key.to_owned())
            .encoding(Encoding::APPLICATION_PROTOBUF)
            .priority(Priority::try_from(setup.priority)?)
            .congestion_control(congestion)
            .express(setup.express)
            .advanced();
        if setup.history > 0 {
            builder = builder
                .cache(CacheConfig::default().max_samples(setup.history))
                .sample_miss_detection(MissDetectionConfig::default().heartbeat(HEARTBEAT))
                .publisher_detection();
        }
        Ok(Box::new(Publisher(builder.wait()?)))
    }

    fn declare_subscriber(
        &self,
        key: &str,
        history: usize,
        handler: SharedPtr<ffi::SampleHandler>,
    ) -> Outcome<Box<Subscriber>> {
        let miss_handler = handler.clone();
        let on_sample = Callback::from(move |sample: Sample| {
            let payload = sample.payload().to_bytes(); // borrowed when it is in one piece
            report("on_sample", handler.on_sample(sample.key_expr().as_str(), &payload));
        });
        let mut builder = self.0.declare_subscriber(key.to_owned()).with(on_sample).advanced();
        if history > 0 {
            builder = builder
                .history(HistoryConfig::default().max_samples(history).detect_late_publishers())
                .recovery(RecoveryConfig::default().heartbeat())
                .query_timeout(HISTORY_TIMEOUT);
        }
        let samples = builder.wait()?;
        let misses = samples
            .sample_miss_listener()
            .callback(move |miss| {
                let source = format!("{:?}", miss.source());
                report("on_miss", miss_handler.on_miss(&source, miss.nb()));
            })
            .wait()?;
        Ok(Box::new(Subscriber { _samples: samples, _misses: misses }))
    }

    fn declare_token(&self, key: &str) -> Outcome<Box<Token>> {
        Ok(Box::new(Token(self.0.liveliness().declare_token(key.to_owned()).wait()?)))
    }

    fn watch_tokens(
        &self,
        key: &str,
        handler: SharedPtr<ffi::LivenessHandler>,
    ) -> Outcome<Box<TokenWatch>> {
        let watch = self
            .0
            .liveliness()
            .declare_subscriber(key.to_owned())
            .history(true) // tokens that were there before
            .callback(move |token| {
                let alive = token.kind() == SampleKind::Put;
                report("on_change", handler.on_change(token.key_expr().as_str(), alive));
            })
            .wait()?;
        Ok(Box::new(TokenWatch(watch)))
    }

    fn declare_queryable(
        &self,
        key: &str,
        handler: SharedPtr<ffi::RequestHandler>,
    ) -> Outcome<Box<Queryable>> {
        let declared = KeyExpr::new(key.to_owned())?;
        let reply_key = declared.clone();
        let queryable = self
            .0
            .declare_queryable(declared)
            .callback(move |query| {
                let unanswered = query.clone();
                let request = Request { query, declared: reply_key.clone() };
                if let Err(error) = handler.on_request(Box::new(request)) {
                    let _ = unanswered.reply_err(error.what()).wait();
                }
            })
            .wait()?;
        Ok(Box::new(Queryable(queryable)))
    }

    fn get(
        &self,
        selector: &str,
        payload: &[u8],
        timeout_ms: u64,
        setup: &ffi::PublisherSetup,
    ) -> Outcome<Vec<ffi::Reply>> {
        let replies = self
            .0
            .get(selector)
            .payload(payload)
            .target(QueryTarget::All)
            .consolidation(ConsolidationMode::None)
            .timeout(Duration::from_millis(timeout_ms))
            .priority(Priority::try_from(setup.priority)?)
            .congestion_control(CongestionControl::Block)
            .express(setup.express)
            .wait()?;
        let mut answers = Vec::new();
        while let Ok(reply) = replies.recv() {
            answers.push(match reply.result() {
                Ok(sample) => ffi::Reply {
                    ok: true,
                    timed_out: false,
                    key: sample.key_expr().as_str().to_owned(),
                    payload: sample.payload().to_bytes().into_owned(),
                },
                // Zenoh itself speaks of a timeout in an error reply; those of a Request are plain text.
                Err(error) => ffi::Reply {
                    ok: false,
                    timed_out: *error.encoding() != Encoding::TEXT_PLAIN
                        && error.payload().to_bytes().as_ref() == b"Timeout",
                    key: String::new(),
                    payload: error.payload().to_bytes().into_owned(),
                },
            });
        }
        Ok(answers)
    }
}

impl Publisher {
    fn put(&self, payload: &[u8]) -> Outcome<()> {
        Ok(self.0.put(payload).wait()?)
    }
}

impl Request {
    fn key(&self) -> &str {
        self.query.key_expr().as_str()
    }

    fn parameters(&self) -> &str {
        self.query.parameters().as_str()
    }

    fn payload(&self) -> Vec<u8> {
        self.query.payload().map(|p| p.to_bytes().into_owned()).unwrap_or_default()
    }

    fn reply(&self, payload: &[u8]) -> Outcome<()> {
        let asked = self.query.key_expr();
        let key = if asked.is_wild() { &self.declared } else { asked };
        if key.is_wild() {
            return Err(format!("no single key to answer on: asked {asked}, declared {}", self.declared).into());
        }
        Ok(self.query.reply(key, payload).wait()?)
    }

    fn reply_error(&self, message: &str) -> Outcome<()> {
        Ok(self.query.reply_err(message).encoding(Encoding::TEXT_PLAIN).wait()?)
    }
}
