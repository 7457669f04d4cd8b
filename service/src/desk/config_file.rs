//! The file of the machine's configuration, compared with what is in use.

use truestage::config::ConfigFile;

use super::Desk;
use crate::order::Order;
use crate::request::Caller;

impl Desk {
    /// That the machine's file says something else by now, which nobody uses. Reads the disk; it is told among the
    /// events, too.
    pub fn config_change(&self, caller: &Caller) -> Option<String> {
        let file = self.shared.fixed.config_file.as_ref();
        let text = file.and_then(ConfigFile::change)?;
        // Where too many orders wait, the answer says it alone.
        let _ = self.give(caller, Order::Warn { text: text.clone() });
        Some(text)
    }
}
