#!/usr/bin/env python3
"""Counts what the program needs before it does anything: shared libraries, memory, time.

  slim.py PROGRAM [--libraries 50] [--megabytes 14] [--milliseconds 20] [--no-memory]

`PROGRAM --version` is held at its only line by a pipe that is full: /proc then tells what it has mapped and what it took.
Time is told, and a limit only where it is given: what else the machine does is in it.
Exit: 0 within the limits, 1 beyond one of them (one line each).
"""
import argparse
import fcntl
import os
import re
import subprocess
import sys
import time

FORBIDDEN = re.compile(r"opencv|gdal|mariadb", re.IGNORECASE)


def held(program):
    """(libraries, peak in kB) of `program --version`, looked at while it waits to write."""
    reading, writing = os.pipe()
    fcntl.fcntl(writing, fcntl.F_SETPIPE_SZ, 4096)
    os.set_blocking(writing, False)
    try:
        while True:
            os.write(writing, b"x" * 4096)
    except BlockingIOError:
        os.set_blocking(writing, True)
    process = subprocess.Popen([program, "--version"], stdin=subprocess.DEVNULL, stdout=writing)
    os.close(writing)
    try:
        folder = "/proc/%d/" % process.pid
        until = time.monotonic() + 20
        while not waits_to_write(folder) and time.monotonic() < until:
            time.sleep(0.01)
        libraries = {line.split()[-1] for line in read(folder + "maps").splitlines() if re.search(r"\.so(\.|$)", line)}
        peak = re.search(r"VmHWM:\s+(\d+) kB", read(folder + "status"))
    finally:
        while os.read(reading, 65536):
            pass
        os.close(reading)
        process.wait()
    return sorted(os.path.basename(name) for name in libraries), int(peak.group(1)) if peak else 0


def read(name):
    try:
        with open(name, encoding="utf-8", errors="replace") as file:
            return file.read()
    except OSError:
        return ""


def waits_to_write(folder):
    """Asleep in write() or writev(), by their numbers on x86-64 and arm64, to standard output."""
    call = read(folder + "syscall").split()
    return call[:1] in (["1"], ["20"], ["64"], ["66"]) and call[1:2] == ["0x1"]


def fastest(program, runs=20):
    """Seconds of the fastest run: what else the machine does makes none of them faster."""
    best = float("inf")
    for _ in range(runs):
        start = time.monotonic()
        subprocess.run([program, "--version"], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, check=True)
        best = min(best, time.monotonic() - start)
    return best


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--libraries", type=int, default=50)
    parser.add_argument("--megabytes", type=float, default=14)
    parser.add_argument("--milliseconds", type=float)
    parser.add_argument("--no-memory", action="store_true", help="of a build with sanitizers only the libraries count")
    given = parser.parse_args()
    # The kernel maps neighbouring pages of files as it can, which varies by half a megabyte from run to run.
    libraries, peak_kb = min((held(given.program) for _ in range(5)), key=lambda found: found[1])
    findings = []
    if not libraries:
        findings.append("no library was seen: the program was not caught at its line")
    if len(libraries) > given.libraries:
        findings.append("%d shared libraries, %d are allowed: %s" % (len(libraries), given.libraries, " ".join(libraries)))
    findings += ["%s has no place in the program" % name for name in libraries if FORBIDDEN.search(name)]
    seconds = fastest(given.program)
    told = "%d shared libraries, %.1f MB, %.1f ms" % (len(libraries), peak_kb / 1024, seconds * 1e3)
    if not given.no_memory and peak_kb > given.megabytes * 1024:
        findings.append("--version takes %.1f MB, %.1f are allowed" % (peak_kb / 1024, given.megabytes))
    if given.milliseconds is not None and seconds * 1e3 > given.milliseconds:
        findings.append("--version takes %.1f ms, %.1f are allowed" % (seconds * 1e3, given.milliseconds))
    print("\n".join(findings) if findings else told)
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
