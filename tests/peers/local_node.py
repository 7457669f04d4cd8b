"""python-canopen's LocalNode as an SDO server: node 0x21, until standard input ends.

Reports "ready" once it listens, and at the end what its objects hold.
"""

import sys

from canopen.objectdictionary.datatypes import (
    DOMAIN,
    UNSIGNED8,
    UNSIGNED16,
    UNSIGNED32,
    VISIBLE_STRING,
)

import peer

NODE = 0x21
DEVICE_NAME = "a local node of python-canopen"
WRITABLE = {"u8": 0x2000, "u16": 0x2001, "u32": 0x2002, "domain": 0x2003}


def object_dictionary():
    """Mandatory objects, one writable object of each size, and some that refuse."""
    identity = {sub: (UNSIGNED32, "ro", 0x100 + sub) for sub in range(1, 5)}
    return peer.dictionary(
        [
            peer.variable(0x1000, 0, UNSIGNED32, "ro", 0x0002_0192),
            peer.variable(0x1001, 0, UNSIGNED8, "ro", 0),
            peer.variable(0x1008, 0, VISIBLE_STRING, "const", DEVICE_NAME),
            peer.variable(0x1017, 0, UNSIGNED16, "rw", 0),
            peer.record(0x1018, {0: (UNSIGNED8, "ro", 4)} | identity),
            peer.variable(WRITABLE["u8"], 0, UNSIGNED8),
            peer.variable(WRITABLE["u16"], 0, UNSIGNED16),
            peer.variable(WRITABLE["u32"], 0, UNSIGNED32),
            peer.variable(WRITABLE["domain"], 0, DOMAIN),
            peer.variable(0x2010, 0, UNSIGNED16, "ro", 0x1234),
            peer.variable(0x2011, 0, UNSIGNED16, "wo", 0),
        ]
    )


def main():
    network = peer.connect(*peer.arguments())
    node = network.create_node(NODE, object_dictionary())
    # The boot-up message; the library leaves the state as it was.
    node.nmt.state = "INITIALISING"
    node.nmt.state = "PRE-OPERATIONAL"
    peer.report(ready=True)
    sys.stdin.read()
    held = {name: node.data_store.get(index, {}).get(0) for name, index in WRITABLE.items()}
    network.disconnect()
    peer.report(**{name: None if value is None else value.hex() for name, value in held.items()})


main()
