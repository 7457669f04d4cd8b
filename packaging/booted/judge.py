"""Judges, from within a system that systemd has booted, what it makes of the unit (packaging/try-systemd).

The emulated machine runs beside it, in real time. Each line that is printed was seen; the first that was not ends
this with the journal.
"""

import contextlib
import grp
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

TRY = pathlib.Path("/try")
DEB = TRY / "truestage.deb"
UNIT = "truestage@stage.service"
MACHINE = pathlib.Path("/etc/truestage/stage.toml")
SOCKET = pathlib.Path("/run/truestage/stage/truestage.sock")
RECORDS = pathlib.Path("/var/lib/truestage")
DROP_INS = pathlib.Path("/run/systemd/system")
HAS_VCAN = pathlib.Path("/sys/class/net/vcan0").exists()
ADAPTER = "/dev/truestage/slcan-TRY"
LASER = "/dev/truestage/teensy-TRY"
# A serial device that the machine file does not use.
SPARE = "/dev/truestage/ftdi-TRY-00"
# As the package lays them (command/Cargo.toml, packaging/check).
FILES = {
    "truestage": "/usr/bin/truestage",
    "truestage@.service": "/usr/lib/systemd/system/truestage@.service",
    "truestage.sysusers": "/usr/lib/sysusers.d/truestage.conf",
    "truestage.tmpfile": "/usr/lib/tmpfiles.d/truestage.conf",
    "70-truestage.rules": "/usr/lib/udev/rules.d/70-truestage.rules",
    "configs/machines/linear.toml": "/usr/share/doc/truestage/examples/linear.toml",
}
# Without it the limits of the unit remain those of who started this: nobody else may raise them.
CAP_SYS_RESOURCE = 24
NOBODY = 65534
# The emulated drives share the processors with everything else here: they are waited for a second longer.
PATIENCE = "--clock-speed 1.001"
PATIENCE_S = 120.0
# What the stage is still when it does not move: less than the noise of one count.
STILL_MM = 0.001


class NotSeen(Exception):
    """What ends the trial."""


def seen(sentence):
    print(f"{time.monotonic() - BEGIN:6.1f} s  {sentence}")


def expect(is_so, sentence, found=""):
    if not is_so:
        raise NotSeen(f"{sentence}: {found}")
    seen(sentence)


def run(*words, code=0, **options):
    done = subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE_S, **options)
    if code is not None and done.returncode != code:
        said = f"{done.stdout}{done.stderr}".strip()
        raise NotSeen(f"{' '.join(words)}: exit code {done.returncode}, expected {code}: {said}")
    return done.stdout


def wait_until(is_so, sentence, span_s=PATIENCE_S):
    until = time.monotonic() + span_s
    while time.monotonic() < until:
        if is_so():
            return
        time.sleep(0.05)
    raise NotSeen(f"within {span_s} s not: {sentence}")


def shown(unit=UNIT):
    """What systemd says of a unit."""
    lines = run("systemctl", "show", unit).splitlines()
    return dict(line.split("=", 1) for line in lines if "=" in line)


def drop_in(name, text, unit=UNIT):
    """As `systemctl edit --runtime` would."""
    folder = DROP_INS / f"{unit}.d"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.conf").write_text(text)
    run("systemctl", "daemon-reload")


# --- who asks


def as_member(*words):
    """As somebody in the group that may ask the service, and in no other."""
    group = grp.getgrnam("truestage").gr_gid
    return ["setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", f"--groups={group}", *words]


def as_stranger(*words):
    return ["setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups", *words]


def curl(path, body=None):
    words = ["curl", "-sS", "--max-time", "100", "--unix-socket", str(SOCKET), f"http://x/v1{path}"]
    if body is not None:
        words += ["-H", "content-type: application/json", "-d", json.dumps(body)]
    return words


def ask(path, body=None):
    return json.loads(run(*as_member(*curl(path, body))))


def axis():
    return ask("/axes/x")


def truth_mm():
    """Where the stage is, by the emulated machine."""
    told = run(str(TRY / "mock-bus"), "ctl", "/run/hand", "truth")
    return json.loads(told)["position_mm"]


def is_still():
    before = truth_mm()
    time.sleep(0.2)
    return abs(truth_mm() - before) < STILL_MM


