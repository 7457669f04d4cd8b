"""A person at the page of `truestage serve`, in headless Chromium: zero, calibrate, move, a job that is read from a file and
answered, a lost connection, verify; what is drawn, in a narrow window, in the dark and by keyboard. Then three axes, which follow a
path from a file.

    page_judge.py PROGRAMS CHROMIUM

PROGRAMS is the folder with `truestage` and `mock-bus`. The last line is a report in JSON.
"""

import base64
import json
import os
import sys
import time
from pathlib import Path

from browser import Browser
from kept_machine import PATIENCE_S, KeptMachine, Pace, Truth, wait_for

NEWEST = "document.querySelector('#runs article')"
LIVE = "#axes canvas.live-position"
JOB = """schema_version = 1
axis = "x"
settle_ms = 20
[[point]]
name = "load"
position_mm = 5.0
go_on = { operator = "lay a part on the stage" }
[[point]]
position_mm = 12.5
"""
PATH = "time_s,x_mm,y_mm,z_mm\n0,5,5,5\n2,9,5,5\n4,9,9,5\n"
# Where its last row ends.
PATH_END = (9, 9, 5)
# Three axes with rare SYNCs: how well they follow is judged elsewhere.
RARE_SYNCS = (
    ("sync_period_ms = 2.0", "sync_period_ms = 60.0"),
    ("every_syncs = 10", "every_syncs = 1"),
    ("age_max_ms = 100.0", "age_max_ms = 2000.0"),
    ("following_error_timeout_ms = 20", "following_error_timeout_ms = 2000"),
    ("following_error_limit_um = 500.0", "following_error_limit_um = 50000.0"),
    ("deviation_limit_um = 500.0", "deviation_limit_um = 50000.0"),
)
# Where pictures of the page go, for people who want to look at them.
SHOTS = os.environ.get("TRUESTAGE_SHOTS")


