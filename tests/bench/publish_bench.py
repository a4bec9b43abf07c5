#!/usr/bin/env python3
"""What publishing costs: a mock drive in real time with 640 x 480 images at 20 Hz, its lines over a Unix socket, its page without a viewer and
with one in headless Chromium.

    publish_bench PROGRAM [--seconds 20]

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


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--seconds", type=float, default=20)
    given = parser.parse_args()
    os.environ["VERGENCE"] = given.program
    d.SMALL = ["--set", "mock.texture_detail=0"]
    names = ["vergence-page", "vergence-lines", "vergence-estim"]
    with tempfile.TemporaryDirectory(prefix="vergence-publish-", ignore_cleanup_errors=True) as below:
        below = pathlib.Path(below)
        run = d.Drive(below / "drive", 3 * given.seconds + 20, "--set", f"publish.lines=unix://{below}/pose.sock", "--set",
                      f"publish.http=127.0.0.1:{d.free_port()}")
        url = run.wait_for(r"live page: (http://\S+)")
        reader = d.connected(below / "pose.sock")
        threading.Thread(target=lambda: list(reader.makefile("r")), daemon=True).start()
        time.sleep(5)
        alone = shares(run.process, given.seconds, names)
        driver = browser.Driver(shutil.which("chromedriver"), shutil.which("chromium"), str(below / "profile"))
        try:
            driver.word("POST", "/url", {"url": url})
            time.sleep(2)
            count = {"script": "return [window.updates, performance.now()]", "args": []}
            first, begin = driver.word("POST", "/execute/sync", count)
            watched = shares(run.process, given.seconds, names)
            last, end = driver.word("POST", "/execute/sync", count)
            paint = driver.word("POST", "/execute/sync", {"script": "return performance.getEntriesByName('first-contentful-paint')[0].startTime",
                                                          "args": []})
        finally:
            driver.close()
        run.stop()
        devices = run.summary()["devices"]
        timing = run.summary()["timing_ms"]
    print(f"page thread        {alone['vergence-page']:6.2f} % of a core without a viewer, {watched['vergence-page']:.2f} % with one")
    print(f"line thread        {alone['vergence-lines']:6.2f} % of a core")
    print(f"estimator's thread {alone['vergence-estim']:6.2f} % of a core without a viewer, {watched['vergence-estim']:.2f} % with one")
    print(f"updates            {1000 * (last - first) / (end - begin):6.2f} a second")
    print(f"first paint        {paint:6.0f} ms")
    print(f"line after pose    {devices['line_behind_pose_p50_us'] / 1000:6.3f} ms p50, {devices['line_behind_pose_p99_us'] / 1000:.3f} ms p99")
    print(f"line after middle  {devices['line_age_p50_us'] / 1000:6.2f} ms p50, {devices['line_age_p99_us'] / 1000:.2f} ms p99 "
          f"(estimate {timing['p50']:.2f} ms p50, {timing['p99']:.2f} ms p99)")
    print(f"load of the machine {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    return 0


if __name__ == "__main__":
    sys.exit(main())
