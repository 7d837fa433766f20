//! What Zenoh refuses it tells its log alone: this layer reads there which session was denied what, which connections
//! ended in their TLS handshake, and by whom this program itself was not let in.

use std::{
    cell::RefCell,
    fmt,
    sync::{PoisonError, RwLock},
};

use cxx::SharedPtr;
use tracing::{field::Field, field::Visit, Event, Level, Subscriber};
use tracing_subscriber::{
    filter::Targets,
    layer::{Context, Layer},
    registry::LookupSpan,
};

use crate::ffi::PeerHandler;

const ACCESS_CONTROL: &str = "zenoh::net::routing::interceptor::access_control";
const TLS_LINKS: &str = "zenoh_link_tls";
const CONNECTING: &str = "zenoh::net::runtime::orchestrator";

static HANDLER: RwLock<Option<SharedPtr<PeerHandler>>> = RwLock::new(None);

pub fn report_to(handler: SharedPtr<PeerHandler>) {
    *HANDLER.write().unwrap_or_else(PoisonError::into_inner) = Some(handler);
}

pub fn layer<S: Subscriber + for<'a> LookupSpan<'a>>() -> impl Layer<S> {
    let wanted = Targets::new()
        .with_target(ACCESS_CONTROL, Level::TRACE)
        .with_target(TLS_LINKS, Level::WARN)
        .with_target(CONNECTING, Level::DEBUG);
    Refusals.with_filter(wanted)
}

struct Refusals;

impl<S: Subscriber> Layer<S> for Refusals {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let mut message = Message::default();
        event.record(&mut message);
        let handler = HANDLER.read().unwrap_or_else(PoisonError::into_inner);
        let Some(handler) = handler.as_ref() else { return };
        if event.metadata().target().starts_with(TLS_LINKS) {
            let reason = message.0.split(". Hint:").next().unwrap_or_default();
            crate::report("on_handshake_refused", handler.on_handshake_refused(reason));
        } else if event.metadata().target() == CONNECTING {
            if let Some((endpoint, reason)) = not_let_in(&message.0) {
                crate::report("on_not_let_in", handler.on_not_let_in(endpoint, reason));
            }
        } else if let Some((id, action, key)) = denied(&message.0) {
            crate::report("on_denied", handler.on_denied(id, action, key));
        }
    }
}

#[derive(Default)]
struct Message(String);

impl Visit for Message {
    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        if field.name() == "message" {
            self.0 = format!("{value:?}");
        }
    }
}

/// Endpoint and reason of a connection of our own that ended in its TLS handshake:
/// "Unable to connect to configured peer ENDPOINT! REASON at FILE:LINE."
fn not_let_in(message: &str) -> Option<(&str, &str)> {
    let (endpoint, rest) = message.strip_prefix("Unable to connect to configured peer ")?.split_once("! ")?;
    let reason = rest.split(" at /").next()?;
    (reason.contains("alert") || reason.contains("certificate")).then_some((endpoint, reason))
}

thread_local! {
    /// The key whose permissions Zenoh is looking up in advance: then it asks for all actions, and none was tried.
    static LOOKED_UP: RefCell<String> = const { RefCell::new(String::new()) };
}
const LOOK_UP_BEGINS: &str = "ACL (ingress): caching permissions for `";
const LAST_LOOKED_UP: &str = "Declare Liveliness Subscriber (ingress)";

/// Session id, action and key of what a session has tried and may not.
fn denied(message: &str) -> Option<(&str, &str, &str)> {
    if let Some(rest) = message.strip_prefix(LOOK_UP_BEGINS) {
        let key = rest.split('`').next().unwrap_or_default();
        LOOKED_UP.with(|looked_up| *looked_up.borrow_mut() = key.to_owned());
        return None;
    }
    let (who, action, key) = parse(message)?;
    let remembered = message.starts_with("Using cached result: ");
    let in_advance = !remembered && LOOKED_UP.with(|looked_up| *looked_up.borrow() == key);
    if in_advance && action == LAST_LOOKED_UP {
        LOOKED_UP.with(|looked_up| looked_up.borrow_mut().clear());
    }
    if in_advance || !message.contains(" is unauthorized to ") {
        return None;
    }
    Some((who, action.trim_end_matches(" (ingress)"), key))
}

/// "[Using cached result: ]ID [on SUBJECT ]is [un]authorized to ACTION (ingress) on KEY"
fn parse(message: &str) -> Option<(&str, &str, &str)> {
    let message = message.strip_prefix("Using cached result: ").unwrap_or(message);
    let (who, what) = message.split_once("authorized to ")?;
    let (action, key) = what.rsplit_once(" on ")?;
    let id = who.split(' ').next()?;
    action.ends_with("(ingress)").then_some((id, action, key))
}