class Person:
    """Who looks at the page and presses its buttons."""

    def __init__(self, browser, pace):
        self.browser = browser
        self.pace = pace

    def take_control(self):
        take = "document.getElementById('take')"
        if self.browser.value(f"{take}.hidden"):
            # While time passed freely the lease may have lapsed, of which the page hears with its next order.
            self.browser.value("document.getElementById('give').click()")
            self.browser.wait_for("no control", f"!{take}.hidden")
        self.browser.value(f"{take}.click()")
        self.browser.wait_for("control, or a question", f"{take}.hidden || {take}.dataset.sure === 'yes'")
        if not self.browser.value(f"{take}.hidden"):
            self.browser.value(f"{take}.click()")
            self.browser.wait_for("control", f"{take}.hidden")

    def robbed(self, kept):
        """Somebody else takes control by force, and it is taken back; what the button says meanwhile."""
        self.take_control()
        take = "document.getElementById('take')"
        kept.ask("POST", "/v1/lease", {"name": "anna", "seconds": 3600, "force": True})
        lost = self.browser.wait_for("word of it", f"!{take}.hidden && {take}.textContent.includes('anna') && {take}.textContent")
        self.browser.value(f"{take}.click()")
        asked = self.browser.wait_for("a question", f"{take}.dataset.sure === 'yes' && {take}.textContent")
        held = kept.ask("GET", "/v1/machine")["lease"]["name"]
        self.browser.value(f"{take}.click()")
        self.browser.wait_for("control", f"{take}.hidden")
        return [lost, asked, held]

    def run(self, kind):
        """Plans a run, starts it, and waits for its end; what the page says of it then."""
        self.take_control()
        before = self.browser.value(f"{NEWEST}?.id || ''")
        self.browser.value(f"document.getElementById('kind').value = '{kind}'")
        self.browser.value("document.querySelector('#plan button').click()")
        self.browser.wait_for(f"the plan of a {kind}", f"({NEWEST}?.id || '') !== '{before}'")
        self.browser.wait_for("its button", f"[...{NEWEST}.querySelectorAll('button')].some((it) => it.textContent === 'Start')")
        self.take_control()
        self.browser.value(f"[...{NEWEST}.querySelectorAll('button')].find((it) => it.textContent === 'Start').click()")
        self.browser.wait_for("its begin", f"!{NEWEST}.innerText.includes('planned')")
        self.pace.slow = False
        ended = f"/\\n(done|stopped|failed|timed_out)\\n/.test({NEWEST}.innerText + '\\n')"
        self.browser.wait_for(f"the end of a {kind}", ended)
        self.pace.slow = True
        return self.browser.value(f"{NEWEST}.innerText")

    def job(self):
        """Reads a job from a file as a page does, plans and starts it, and does what it asks; what the page says."""
        self.take_control()
        before = self.browser.value(f"{NEWEST}?.id || ''")
        read_only = self.browser.value("document.getElementById('along').hidden")
        self._read("job", "job.toml", JOB)
        self.browser.value("document.querySelector('#plan > button').click()")
        self.browser.wait_for("the plan of a job", f"({NEWEST}?.id || '') !== '{before}'")
        planned = self.browser.wait_for("what is asked", f"{NEWEST}.innerText.includes('A person is asked') && {NEWEST}.innerText")
        self.take_control()
        self._press("Start")
        self.pace.slow = False
        asked = self.browser.wait_for("its question", f"{NEWEST}.querySelector('.question')?.innerText")
        self.pace.slow = True
        self.take_control()
        self._press("done")
        self.pace.slow = False
        self.browser.wait_for("its end", f"{NEWEST}.innerText.includes('points before')")
        self.pace.slow = True
        warned = "the axis holds its place under power and moves as soon as this is answered: be out of its way first"
        return read_only and warned in asked and "lay a part on the stage" in planned and "\ndone\n" in self.browser.value(f"{NEWEST}.innerText")

    def path(self):
        """Reads a path from a file, with a slip first, plans it and follows it; what the page says of it."""
        self._plan_path(PATH.replace("2,9,", "2,9O,"))
        problem = "document.getElementById('problem').textContent"
        slip = self.browser.wait_for("what is wrong with the path", f"{problem}.includes('`9O`') && {problem}")
        before = self.browser.value(f"{NEWEST}?.id || ''")
        self._plan_path(PATH)
        self.browser.wait_for("the plan of a path", f"({NEWEST}?.id || '') !== '{before}'")
        joins = f"{NEWEST}.innerText.includes('the straight joins of its rows') && {NEWEST}.innerText"
        planned = self.browser.wait_for("where it leaves its rows", joins)
        self.take_control()
        self._press("Start")
        self.pace.slow = False
        self.browser.wait_for("its end", f"{NEWEST}.innerText.includes('\\ndone\\n')")
        place = "[...document.querySelectorAll('#axes .position')].map((it) => parseFloat(it.textContent))"
        # Where the axes are is told a moment later than that the run has ended.
        there = f"{json.dumps(PATH_END)}.every((mm, axis) => Math.abs({place}[axis] - mm) < 0.01)"
        self.browser.wait_for("the axes at its end", there)
        self.pace.slow = True
        return {"slip": slip, "planned": planned, "ended": self.browser.value(place)}

    def _plan_path(self, rows):
        self.take_control()
        self._read("path", "path.csv", rows)
        self.browser.value("document.getElementById('uncompensated').checked = true")
        self.browser.value("document.querySelector('#plan > button').click()")

    def _read(self, kind, name, text):
        """Chooses what is run, and a file for it."""
        self.browser.value(
            f"(() => {{ const kind = document.getElementById('kind'); kind.value = '{kind}';"
            " kind.dispatchEvent(new Event('change')); const files = new DataTransfer();"
            f" files.items.add(new File([{json.dumps(text)}], '{name}')); const file = document.getElementById('file');"
            " file.files = files.files; file.dispatchEvent(new Event('change')); })()"
        )
        self.browser.wait_for("the text of the file", f"document.getElementById('rows').value === {json.dumps(text)}")

    def _press(self, text):
        button = f"[...{NEWEST}.querySelectorAll('button')].find((it) => it.textContent === '{text}')"
        self.browser.wait_for(text, f"{button} && !{button}.disabled")
        self.browser.value(f"{button}.click()")

    def move(self, text):
        """Moves the axis, and waits until the page says that it stands there."""
        self.take_control()
        self.browser.value(f"document.querySelector('#axes .go input').value = '{text}'")
        self.browser.value("document.querySelector('#axes .go button').click()")
        shown = "document.querySelector('#axes .position').textContent"
        self.pace.slow = False
        self.browser.wait_for("the motion", f"Math.abs(parseFloat({shown}) - parseFloat('{text}')) < 0.001")
        self.pace.slow = True
        return self.browser.value(shown)


def painted(browser, canvas):
    """How many pixels of a canvas are not empty."""
    return browser.value(
        f"(() => {{ const it = {canvas}; if (!it || !it.width) return 0;"
        " const {data} = it.getContext('2d').getImageData(0, 0, it.width, it.height);"
        " let count = 0; for (let at = 3; at < data.length; at += 4) count += data[at] > 0; return count; })()"
    )


