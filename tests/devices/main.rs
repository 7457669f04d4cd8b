//! Each device's driver against its emulation, the same on every bus.

// Every file of this folder; a further device needs no line here.
automod::dir!("devices");
