"""python-canopen as the master of a CiA 402 drive: node 1, whoever made it.

Boots it, remaps its PDOs, moves, homes, transfers by every SDO method, makes it fail and
clears the failure; reports what it saw and leaves the judgement to the test.
"""

import queue
import time

from canopen.objectdictionary.datatypes import (
    INTEGER8,
    INTEGER32,
    OCTET_STRING,
    UNSIGNED8,
    UNSIGNED16,
    UNSIGNED32,
    VISIBLE_STRING,
)
from canopen.profiles.p402 import BaseNode402
from canopen.sdo import SdoAbortedError

import peer

NODE = 1
HEARTBEAT_MS = 50
STATUS_MS = 20
BIG = 0x2000
NOTEBOOK = 0x2001
NEW_SET_POINT = 0x10
RELATIVE = 0x40
ACKNOWLEDGED = 1 << 12
TARGET_REACHED = 1 << 10
HOMING_MASK = 0x3400
HOMING_DONE = 0x1400
HOMING_ERROR = 0x2000
FOLLOWING_ERROR = 0x8611


class Drive(BaseNode402):
    """The library's drive, with time for a machine that is busy."""

    TIMEOUT_SWITCH_OP_MODE = peer.PATIENCE_S
    TIMEOUT_SWITCH_STATE_FINAL = peer.PATIENCE_S
    TIMEOUT_SWITCH_STATE_SINGLE = peer.PATIENCE_S
    TIMEOUT_CHECK_TPDO = peer.PATIENCE_S


def object_dictionary():
    """The objects that this master uses; nothing of it comes from the drive's maker."""
    objects = [
        peer.variable(0x1000, 0, UNSIGNED32, "ro"),
        peer.variable(0x1008, 0, VISIBLE_STRING, "const"),
        peer.variable(0x1017, 0, UNSIGNED16),
        peer.record(0x1018, {0: (UNSIGNED8,)} | {sub: (UNSIGNED32,) for sub in range(1, 5)}),
        peer.variable(BIG, 0, OCTET_STRING, "ro"),
        peer.variable(NOTEBOOK, 0, OCTET_STRING),
        peer.variable(0x6040, 0, UNSIGNED16),
        peer.variable(0x6041, 0, UNSIGNED16, "ro"),
        peer.variable(0x6060, 0, INTEGER8),
        peer.variable(0x6061, 0, INTEGER8, "ro"),
        peer.variable(0x6064, 0, INTEGER32, "ro"),
        peer.variable(0x6065, 0, UNSIGNED32),
        peer.variable(0x6066, 0, UNSIGNED16),
        peer.variable(0x606C, 0, INTEGER32, "ro"),
        peer.variable(0x607A, 0, INTEGER32),
        peer.variable(0x607C, 0, INTEGER32),
        peer.variable(0x60FF, 0, INTEGER32),
        peer.variable(0x6081, 0, UNSIGNED32),
        peer.variable(0x6098, 0, INTEGER8),
        peer.variable(0x6502, 0, UNSIGNED32, "ro"),
    ]
    parameters = {
        0: (UNSIGNED8, "ro"),
        1: (UNSIGNED32,),
        2: (UNSIGNED8,),
        3: (UNSIGNED16,),
        5: (UNSIGNED16,),
    }
    mapping = {0: (UNSIGNED8,)} | {sub: (UNSIGNED32,) for sub in range(1, 9)}
    for number in range(4):
        for base in (0x1400, 0x1800):
            objects.append(peer.record(base + number, parameters))
        for base in (0x1600, 0x1A00):
            objects.append(peer.record(base + number, mapping))
    return peer.dictionary(objects)


def wait_for_status(node, what, accept):
    """Looks at statuswords as they come until one is accepted."""
    end = time.monotonic() + peer.PATIENCE_S
    while time.monotonic() < end:
        status = node.check_statusword()
        if accept(status):
            return status
    raise RuntimeError(f"no {what}, the last statusword is {status:04X}")


def boot(node, states):
    """A reset, the boot-up message and the first heartbeat."""
    node.nmt.state = "RESET"
    peer.wait_for(states, 0)
    node.sdo[0x1017].raw = HEARTBEAT_MS
    peer.wait_for(states, 127)


def map_pdos(node):
    """One PDO each way, in the standard's order, then read back from the drive."""
    node.pdo.read()
    for pdo in (*node.rpdo.values(), *node.tpdo.values()):
        pdo.enabled = False
    command, status = node.rpdo[1], node.tpdo[1]
    for pdo, indices in ((command, (0x6040, 0x6060, 0x607A)), (status, (0x6041, 0x6061, 0x6064))):
        pdo.clear()
        for index in indices:
            pdo.add_variable(index)
        pdo.enabled = True
        pdo.trans_type = 255
    # The library takes a PDO that came twice for a periodic one: then let it be one.
    status.event_timer = STATUS_MS
    for pdo in (*node.rpdo.values(), *node.tpdo.values()):
        pdo.save()
    node.setup_402_state_machine()
    return {
        "enabled": [pdo.enabled for pdo in (*node.rpdo.values(), *node.tpdo.values())],
        "command": [variable.index for variable in command],
        "status": [variable.index for variable in status],
        "event_timer_ms": status.event_timer,
    }


