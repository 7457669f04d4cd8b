//! Software of others on the same bus: python-canopen as the master of our emulated devices and
//! as our driver's server, python-can as the reader of our recordings; GTC, which computes uncertainties; and
//! lxml, which judges certificates by the schema of the PTB; DuckDB and the library of MCAP, which read exported journals;
//! jsonschema-rs, which judges what `--json` prints;
//! schemathesis and openapi-python-client, which judge the HTTP interface, and Chromium, which shows its
//! page and draws pictures of others.

mod analog;
mod budget;
mod csp;
mod dcc;
mod drive;
mod emulated;
mod export;
mod http;
mod local_node;
mod page;
mod peer;
mod pictures;
mod recording;
mod schema;

use tests::Rig;

/// The buses of this run that another program can be on.
fn rigs() -> impl Iterator<Item = Rig> {
    tests::rigs()
        .into_iter()
        .filter(|rig| *rig != Rig::InProcess)
}
