"""python-canopen's LocalNode as servo drives that follow cyclic set-points, until standard input ends.

Called as `csp_node.py INTERFACE CHANNEL EDS NODE...`: one drive for each node, with the object
dictionary of the EDS. What the EDS lacks and a master writes is added by hand and reported.

A drive here is an ideal one: it is where its set-point of the SYNC before told it to be.
Reports "ready" once all listen, and at the end what they were told.
"""

import struct
import sys

import canopen
from canopen.objectdictionary.datatypes import INTEGER32, UNSIGNED16, UNSIGNED32

import peer

# Home offset and position window; an EPOS4 has objects of its own for the first.
ADDED = {0x607C: INTEGER32, 0x6067: UNSIGNED32, 0x6068: UNSIGNED16}
POWER = {"disabled": 0x0250, "ready": 0x0231, "on": 0x0233, "enabled": 0x0237}
# Profile position, homing, cyclic synchronous position.
MODES = 1 << 0 | 1 << 5 | 1 << 7
PROFILE_POSITION, HOMING, CYCLIC = 1, 6, 8
TARGET_REACHED, BIT_12 = 1 << 10, 1 << 12
NEW_SET_POINT = 1 << 4
HOMING_SYNCS = 3
# An EPOS4 counts in turns a minute; the drive here states increments per second and per second squared.
UNITS = {0x60A9: 0x00B5_0300, 0x60AA: 0x00B5_5700}
SYNCHRONOUS = 1


class Drive:
    def __init__(self, network, node_id, eds):
        dictionary = canopen.import_od(eds, node_id)
        self.added = [index for index in ADDED if index not in dictionary]
        for index in self.added:
            dictionary.add_object(peer.variable(index, 0, ADDED[index], "rw", 0))
        self.node = network.create_node(node_id, dictionary)
        self.identify(dictionary.device_information)
        self.node.add_read_callback(self.read)
        self.mapped = False
        self.power = "disabled"
        self.mode = 0
        self.position = 0
        self.received = {}
        self.control = 0
        self.homing = 0
        self.status_bits = 0
        self.goal = 0
        self.taken = None
        # For each SYNC the set-point that was taken in mode 8; None out of it.
        self.targets = []
        self.transmissions = {}

    def identify(self, device):
        numbers = [device.vendor_number, device.product_number, device.revision_number, self.node.id]
        self.store(0x1000, 0, 0x0002_0192)
        for subindex, number in enumerate(numbers, start=1):
            self.store(0x1018, subindex, number)
        self.store(0x6502, 0, MODES)
        for index, unit in UNITS.items():
            self.store(index, 0, unit)
        self.node.set_data(0x1008, 0, device.product_name.encode())

    def store(self, index, subindex, number):
        self.node.set_data(index, subindex, struct.pack("<I", number))

    def held(self, index, subindex=0):
        variable = self.node.object_dictionary[index]
        if subindex:
            variable = variable[subindex]
        return variable.decode_raw(self.node.get_data(index, subindex))

    def read(self, index, **_):
        """What changes by itself."""
        values = {0x6041: self.status(), 0x6061: self.mode, 0x6064: self.position, 0x60F4: 0}
        return values.get(index)

    def status(self):
        return POWER[self.power] | self.status_bits

    def boot(self):
        self.node.nmt.state = "INITIALISING"
        self.node.nmt.state = "PRE-OPERATIONAL"

    def take_mapping(self):
        """What the master has written is what counts."""
        self.node.rpdo.read()
        self.node.tpdo.read()
        for pdo in self.node.rpdo.values():
            pdo.callbacks.clear()
            if pdo.enabled:
                self.transmissions[f"{pdo.cob_id - self.node.id:03X}"] = pdo.trans_type
                pdo.add_callback(self.receive)
        self.mapped = True

    def receive(self, pdo):
        self.received.update({variable.index: variable.raw for variable in pdo.map})

    def sync(self):
        if self.node.nmt.state != "OPERATIONAL":
            self.mapped = False
            self.targets.append(None)
            return
        if not self.mapped:
            self.take_mapping()
        if self.taken is not None:
            self.position = self.taken
        self.mode = self.held(0x6060)
        self.obey(self.received.get(0x6040, 0))
        for pdo in self.node.tpdo.values():
            if pdo.enabled and pdo.trans_type == SYNCHRONOUS:
                for variable in pdo.map:
                    variable.raw = self.read(variable.index)
                pdo.transmit()

    def obey(self, word):
        rose = bool(word & ~self.control & NEW_SET_POINT)
        self.control = word
        self.change_power(word)
        cyclic = self.power == "enabled" and self.mode == CYCLIC
        self.taken = self.received.get(0x607A) if cyclic else None
        self.targets.append(self.taken)
        self.status_bits = 0
        if self.power != "enabled":
            self.goal = self.position
        elif cyclic:
            self.status_bits = BIT_12
            self.goal = self.position
        elif self.mode == HOMING:
            self.home(rose)
        elif self.mode == PROFILE_POSITION:
            self.go(rose, word)

    def change_power(self, word):
        if not word & 0x02 or not word & 0x04:
            self.power = "disabled"
            return
        wanted = {0x06: "ready", 0x07: "on", 0x0F: "enabled"}.get(word & 0x0F)
        order = list(POWER)
        if wanted is not None:
            # One state further at a time, any number back.
            reach = order.index(self.power) + 1
            self.power = order[min(order.index(wanted), reach)]

    def home(self, rose):
        if rose:
            self.homing = HOMING_SYNCS
        elif self.homing > 0:
            self.homing -= 1
            if self.homing == 0:
                self.position = self.held(0x607C)
        done = self.homing == 0 and self.control & NEW_SET_POINT
        self.status_bits = BIT_12 | TARGET_REACHED if done else 0
        self.goal = self.position

    def go(self, rose, word):
        if rose:
            self.goal = self.received[0x607A]
        self.status_bits = BIT_12 if word & NEW_SET_POINT else 0
        # As far as its speed takes it from SYNC to SYNC.
        period_s = self.held(0x60C2, 1) * 10.0 ** self.held(0x60C2, 2) or 0.01
        reach = max(1, int(self.held(0x6081) * period_s))
        self.position += max(-reach, min(reach, self.goal - self.position))
        if self.position == self.goal and not rose:
            self.status_bits |= TARGET_REACHED

    def report(self):
        return {
            "period": [self.held(0x60C2, 1), self.held(0x60C2, 2)],
            "rpdos": self.transmissions,
            "targets": self.targets,
        }


def main():
    interface, channel, eds, *nodes = sys.argv[1:]
    network = peer.connect(interface, channel)
    drives = [Drive(network, int(node), eds) for node in nodes]

    def on_sync(*_):
        for drive in drives:
            drive.sync()

    network.subscribe(0x80, on_sync)
    for drive in drives:
        drive.boot()
    device = drives[0].node.object_dictionary.device_information
    peer.report(ready=True, product=device.product_name, added=drives[0].added)
    sys.stdin.read()
    network.disconnect()
    peer.report(drives=[drive.report() for drive in drives])


main()
