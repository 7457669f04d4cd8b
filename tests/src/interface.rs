//! Network interfaces of a test's own: made by it, changed by it, gone with it.

use std::process::Command;

/// A virtual CAN interface that exists as long as this value.
#[derive(Debug)]
pub struct Interface(&'static str);

impl Interface {
    /// Makes interface `name`, up.
    ///
    /// # Panics
    /// When `ip` cannot (this needs root, or a network namespace of one's own).
    pub fn vcan(name: &'static str) -> Self {
        let interface = Self(name);
        interface.add();
        interface
    }

    /// Makes a pair of interfaces, both up: what one sends the other receives.
    ///
    /// # Panics
    /// When `ip` cannot.
    pub fn pair(name: &'static str, peer: &'static str) -> Self {
        run(&format!(
            "ip link add dev {name} type vxcan peer name {peer}"
        ));
        run(&format!("ip link set {name} up"));
        run(&format!("ip link set {peer} up"));
        Self(name)
    }

    /// Its name.
    pub const fn name(&self) -> &'static str {
        self.0
    }

    /// Sets it up.
    pub fn up(&self) {
        run(&format!("ip link set {} up", self.0));
    }

    /// Sets it down.
    pub fn down(&self) {
        run(&format!("ip link set {} down", self.0));
    }

    /// Deletes it.
    pub fn delete(&self) {
        run(&format!("ip link del {}", self.0));
    }

    /// Makes it (again), up.
    pub fn add(&self) {
        run(&format!("ip link add dev {} type vcan", self.0));
        self.up();
    }
}

impl Drop for Interface {
    fn drop(&mut self) {
        // A test may have deleted it already.
        let _ = Command::new("ip").args(["link", "del", self.0]).output();
    }
}

/// Runs a command given as words.
///
/// # Panics
/// When it fails.
pub fn run(words: &str) {
    let mut words_of = words.split_ascii_whitespace();
    let program = words_of.next().expect("a command has a name");
    let output = Command::new(program).args(words_of).output();
    let output = output.unwrap_or_else(|error| panic!("{words}: {error}"));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{words}: {said}");
}
