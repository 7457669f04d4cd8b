"""What the peer programs share: their bus, a hand-made object dictionary, and their report.

Called as `program INTERFACE CHANNEL`, with python-can's names: `slcan /dev/pts/3` or
`socketcan vcan0`. A report is one line of JSON on standard output.
"""

import json
import queue
import sys
import time

import canopen
from canopen.objectdictionary import ObjectDictionary, ODRecord, ODVariable

BITRATE = 1_000_000
# How long anything is waited for; only a broken run takes so long.
PATIENCE_S = 20.0


def connect(interface, channel):
    """The network on the bus that the arguments name."""
    network = canopen.Network()
    settings = {"interface": interface, "channel": channel}
    if interface == "slcan":
        # An emulated adapter needs no two seconds to start.
        settings |= {"bitrate": BITRATE, "sleep_after_open": 0.0}
    network.connect(**settings)
    return network


def variable(index, subindex, data_type, access="rw", default=None):
    """An object, or an entry of a record."""
    made = ODVariable(f"object {index:04X} {subindex:02X}", index, subindex)
    made.data_type = data_type
    made.access_type = access
    made.default = default
    return made


def record(index, entries):
    """A record of `entries`: by sub-index, what `variable` takes after that."""
    made = ODRecord(f"record {index:04X}", index)
    for subindex, entry in entries.items():
        made.add_member(variable(index, subindex, *entry))
    return made


def dictionary(objects):
    """An object dictionary of variables and records."""
    made = ObjectDictionary()
    for each in objects:
        made.add_object(each)
    return made


def wait_for(values, wanted):
    """Takes from the queue until `wanted` comes."""
    end = time.monotonic() + PATIENCE_S
    seen = []
    while time.monotonic() < end:
        try:
            value = values.get(timeout=max(0.0, end - time.monotonic()))
        except queue.Empty:
            break
        if value == wanted:
            return
        seen.append(value)
    raise RuntimeError(f"waited for {wanted}, saw {seen}")


def report(**seen):
    """One line for the test that started the program."""
    print(json.dumps(seen), flush=True)


def arguments():
    """The interface and the channel."""
    if len(sys.argv) != 3:
        sys.exit(f"usage: {sys.argv[0]} INTERFACE CHANNEL")
    return sys.argv[1:]
