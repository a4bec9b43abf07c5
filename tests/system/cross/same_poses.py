#!/usr/bin/env python3
"""Replays recorded drives with the arm64 program under qemu-user and with this machine's: poses agree, and arm64's are its own bit for bit.

  same_poses.py PROGRAM BUILD_ARM64 SHARED [--frames N] [--bound-mm 0.1]

Exit: 0 they agree, 1 they do not, 77 there is no arm64 program, no emulator or no recorded drive here (scripts/cross arm64 makes the first).
"""
import argparse
import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time

DRIVES = (("euroc_mh01", "euroc"), ("kitti06_51", "kitti"), ("kitti00_151", "kitti"))
SKIPPED = 77


def emulated(build):
    """The command before the program's arguments; None with a message where it cannot be."""
    program, cache = os.path.join(build, "vergence"), os.path.join(build, "CMakeCache.txt")
    qemu = shutil.which("qemu-aarch64-static") or shutil.which("qemu-aarch64")
    if qemu is None or not os.path.exists(program) or not os.path.exists(cache):
        print("skipped: needs qemu-user-static and %s, which scripts/cross arm64 builds" % program)
        return None
    with open(cache, encoding="utf-8") as file:
        sysroot = re.search(r"^VERGENCE_SYSROOT:\w+=(.*)$", file.read(), re.MULTILINE)
    if sysroot is None or not os.path.isdir(sysroot.group(1)):
        print("skipped: the sysroot that %s was linked with is gone; scripts/cross arm64 makes it again" % program)
        return None
    return [qemu, "-cpu", "cortex-a76", "-L", sysroot.group(1), program]


def replay(command, drive, form, out, frames):
    start = time.monotonic()
    words = command + ["replay", drive, "--format", form, "--out", out, "--quiet"] + (["--frames", str(frames)] if frames else [])
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode > 1:
        sys.exit("%s: %d %s" % (" ".join(words), done.returncode, done.stderr))
    with open(os.path.join(out, "trajectory.tum"), encoding="utf-8") as file:
        text = file.read()
    with open(os.path.join(out, "summary.json"), encoding="utf-8") as file:
        summary = json.load(file)
    return text, summary, time.monotonic() - start


def poses(text):
    return [[float(word) for word in line.split()] for line in text.splitlines() if line and line[0] != "#"]


def largest_differences(a, b):
    """mm, mrad over poses with equal stamps."""
    metres, radians = 0.0, 0.0
    for p, q in zip(a, b):
        metres = max(metres, math.dist(p[1:4], q[1:4]))
        # Of nearly equal quaternions, from their difference: a cosine of the printed digits would be all rounding.
        sign = 1.0 if sum(x * y for x, y in zip(p[4:8], q[4:8])) >= 0 else -1.0
        radians = max(radians, 2 * math.sqrt(sum((x - sign * y) ** 2 for x, y in zip(p[4:8], q[4:8]))))
    return metres * 1e3, radians * 1e3


def compare(given, arm, name, form, work):
    drive = os.path.join(given.shared, "data", name)
    if not os.path.isdir(drive):
        print("%s: not here, left out" % name)
        return None
    here, on_x86, _ = replay([given.program], drive, form, os.path.join(work, name + "-x86"), given.frames)
    first, on_arm, seconds = replay(arm, drive, form, os.path.join(work, name + "-arm-1"), given.frames)
    second, _, _ = replay(arm, drive, form, os.path.join(work, name + "-arm-2"), given.frames)
    a, b = poses(here), poses(first)
    same_stamps = [p[0] for p in a] == [p[0] for p in b]
    mm, mrad = largest_differences(a, b)
    print("%s: %d poses on %s, %d on %s, apart by at most %.4f mm and %.4f mrad; %.0f s emulated, %s with itself"
          % (name, len(a), on_x86["simd"], len(b), on_arm["simd"], mm, mrad, seconds, "bit-identical" if first == second else "NOT identical"))
    return len(a) > 0 and same_stamps and mm <= given.bound_mm and first == second


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("build")
    parser.add_argument("shared")
    parser.add_argument("--frames", type=int, default=0, help="0: all")
    parser.add_argument("--bound-mm", type=float, default=0.1)
    given = parser.parse_args()
    given.shared = os.environ.get("VERGENCE_SHARED") or given.shared
    arm = emulated(given.build)
    if arm is None:
        return SKIPPED
    with tempfile.TemporaryDirectory() as work:
        results = [compare(given, arm, name, form, work) for name, form in DRIVES]
    results = [result for result in results if result is not None]
    if not results:
        print("skipped: needs recorded drives: put them into ../shared or name their place in VERGENCE_SHARED")
        return SKIPPED
    return 0 if all(results) else 1


if __name__ == "__main__":
    sys.exit(main())
