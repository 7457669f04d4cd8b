"""python-can's reader of `candump -L` files, on standard input: reports the messages."""

import sys

import can

import peer

messages = [
    {
        "at": message.timestamp,
        "interface": message.channel,
        "id": message.arbitration_id,
        "extended": message.is_extended_id,
        "remote": message.is_remote_frame,
        "error": message.is_error_frame,
        "received": message.is_rx,
        "length": message.dlc,
        "data": message.data.hex(),
    }
    for message in can.CanutilsLogReader(sys.stdin)
]
peer.report(messages=messages)
