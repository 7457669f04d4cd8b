"""SDO round trips by python-canopen: `python_client.py INTERFACE COUNT` prints the seconds taken."""

import json
import sys
import time

import canopen

NODE = 2
VALUE = (0x00020192).to_bytes(4, "little")
WARM_UP = 50


def main(interface, count):
    network = canopen.Network()
    network.connect(interface="socketcan", channel=interface)
    sdo = network.add_node(canopen.RemoteNode(NODE, canopen.ObjectDictionary())).sdo

    def read(times):
        for _ in range(times):
            if sdo.upload(0x1000, 0) != VALUE:
                sys.exit("the server answered wrong")

    read(WARM_UP)
    begin = time.perf_counter()
    read(count)
    seconds = time.perf_counter() - begin
    network.disconnect()
    print(json.dumps({"seconds": seconds}))


main(sys.argv[1], int(sys.argv[2]))
