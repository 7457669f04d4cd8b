//! The resident service: its contract, each line a test, written once for every interface.

mod alive;
mod client;
mod contract;
mod disk;
mod edge;
mod flood;
mod http;
mod metrics;
mod network;
mod stage;
mod storage;
mod strangers;
