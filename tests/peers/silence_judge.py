"""A person at the page of a service that hangs, and at one of many pages of one browser, in headless Chromium.

    silence_judge.py PROGRAMS CHROMIUM

PROGRAMS is the folder with `truestage` and `mock-bus`. The last line is a report in JSON, times in seconds.
"""

import base64
import json
import os
import signal
import sys
import time
from pathlib import Path

from browser import Browser
from kept_machine import KeptMachine, Pace

STATE = "document.getElementById('state').textContent"
ANSWER = "document.getElementById('stop-answer').textContent"
STOP = "document.getElementById('stop').click()"
IS_GREY = "Number(getComputedStyle(document.querySelector('#axes .place')).opacity) < 0.6"
# A browser opens six connections to one place.
WINDOWS = 7
TABS = 10
# Where pictures of the page go, for people who want to look at them.
SHOTS = os.environ.get("TRUESTAGE_SHOTS")


def shot(page, name):
    """A picture for people."""
    if SHOTS:
        page.command("Emulation.setDeviceMetricsOverride", width=1100, height=640, deviceScaleFactor=1, mobile=False)
        taken = page.command("Page.captureScreenshot", format="png")
        (Path(SHOTS) / f"{name}.png").write_bytes(base64.b64decode(taken["data"]))


def look_at(page):
    """Waits until the page, in front of all others of its window, shows the machine."""
    page.command("Page.bringToFront")
    page.wait_for("the machine", f"{STATE} === 'running' && document.querySelector('#axes .place') !== null")


def stopped(page):
    """What the page says of a stop at last, and after how long."""
    begun = time.monotonic()
    page.value(STOP)
    said = page.wait_for("an answer", f"{ANSWER} !== '' && !{ANSWER}.startsWith('STOP') && {ANSWER}")
    return [said, time.monotonic() - begun]


def hangs(kept, page):
    """The service is stopped, and goes on; a report."""
    service = kept.processes[-1]
    report = {"grey_before": page.value(IS_GREY)}
    shot(page, "normal")
    service.send_signal(signal.SIGSTOP)
    begun = time.monotonic()
    report["silent"] = page.wait_for("word of the silence", f"{STATE}.includes('nothing heard for') && {STATE}")
    report["silent_s"] = time.monotonic() - begun
    report["grey"] = page.value(IS_GREY)
    page.wait_for("ten seconds", f"{STATE}.includes('nothing heard for 10 s')")
    shot(page, "silent")
    report["unanswered"] = stopped(page)
    shot(page, "unanswered")
    service.send_signal(signal.SIGCONT)
    report["late"] = page.wait_for("a late answer", f"{ANSWER}.includes('late') && {ANSWER}")
    report["again"] = page.wait_for("the machine again", f"{STATE} === 'running' && {STATE}")
    report["grey_after"] = page.value(IS_GREY)
    report["taken"] = stopped(page)
    shot(page, "taken")
    return report


def many(kept, browser):
    """STOP in each of many pages; a report."""
    pages = [browser.tab(in_window=True) for _ in range(WINDOWS - 1)]
    pages += [browser.tab() for _ in range(TABS - WINDOWS)]
    for page in pages:
        page.open(kept.url + "/")
        page.wait_for("the page", "document.readyState === 'complete'")
    pages.insert(0, browser)
    hidden = [page.value("document.hidden") for page in pages]
    stops = []
    for page in pages:
        look_at(page)
        stops.append(stopped(page))
    errors = [error for page in pages for error in page.errors]
    return {"hidden": sum(hidden), "pages": len(pages), "stops": stops, "errors": errors}


def main():
    programs, chromium = sys.argv[1:]
    with Browser(chromium) as browser, KeptMachine(programs) as kept:
        pace = Pace(kept.clock)
        browser.open(kept.url + "/")
        look_at(browser)
        report = hangs(kept, browser)
        report["many"] = many(kept, browser)
        browser.open("about:blank")
        pace.end()
    print(json.dumps(report))


main()
