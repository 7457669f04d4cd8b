"""Sends one frame from one raw CAN socket to another: does this machine have SocketCAN?"""

import socket
import struct
import sys

CHANNEL = "vcan0"
FRAME = struct.pack("=IB3x8s", 0x123, 8, b"truestag")


def raw_socket():
    """A raw CAN socket on the channel that gives up after two seconds."""
    can = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    can.settimeout(2)
    can.bind((CHANNEL,))
    return can


with raw_socket() as sender, raw_socket() as receiver:
    sender.send(FRAME)
    received = receiver.recv(len(FRAME))
if received != FRAME:
    sys.exit(f"{CHANNEL}: sent {FRAME.hex()}, received {received.hex()}")