def painted_at_last(browser, canvas, more):
    """The same, when it is more than that or nobody waits any longer: a picture comes with the next sample."""
    limit = time.monotonic() + PATIENCE_S
    while (count := painted(browser, canvas)) <= more and time.monotonic() < limit:
        time.sleep(0.1)
    return count


def looks(browser, folder):
    """What is drawn in a wide window and in a narrow one, light and dark; whether anything is wider than the window."""
    report = {}
    for width, theme in ((1100, "light"), (1100, "dark"), (360, "light"), (360, "dark")):
        browser.command("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=False)
        browser.command("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": theme}])
        name = f"{width}_{theme}"
        wide = browser.value("document.documentElement.scrollWidth")
        run = painted_at_last(browser, "document.querySelector('#runs canvas')", 1000)
        live = painted_at_last(browser, f"document.querySelector('{LIVE}')", 500)
        report[name] = wide <= width and run > 1000 and live > 500 or [wide, run, live]
        if folder:
            shot = browser.command("Page.captureScreenshot", format="png", captureBeyondViewport=True)
            (Path(folder) / f"{name}.png").write_bytes(base64.b64decode(shot["data"]))
    browser.command("Emulation.clearDeviceMetricsOverride")
    return report


def by_keyboard(browser):
    """Tab from the kind of a run through what a path needs to its button."""
    browser.value("document.getElementById('kind').focus()")
    reached = []
    for _ in range(6):
        for kind in ("keyDown", "keyUp"):
            browser.command("Input.dispatchKeyEvent", type=kind, key="Tab", code="Tab", windowsVirtualKeyCode=9)
        reached.append(browser.value("document.activeElement.id || document.activeElement.textContent"))
    return reached


def commanded(kept, browser):
    """The whole day; a report."""
    pace = Pace(kept.clock)
    person = Person(browser, pace)
    browser.open(kept.url + "/")
    state = "document.getElementById('state').textContent"
    browser.wait_for("the machine", f"{state} === 'running'")
    report = {"zeroed": "done" in person.run("zero"), "calibrated": "done" in person.run("calibrate")}
    report["position"] = person.move("12.5mm")
    report["true_mm"] = Truth(kept.clock).position_mm()
    browser.value("document.querySelector('#axes details').open = true")
    report["looks"] = looks(browser, SHOTS)
    report["job"] = person.job()
    report["keyboard"] = by_keyboard(browser)
    report["robbed"] = person.robbed(kept)
    errors = list(browser.errors)
    kept.kill_service()
    browser.wait_for("word of the lost connection", f"{state}.includes('connection lost')")
    kept.serve_again()
    browser.wait_for("the machine again", f"{state} === 'running'")
    # What a browser says of connections that were refused meanwhile is no fault of the page.
    browser.errors.clear()
    report["zero_again"] = "done" in person.run("zero")
    verified = person.run("verify")
    report["verified"] = "done" in verified and "within tolerance\ntrue" in verified
    browser.value("document.getElementById('stop').click()")
    axis = "document.querySelector('#axes h3').textContent"
    browser.wait_for("the stop in the events", "/stop/.test(document.querySelector('#events').innerText)")
    report["axis"] = browser.wait_for("the axis at rest", f"{axis}.includes('Standstill') && {axis}")
    # What is refused for a lease that has lapsed, a browser logs.
    report["errors"] = [it for it in errors + browser.errors if "423" not in it]
    pace.end()
    return report


def followed(kept, browser):
    """Three axes follow a path; a report."""
    pace = Pace(kept.clock)
    person = Person(browser, pace)
    browser.open(kept.url + "/")
    browser.wait_for("the machine", "document.getElementById('state').textContent === 'running'")
    report = {"zeroed": "done" in person.run("zero"), **person.path()}
    # The slip was refused, and lapsed leases were, which a browser logs.
    report["errors"] = [it for it in browser.errors if "422" not in it and "423" not in it]
    pace.end()
    return report


def main():
    programs, chromium = sys.argv[1:]
    with Browser(chromium) as browser:
        with KeptMachine(programs) as kept:
            report = commanded(kept, browser)
            wait_for("the service", lambda: kept.ask("GET", "/v1/machine")["state"] == "running")
            browser.open("about:blank")
        browser.errors.clear()
        with KeptMachine(programs, "volumetric", changes=RARE_SYNCS) as kept:
            report["path"] = followed(kept, browser)
        print(json.dumps(report))


main()
