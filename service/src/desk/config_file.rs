//! The file of the machine's configuration, compared with what is in use.

use super::Desk;
use crate::order::Order;
use crate::request::Caller;

impl Desk {
    /// That the machine's file says something else by now, which nobody uses. Reads the disk; it is told among the
    /// events, too.
    pub fn config_change(&self, caller: &Caller) -> Option<String> {
        let text = self.shared.fixed.config.change_of_file()?;
        // Where too many orders wait, the answer says it alone.
        let _ = self.give(caller, Order::Warn { text: text.clone() });
        Some(text)
    }
}
