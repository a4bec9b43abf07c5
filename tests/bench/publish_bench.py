#!/usr/bin/env python3
"""What publishing costs: two mock drives in real time with 640 x 480 images at 20 Hz, lines over a Unix socket, the page without a viewer and
with one in headless Chromium.

    publish_bench PROGRAM [--seconds 20] [--set KEY=VALUE]

Prints the page thread's and the estimator thread's share of a core without a viewer and with one, updates a second, first paint, and how
long after the pose and after mid-exposure a line is out.
"""
import argparse
import os
import pathlib
import shutil
import sys
import tempfile
import threading
import time

SOURCES = pathlib.Path(os.environ.get("SOURCES", pathlib.Path(__file__).resolve().parent.parent.parent))
os.environ["SOURCES"] = str(SOURCES)
sys.path[:0] = [str(SOURCES / "tests/system/publish"), str(SOURCES / "tests/system/report")]
import drive as d  # noqa: E402
import report_in_chromium as browser  # noqa: E402

TICKS = os.sysconf("SC_CLK_TCK")


def seconds_of(process, name):
    """CPU time of the threads of that name."""
    total = 0
    for task in pathlib.Path(f"/proc/{process.pid}/task").iterdir():
        try:
            if (task / "comm").read_text().strip() == name:
                fields = (task / "stat").read_text().rpartition(")")[2].split()
                total += (int(fields[11]) + int(fields[12])) / TICKS
        except (FileNotFoundError, ProcessLookupError):
            pass  # a thread that has just ended is none of those
    return total


def shares(process, seconds, names):
    """Of a core, while `seconds` pass."""
    before = {name: seconds_of(process, name) for name in names}
    begin = time.monotonic()
    time.sleep(seconds)
    passed = time.monotonic() - begin
    return {name: 100 * (seconds_of(process, name) - before[name]) / passed for name in names}


def publishing_drive(below, seconds):
    """A mock drive with lines and a page, and a reader of its lines."""
    below.mkdir()
    drive = d.Drive(below / "drive", seconds, "--set", f"publish.pose_stream=unix://{below}/pose.sock", "--set", f"publish.http=127.0.0.1:{d.free_port()}")
    url = drive.wait_for(r"live page: (http://\S+)")
    reader = d.connected(below / "pose.sock")
    threading.Thread(target=lambda: list(reader.makefile("r")), daemon=True).start()
    time.sleep(5)
    return drive, url


def print_line_latency(drive, who):
    devices = drive.summary()["devices"]
    timing = drive.summary()["timing_ms"]
    print(f"{who}: line after pose {devices['line_behind_pose_p50_us'] / 1000:.3f} ms p50, {devices['line_behind_pose_p99_us'] / 1000:.3f} ms p99; "
          f"after mid-exposure {devices['line_age_p50_us'] / 1000:.2f} ms p50, {devices['line_age_p99_us'] / 1000:.2f} ms p99 "
          f"(estimate {timing['p50']:.2f} ms p50, {timing['p99']:.2f} ms p99)")


def measure_without_viewer(below, seconds, names):
    """The line's latency is this drive's: a browser that starts takes both cores of a small machine for a second or two."""
    drive, _ = publishing_drive(below, seconds + 20)
    share = shares(drive.process, seconds, names)
    drive.stop()
    print(f"without a viewer: page thread {share['vergence-page']:.2f} % of a core, line thread {share['vergence-lines']:.2f} %, "
          f"estimator's thread {share['vergence-estim']:.2f} %")
    print_line_latency(drive, "without a viewer")


def measure_with_viewer(below, seconds, names):
    drive, url = publishing_drive(below, seconds + 40)
    driver = browser.Driver(shutil.which("chromedriver"), shutil.which("chromium"), str(below / "profile"))
    try:
        driver.word("POST", "/url", {"url": url})
        time.sleep(2)
        count = {"script": "return [window.updates, performance.now()]", "args": []}
        first, begin = driver.word("POST", "/execute/sync", count)
        share = shares(drive.process, seconds, names)
        last, end = driver.word("POST", "/execute/sync", count)
        paint = driver.word("POST", "/execute/sync", {"script": "return performance.getEntriesByName('first-contentful-paint')[0].startTime",
                                                      "args": []})
    finally:
        driver.close()
    drive.stop()
    print(f"with a viewer: page thread {share['vergence-page']:.2f} % of a core, estimator's thread {share['vergence-estim']:.2f} %, "
          f"{1000 * (last - first) / (end - begin):.2f} updates a second, first paint {paint:.0f} ms")
    print_line_latency(drive, "with a viewer")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="a key of the drives' configuration")
    given = parser.parse_args()
    os.environ["VERGENCE"] = given.program
    d.SMALL = ["--set", "mock.texture_detail=0"] + [word for assignment in given.set for word in ("--set", assignment)]
    names = ["vergence-page", "vergence-lines", "vergence-estim"]
    with tempfile.TemporaryDirectory(prefix="vergence-publish-", ignore_cleanup_errors=True) as below:
        measure_without_viewer(pathlib.Path(below) / "alone", given.seconds, names)
        measure_with_viewer(pathlib.Path(below) / "watched", given.seconds, names)
    print(f"load of the machine {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    return 0


if __name__ == "__main__":
    sys.exit(main())
