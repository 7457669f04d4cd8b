"""What the unit's sandbox allows: run in the place of the service. Exit code 1: it allows too much or too little."""

import ctypes
import errno
import mmap
import os
import socket
import sys
import termios

CAN = getattr(socket, "AF_CAN", 29)
# <sys/mman.h>
MCL_CURRENT, MCL_FUTURE = 1, 2


def opens(path, flags=os.O_RDWR | os.O_NOCTTY):
    def attempt():
        os.close(os.open(path, flags))

    return attempt


def serial():
    line = os.open(os.environ["TRY_TERMINAL"], os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    termios.tcgetattr(line)
    os.close(line)


def writes(path):
    return lambda: opens(path, os.O_WRONLY | os.O_CREAT)()


def family(number, kind, protocol=0):
    return lambda: socket.socket(number, kind, protocol).close()


def can():
    try:
        socket.socket(CAN, socket.SOCK_RAW, 1).close()
    except OSError as error:
        # The kernel has none; a filter says EPERM or EAFNOSUPPORT, which only the former tells apart.
        if error.errno != errno.EAFNOSUPPORT or os.path.exists("/sys/class/net/vcan0"):
            raise


def loopback():
    with socket.create_server(("127.0.0.1", 0)) as server:
        with socket.create_connection(server.getsockname(), timeout=2):
            server.accept()


def outside():
    """To an address of documentation (RFC 5737), which leads nowhere: what matters is who says no."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as far:
        far.connect(("192.0.2.1", 9))
        far.send(b"")


def real_time():
    if not int(os.environ["TRY_REAL_TIME"]):
        return
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(90))
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


def locked_memory():
    if int(os.environ["TRY_REAL_TIME"]) and ctypes.CDLL(None).mlockall(MCL_CURRENT | MCL_FUTURE) != 0:
        raise OSError("mlockall")


def executable_memory():
    mmap.mmap(-1, 4096, prot=mmap.PROT_WRITE | mmap.PROT_EXEC).close()


def lists_home():
    if not os.listdir("/root"):
        raise PermissionError("it is empty")


NEEDED = {
    "a serial line of the group dialout": serial,
    "/dev/null": opens("/dev/null"),
    "its records": writes("/var/lib/truestage/tried"),
    "its records, by way of /etc/truestage": writes("/etc/truestage/machine-data/tried"),
    "a folder for temporary files": writes("/tmp/tried"),
    "a raw CAN socket": can,
    "TCP on loopback": loopback,
    "SCHED_FIFO 90": real_time,
    "locked memory": locked_memory,
}
REFUSED = {
    "another character device": opens("/dev/kmsg-try"),
    "the kernel's memory of messages": opens("/dev/kmsg", os.O_RDONLY),
    "/etc": writes("/etc/truestage/tried"),
    "/usr": writes("/usr/bin/tried"),
    "/var beside its own": writes("/var/lib/tried"),
    "homes": lists_home,
    "the kernel's settings": opens("/proc/sys/kernel/hostname", os.O_WRONLY),
    "raw packets": family(socket.AF_PACKET, socket.SOCK_RAW),
    "netlink": family(socket.AF_NETLINK, socket.SOCK_RAW),
    "packets to other computers": outside,
    "memory that is both written and executed": executable_memory,
}


def why_not(attempt):
    try:
        attempt()
    except (OSError, ValueError) as error:
        return str(error)
    return None


def main():
    wrong = 0
    for what, attempt in NEEDED.items():
        why = why_not(attempt)
        wrong += why is not None
        print(f"sandbox: {what}: {'allowed' if why is None else f'NOT ALLOWED, but needed: {why}'}")
    for what, attempt in REFUSED.items():
        why = why_not(attempt)
        wrong += why is None
        print(f"sandbox: {what}: {'ALLOWED, and should not be' if why is None else f'refused ({why})'}")
    return wrong > 0


sys.exit(main())
