"""python-canopen as the master of a CiA 401 module: node 2, whoever made it.

Boots it, reads its inputs by SDO and, once at each SYNC, by PDO; reports what it read.
"""

import queue

import canopen
from canopen.objectdictionary.datatypes import (
    INTEGER16,
    UNSIGNED8,
    UNSIGNED16,
    UNSIGNED32,
    VISIBLE_STRING,
)

import peer

NODE = 2
CHANNELS = (1, 2)
SYNCS = 20
AT_EACH_SYNC = 1


def object_dictionary():
    """The objects that this master uses."""
    parameters = {
        0: (UNSIGNED8, "ro"),
        1: (UNSIGNED32,),
        2: (UNSIGNED8,),
        3: (UNSIGNED16,),
        5: (UNSIGNED16,),
    }
    mapping = {0: (UNSIGNED8,)} | {sub: (UNSIGNED32,) for sub in range(1, 9)}
    inputs = {0: (UNSIGNED8, "ro")} | {sub: (INTEGER16, "ro") for sub in CHANNELS}
    return peer.dictionary(
        [
            peer.variable(0x1000, 0, UNSIGNED32, "ro"),
            peer.variable(0x1008, 0, VISIBLE_STRING, "const"),
            peer.record(0x1801, parameters),
            peer.record(0x1A01, mapping),
            peer.record(0x6401, inputs),
        ]
    )


def main():
    network = peer.connect(*peer.arguments())
    node = canopen.RemoteNode(NODE, object_dictionary())
    network.add_node(node)
    node.sdo.RESPONSE_TIMEOUT = peer.PATIENCE_S
    states, samples = queue.Queue(), queue.Queue()
    node.nmt.add_heartbeat_callback(states.put)
    node.nmt.state = "RESET"
    peer.wait_for(states, 0)

    inputs = node.tpdo[2]
    inputs.read()
    mapped = [[variable.index, variable.subindex] for variable in inputs]
    inputs.trans_type = AT_EACH_SYNC
    inputs.save()
    inputs.add_callback(lambda pdo: samples.put([variable.raw for variable in pdo]))
    node.nmt.state = "OPERATIONAL"
    by_pdo = []
    for _ in range(SYNCS):
        network.sync.transmit()
        by_pdo.append(samples.get(timeout=peer.PATIENCE_S))
    by_sdo = [node.sdo[0x6401][channel].raw for channel in CHANNELS]
    device = {"type": node.sdo[0x1000].raw, "name": node.sdo[0x1008].raw}
    node.nmt.state = "PRE-OPERATIONAL"
    network.disconnect()
    peer.report(
        device=device, mapped=mapped, by_pdo=by_pdo, by_sdo=by_sdo, unasked=samples.qsize()
    )


main()
