#!/usr/bin/env python3
"""How long a frame takes, by stage, on the recorded drives: alone, with busy processes beside, and with those and a real-time priority.

    realtime_bench PROGRAM [--busy 4] [--priority 50] [--set KEY=VALUE]

Prints p50, p99, p99.9 and the longest in milliseconds of wall clock, from the decoded pair to the pose, and of each stage the largest of
all drives. Drives are those of VERGENCE_SHARED; without them nothing is measured. Times without a priority are printed where the system
refuses one.
"""
import argparse
import contextlib
import json
import os
import pathlib
import subprocess
import sys
import tempfile

SOURCES = pathlib.Path(os.environ.get("SOURCES", pathlib.Path(__file__).resolve().parent.parent.parent))
DRIVES = {"EuRoC MH_01": "euroc_mh01", "KITTI 00": "kitti00_151", "KITTI 01": "kitti01_51", "KITTI 06": "kitti06_51"}
QUANTILES = ("p50", "p99", "p99_9", "max")


@contextlib.contextmanager
def busy(count):
    """So many processes that do nothing but count."""
    processes = [subprocess.Popen(["sh", "-c", "while :; do :; done"]) for _ in range(count)]
    try:
        yield
    finally:
        for process in processes:
            process.kill()
            process.wait()


def timing_of(program, drive, settings):
    with tempfile.TemporaryDirectory(prefix="vergence-realtime-") as below:
        session = pathlib.Path(below) / "session"
        words = [word for setting in settings for word in ("--set", setting)]
        done = subprocess.run([program, "replay", str(drive), "--out", str(session), *words], stdin=subprocess.DEVNULL, capture_output=True, text=True,
                              check=False)
        if done.returncode != 0:
            sys.exit(f"realtime_bench: {drive}: {done.stderr.strip()}")
        for line in done.stderr.splitlines():
            if "priority" in line:
                print(line, file=sys.stderr)
        return json.loads((session / "summary.json").read_text())["timing_ms"]


def cell(times, digits):
    return ", ".join(f"{times[q]:.{digits}f}" for q in QUANTILES)


def print_tables(conditions, timings):
    print("| | " + " | ".join(conditions) + " |")
    print("|---|" + "---|" * len(conditions))
    for drive in DRIVES:
        print(f"| {drive} | " + " | ".join(cell(timings[c, drive], 1) for c in conditions) + " |")
    print("\nLargest of all drives:\n")
    print("| stage | " + " | ".join(conditions) + " |")
    print("|---|" + "---|" * len(conditions))
    for stage in next(iter(timings.values()))["stage_distributions"]:
        of_drives = {c: [timings[c, drive]["stage_distributions"][stage] for drive in DRIVES] for c in conditions}
        largest = {c: {q: max(times[q] for times in of_drives[c]) for q in QUANTILES} for c in conditions}
        print(f"| {stage} | " + " | ".join(cell(largest[c], 2) for c in conditions) + " |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--busy", type=int, default=4, metavar="N", help="processes beside")
    parser.add_argument("--priority", type=int, default=50, help="realtime.priority of the third column")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="a key of the replays' configuration")
    given = parser.parse_args()
    data = pathlib.Path(os.environ.get("VERGENCE_SHARED", SOURCES.parent / "shared")) / "data"
    if not data.is_dir():
        print(f"realtime_bench: no recorded drives at {data} (VERGENCE_SHARED names another place): nothing was measured")
        return 0
    conditions = {"alone": (0, given.set), f"{given.busy} busy processes": (given.busy, given.set),
                  "with priority": (given.busy, [*given.set, f"realtime.priority={given.priority}"])}
    timings = {}
    for condition, (processes, settings) in conditions.items():
        with busy(processes):
            for name, folder in DRIVES.items():
                timings[condition, name] = timing_of(given.program, data / folder, settings)
    print_tables(list(conditions), timings)
    return 0


if __name__ == "__main__":
    sys.exit(main())