def set_point(node, target, bits=0):
    """One target with the whole handshake; returns the position where it was reached."""
    node.rpdo[1][0x607A].raw = target
    node.controlword = 0x0F | NEW_SET_POINT | bits
    wait_for_status(node, "acknowledgement", lambda status: status & ACKNOWLEDGED)
    node.controlword = 0x0F
    wait_for_status(node, "end of it", lambda status: not status & ACKNOWLEDGED)
    wait_for_status(node, "target reached", lambda status: status & TARGET_REACHED)
    return node.sdo[0x6064].raw


def home_here(node, position):
    """Method 37: here is `position`."""
    node.sdo[0x607C].raw = position
    node.sdo[0x6098].raw = 37
    node.op_mode = "HOMING"
    node.controlword = 0x0F | NEW_SET_POINT
    status = wait_for_status(
        node,
        "homing attained",
        lambda status: status & HOMING_ERROR or status & HOMING_MASK == HOMING_DONE,
    )
    homed = node.is_homed()
    node.controlword = 0x0F
    return {"status": status & HOMING_MASK, "homed": homed, "position": node.sdo[0x6064].raw}


def transfers(node):
    """Every way to carry a value, both directions."""
    with node.sdo.open(BIG, 0, "rb", buffering=0, block_transfer=True) as stream:
        big = stream.read()
        announced, crc = stream.size, stream.crc_supported
    segmented_big = node.sdo.upload(BIG, 0)
    line = b"written in segments by another master"
    node.sdo.download(NOTEBOOK, 0, line)
    read_back = node.sdo.upload(NOTEBOOK, 0)
    book = bytes((place * 31 + place // 251) & 0xFF for place in range(4096))
    with node.sdo.open(NOTEBOOK, 0, "wb", size=len(book), block_transfer=True) as stream:
        stream.write(book)
    with node.sdo.open(NOTEBOOK, 0, "rb", buffering=0, block_transfer=True) as stream:
        book_back = stream.read()
    node.sdo.download(NOTEBOOK, 0, b"four")
    return {
        "device_name": node.sdo[0x1008].raw,
        "device_type": node.sdo[0x1000].raw,
        "identity": [node.sdo[0x1018][sub].raw for sub in range(1, 5)],
        "big": big.hex(),
        "big_announced": announced,
        "big_crc": crc,
        "big_in_segments_too": segmented_big == big,
        "segments_came_back": read_back == line,
        "blocks_came_back": book_back == book,
        "expedited_came_back": node.sdo.upload(NOTEBOOK, 0) == b"four",
    }


def abort_code(action):
    """What the drive aborts with."""
    try:
        action()
    except SdoAbortedError as error:
        return error.code
    return None


def aborts(node):
    """Requests that cannot be granted."""
    return {
        "no_object": abort_code(lambda: node.sdo.upload(0x5FFF, 0)),
        "no_sub_index": abort_code(lambda: node.sdo.upload(0x1018, 9)),
        "read_only": abort_code(lambda: node.sdo.download(0x6041, 0, b"\0\0")),
        "too_long": abort_code(lambda: node.sdo.download(0x6081, 0, bytes(8), True)),
        "value": abort_code(lambda: node.sdo.download(0x6098, 0, b"\x03")),
    }


def fail_and_recover(node, emergencies):
    """A following error that no drive could keep, its emergency, and the reset."""
    window = node.sdo[0x6065].raw
    timeout = node.sdo[0x6066].raw
    node.sdo[0x6066].raw = 0
    node.sdo[0x6065].raw = 1
    node.op_mode = "PROFILED POSITION"
    node.rpdo[1][0x607A].raw = 0
    node.controlword = 0x0F | NEW_SET_POINT
    peer.wait_for(emergencies, FOLLOWING_ERROR)
    active = [error.code for error in node.emcy.active]
    wait_for_status(node, "fault", lambda status: status & 0x4F == 0x08)
    state = node.state
    node.sdo[0x6065].raw = window
    node.sdo[0x6066].raw = timeout
    node.controlword = 0x00
    node.state = "SWITCH ON DISABLED"
    peer.wait_for(emergencies, 0)
    return {
        "emergencies": active,
        "state": state,
        "state_after": node.state,
        "emergencies_after": len(node.emcy.active),
    }


def main():
    network = peer.connect(*peer.arguments())
    node = Drive(NODE, object_dictionary())
    network.add_node(node)
    node.sdo.RESPONSE_TIMEOUT = peer.PATIENCE_S
    states, emergencies = queue.Queue(), queue.Queue()
    node.nmt.add_heartbeat_callback(states.put)
    node.emcy.add_callback(lambda error: emergencies.put(error.code))

    boot(node, states)
    sdo = transfers(node)
    aborted = aborts(node)
    pdos = map_pdos(node)
    node.nmt.state = "OPERATIONAL"
    peer.wait_for(states, 5)

    node.op_mode = "PROFILED POSITION"
    node.state = "OPERATION ENABLED"
    enabled = node.state
    started_at = node.sdo[0x6064].raw
    absolute = set_point(node, started_at + 300_000)
    relative = set_point(node, -100_000, RELATIVE)
    homing = home_here(node, 12_345)
    failure = fail_and_recover(node, emergencies)

    node.nmt.state = "PRE-OPERATIONAL"
    peer.wait_for(states, 127)
    node.sdo[0x1017].raw = 0
    network.disconnect()
    peer.report(
        sdo=sdo,
        aborts=aborted,
        pdos=pdos,
        enabled=enabled,
        started_at=started_at,
        absolute=absolute,
        relative=relative,
        homing=homing,
        failure=failure,
    )


main()