def zero():
    run_ = ask("/runs", {"kind": "zero", "start": True})
    ended = ask(f"/runs/{run_['id']}?wait_s=90")
    expect(ended.get("state") == "done", "it finds its zero", ended)


def move(millimetres, **more):
    body = {"targets": {"x": f"{millimetres}mm"}, "uncompensated": True, **more}
    begun = ask("/motions", body)
    if "id" not in begun:
        raise NotSeen(f"a motion to {millimetres} mm: {begun}")
    return begun["id"]


def slow_motion():
    """A motion that is under way, and takes half a minute."""
    ident = move(60, speed="1mm/s")
    wait_until(lambda: not is_still(), "it moves")
    return ident


# --- what is tried


def install():
    if DEB.exists():
        run("dpkg", "-i", str(DEB))
        seen("dpkg installs the package")
    else:
        for source, place in FILES.items():
            target = pathlib.Path(place)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(TRY / source, target)
        run("systemd-sysusers", FILES["truestage.sysusers"])
        run("systemd-tmpfiles", "--create", FILES["truestage.tmpfile"])
        run("systemctl", "daemon-reload")
        seen("its files lie where the package has them, without dpkg")
    groups = run("id", "-nG", "truestage").split()
    expect({"truestage", "dialout"} <= set(groups), "the user is in dialout", groups)


def configure():
    text = pathlib.Path(FILES["configs/machines/linear.toml"]).read_text()
    bus = f'transport = "slcan"            # "slcan" (serial adapter) or "socketcan"\npath = "/dev/ttyACM1"'
    if bus not in text or '"/dev/ttyACM0"' not in text:
        raise NotSeen("the shipped linear.toml has other ports than this knows")
    other = 'transport = "socketcan"\ninterface = "vcan0"' if HAS_VCAN else f'transport = "slcan"\npath = "{ADAPTER}"'
    MACHINE.write_text(text.replace(bus, other).replace("/dev/ttyACM0", LASER))
    wait_until(lambda: pathlib.Path("/run/hand").exists(), "the emulated machine is there")
    seen(f"the shipped linear.toml, its bus on {'vcan0' if HAS_VCAN else 'an SLCAN terminal'}")


def starts():
    """`systemctl start` returns when the machine is there and the service listens: Type=notify."""
    run("systemctl", "start", UNIT)
    state = shown()
    expect(state["ActiveState"] == "active" and SOCKET.is_socket(), "ready means that it listens", state)
    expect(state["StatusText"].startswith("running; x "), f"its status is `{state['StatusText']}`")
    places = {SOCKET: "660", SOCKET.parent: "750", RECORDS: "750"}
    for place, mode in places.items():
        found = run("stat", "-c", "%a %U %G", str(place)).strip()
        expect(found == f"{mode} truestage truestage", f"{place} is {found}", f"{mode} expected")


def has_patience():
    line = next(it for it in (TRY / "truestage@.service").read_text().splitlines() if it.startswith("ExecStart="))
    drop_in("patience", f"[Service]\nExecStart=\n{line} {PATIENCE}\n")
    seen(f"the unit's own command with `{PATIENCE}`")


def is_asked():
    machine = ask("/machine")
    expect(machine.get("state") == "running", "a member of the group asks it with curl", machine)
    refused = subprocess.run(as_stranger(*curl("/machine")), capture_output=True, text=True)
    expect(refused.returncode == 7, "a stranger does not reach it", refused)
    status = run(*as_member("truestage", "status", "--at", f"unix:{SOCKET}"))
    expect(status.startswith("machine linear"), "`truestage status` shows it", status)


def is_locked_in():
    """What the kernel says of the process."""
    pid = shown()["MainPID"]
    status = pathlib.Path(f"/proc/{pid}/status").read_text()
    of = dict(re.findall(r"^(\w+):\s*(.*)$", status, re.M))
    expect(of["NoNewPrivs"] == "1" and of["Seccomp"] == "2", "no new privileges, system calls filtered", of)
    expect(int(of["CapBnd"], 16) == 0 and of["Uid"].split()[0] != "0", "no capability, not root", of)
    if not may_raise_limits():
        return
    threads = run("ps", "-L", "-o", "cls=,rtprio=,comm=", "-p", pid).splitlines()
    fifo = [line.split() for line in threads if line.split()[0] == "FF"]
    expect(fifo, f"{len(fifo)} threads have SCHED_FIFO: {' '.join(sorted({it[2] for it in fifo}))}", threads)


