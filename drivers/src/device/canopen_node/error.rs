//! A script's failure in the terms of a device.

use crate::device::DeviceError;
use crate::protocol::script::{ScriptCause, ScriptFailure};
use crate::protocol::sdo_client::SdoFailure;
use wire::canopen::NodeId;

pub(super) fn device_error(node: NodeId, failure: ScriptFailure) -> DeviceError {
    let step = failure.text;
    match failure.cause {
        ScriptCause::Differs { expected, seen } => DeviceError::ReadBack {
            node,
            object: failure.object,
            expected,
            seen,
            step,
        },
        ScriptCause::Sdo(SdoFailure::Aborted { object, code }) => DeviceError::SdoAbort {
            node,
            object,
            code,
            step,
        },
        ScriptCause::Sdo(SdoFailure::TimedOut {
            object,
            waited,
            attempts,
            ..
        }) => DeviceError::SdoTimeout {
            node,
            object,
            waited,
            attempts,
            step,
        },
        ScriptCause::Sdo(SdoFailure::Protocol { object, code, .. }) => DeviceError::SdoProtocol {
            node,
            object,
            code,
            step,
        },
    }
}
