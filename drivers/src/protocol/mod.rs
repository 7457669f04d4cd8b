//! Sans-io protocol machines: frames and time come in, frames and events go out.