def may_raise_limits():
    status = pathlib.Path("/proc/1/status").read_text()
    return bool(int(re.search(r"CapBnd:\s*(\w+)", status).group(1), 16) >> CAP_SYS_RESOURCE & 1)


def is_kept_from_others():
    """The same sandbox, with a program that tries what the service must be able to do, and what nobody should."""
    unit = "truestage@probe.service"
    shutil.copy(MACHINE, MACHINE.with_name("probe.toml"))
    drop_in("probe", "[Service]\nType=oneshot\nWatchdogSec=0\nRestart=no\nExecStart=\n"
            f"Environment=TRY_TERMINAL={SPARE} TRY_REAL_TIME={int(may_raise_limits())}\n"
            f"BindReadOnlyPaths={TRY}\nExecStart=/usr/bin/python3 {TRY}/sandbox.py\n", unit)
    done = subprocess.run(["systemctl", "start", unit], capture_output=True, text=True)
    told = run("journalctl", "-q", "-o", "cat", "-u", unit)
    for line in told.splitlines():
        if line.startswith("sandbox: "):
            seen(line)
    expect(done.returncode == 0, "the sandbox lets the service work, and no more", told)


def moves():
    zero()
    said = run(*as_member("truestage", "move", str(MACHINE), "x=12.5mm", "--uncompensated", "--yes"))
    expect("12.5" in said and abs(truth_mm_at_rest() - 12.5) < 0.1,
           f"`truestage move` goes through it: {' '.join(said.split())}", said)


def truth_mm_at_rest():
    wait_until(is_still, "it stands")
    return truth_mm()


def ends_in_motion():
    ident = slow_motion()
    run("systemctl", "stop", UNIT)
    expect(is_still(), "`systemctl stop` in a motion: the stage stands", truth_mm())
    state = shown()
    expect(state["Result"] == "success" and state["ExecMainStatus"] == "0", "it ended in order", state)
    expect(not SOCKET.parent.exists(), "its place in /run is gone")
    ledger = (RECORDS / "linear-TS-LIN-0001/service/ledger.jsonl")
    ledgers = [ledger] if ledger.exists() else list(RECORDS.rglob("ledger.jsonl"))
    told = [line for line in ledgers[0].read_text().splitlines() if f'"{ident}"' in line]
    expect('"stopped"' in told[-1], "the motion has ended as stopped, in the records", told)


def is_killed_in_motion():
    """The zero is a motion, too: nothing needs to be zeroed before it."""
    run("systemctl", "start", UNIT)
    state = axis()
    expect(state["homed"] is False, "after a start the axis has no zero", state)
    ask("/runs", {"kind": "zero", "start": True})
    wait_until(lambda: not is_still(), "it moves")
    run("systemctl", "kill", "--kill-whom=main", "--signal=KILL", UNIT)
    killed = time.monotonic()
    time.sleep(0.9)
    expect(is_still(), "`kill -9` in a motion: the drive has stopped by itself 0.9 s later", truth_mm())
    wait_until(lambda: int(shown()["NRestarts"]) > 0 and shown()["ActiveState"] == "active", "it is started again")
    seen(f"systemd has started it again {time.monotonic() - killed:.1f} s later")
    expect(is_still() and axis()["homed"] is False, "nothing moves then, and the axis has no zero")


def is_watched():
    """A process that hangs tells nothing."""
    drop_in("watchdog", "[Service]\nWatchdogSec=2s\n")
    run("systemctl", "restart", UNIT)
    before = shown()["MainPID"]
    time.sleep(5)
    expect(shown()["MainPID"] == before, "the watchdog is content while the machine is kept")
    run("systemctl", "kill", "--kill-whom=main", "--signal=STOP", UNIT)
    wait_until(lambda: shown()["Result"] == "watchdog" or shown()["MainPID"] not in ("0", before),
               "the watchdog ends what hangs")
    wait_until(lambda: shown()["ActiveState"] == "active" and shown()["MainPID"] != before, "it is back")
    told = run("journalctl", "-q", "-o", "cat", "-u", UNIT)
    expect("Watchdog timeout" in told, "what hangs is ended by the watchdog, and started again")


