//! Says when the file of tokens cannot be used any more: whoever made the slip may be looking at something else.

use core::time::Duration;
use std::sync::Arc;

use tokio::time::sleep;

use super::state::Closing;
use crate::access::{KnownTokens, Say};
use crate::desk::Desk;
use crate::order::Order;
use crate::request::Caller;

/// The file is read again so often at most.
const LOOK_EVERY: Duration = Duration::from_secs(1);

/// Until the edge closes: one event and one line on standard error for each thing that is wrong, and for its end.
pub(super) async fn watch(
    tokens: Arc<KnownTokens>,
    say: Option<Say>,
    desk: Desk,
    mut closing: Closing,
) {
    let mut told = None;
    loop {
        let wrong = tokens.trouble().map(|it| it.to_string());
        if wrong != told && tell(&desk, say.as_ref(), wrong.as_deref()) {
            told = wrong;
        }
        tokio::select! {
            () = sleep(LOOK_EVERY) => {}
            () = closing.begun() => return,
        }
    }
}

/// Whether it could be told.
fn tell(desk: &Desk, say: Option<&Say>, wrong: Option<&str>) -> bool {
    let text = match wrong {
        Some(wrong) => format!(
            "the file of tokens cannot be used, and tokens do no more than stop until it is put right: {wrong}"
        ),
        None => "the file of tokens can be used again".to_owned(),
    };
    let order = Order::Warn { text: text.clone() };
    // Orders that wait are sent first: it is told a look later.
    let is_told = desk.give(&Caller::named("the edge"), order).is_ok();
    if is_told && let Some(say) = say {
        say(&format!("warning: {text}"));
    }
    is_told
}
