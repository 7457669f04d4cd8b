//! The file of the machine's configuration, compared with what is in use.

use super::Desk;
use crate::order::Order;
use crate::request::Caller;

impl Desk {
    /// Says that the machine's file has another text by now than the one in use. Reads the disk. An event says so, too.
    pub fn config_change(&self, caller: &Caller) -> Option<String> {
        let text = self.shared.fixed.config.change_of_file()?;
        // Where too many orders wait, the answer says it alone.
        let _ = self.give(caller, Order::Warn { text: text.clone() });
        Some(text)
    }
}