def is_not_tried_again():
    """A second one for the same machine is refused (3); a wrong configuration cannot be run (2)."""
    shutil.copy(MACHINE, MACHINE.with_name("twin.toml"))
    MACHINE.with_name("wrong.toml").write_text(MACHINE.read_text() + "\nnonsense = 1\n")
    for name, code in (("twin", "3"), ("wrong", "2")):
        unit = f"truestage@{name}.service"
        run("systemctl", "start", unit, code=None)
        time.sleep(1)
        state = shown(unit)
        is_so = state["ExecMainStatus"] == code and state["NRestarts"] == "0" and state["ActiveState"] == "failed"
        expect(is_so, f"{name}.toml: exit code {code}, not started again", state)
    run("systemctl", "start", "truestage@absent.service", code=None)
    state = shown("truestage@absent.service")
    expect(state["AssertResult"] == "no", "without a machine file nothing is started", state)


def loses_its_machine():
    """The machine loses its power: a failure of the bus, not of the service."""
    run("systemctl", "stop", "emulated.service")
    wait_until(lambda: "failure" in shown()["StatusText"] or shown()["ActiveState"] != "active", "it is told")
    seen(f"its machine is gone: {shown()['ActiveState']}, `{shown()['StatusText']}`")
    wait_until(lambda: "disappeared" in run("journalctl", "-q", "-o", "cat", "-p", "err", "-u", UNIT), "an error of the journal")
    seen("`journalctl -p err` says why")
    run("systemctl", "stop", UNIT)
    state = shown()
    seen(f"`systemctl stop` without a machine: {state['Result']}, exit code {state['ExecMainStatus']}")


def is_in_the_journal():
    lines = [json.loads(line) for line in run("journalctl", "-q", "-o", "json", "-u", UNIT).splitlines()]
    said = [str(line["MESSAGE"]) for line in lines if line.get("SYSLOG_IDENTIFIER") == "truestage"]
    expect(f"listening at unix:{SOCKET}" in said, "the journal says where it listens", said)
    kinds = {line["TRUESTAGE_KIND"] for line in lines if "TRUESTAGE_KIND" in line}
    expect({"machine", "motion", "run", "stop"} <= kinds, f"it has entries with fields of: {', '.join(sorted(kinds))}", said)
    wanted = run("journalctl", "-q", "-o", "cat", "-u", UNIT, "TRUESTAGE_KIND=stop")
    expect("stop: quick by a signal" in wanted, "`journalctl TRUESTAGE_KIND=stop` has who stopped it", wanted)


def is_free_for_verbs():
    """While the service is stopped, verbs open the machine themselves, as the user that the records belong to."""
    run("systemctl", "start", "emulated.service")
    wait_until(lambda: pathlib.Path(LASER).exists(), "the emulated machine is back")
    said = run("setpriv", "--reuid=truestage", "--regid=truestage", "--init-groups", "truestage", "scan", str(MACHINE))
    expect("product 0x420001" in said, "`truestage scan` by the service's user finds the drive", said)


def is_updated_and_removed():
    if not DEB.exists():
        return
    run("systemctl", "start", UNIT)
    before = shown()["MainPID"]
    run("dpkg", "-i", str(DEB))
    expect(shown()["MainPID"] == before, "an update of the package does not stop the machine")
    run("dpkg", "-r", "truestage")
    expect(shown()["ActiveState"] == "inactive", "removing the package stops the machine")
    expect(RECORDS.exists() and MACHINE.exists(), "and leaves records and machine files")


def main():
    try:
        for part in (install, configure, has_patience, starts, is_asked, is_locked_in, is_kept_from_others, moves,
                     ends_in_motion, is_killed_in_motion, is_watched, is_not_tried_again, is_in_the_journal,
                     loses_its_machine, is_free_for_verbs, is_updated_and_removed):
            part()
    except (NotSeen, subprocess.TimeoutExpired) as error:
        print(f"FAILED: {error}")
        with contextlib.suppress(NotSeen):
            print(run("journalctl", "-q", "-n", "40", "-o", "short-monotonic", "-u", "truestage@*"))
        return 1
    if not may_raise_limits():
        print("NOT RUN: LimitRTPRIO and LimitMEMLOCK: this computer's root may not raise them (CAP_SYS_RESOURCE)")
    if not DEB.exists():
        print("NOT RUN: dpkg: no package was given")
    if not HAS_VCAN:
        print("NOT RUN: SocketCAN under the unit: no vcan in this kernel (tests/uml/run packaging/try-systemd)")
    return 0


BEGIN = time.monotonic()
sys.exit(main())
