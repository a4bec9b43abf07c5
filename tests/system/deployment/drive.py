#!/usr/bin/env python3
"""Installs the package on an emulated arm64 board and drives: the service, a power cut, what comes after it. scripts/deployment-test starts it.

  drive.py --image FOLDER --package DEB --board ELF --work FOLDER -- INS_COMMAND…

INS_COMMAND gets the path of a socket as its last word. Exit: 0, 1 something is not as it should be.
"""
import argparse
import json
import os
import shutil
import subprocess
import sys
import time

from machine import WITH_US, Line, Machine, MachineError

HERE = os.path.dirname(os.path.abspath(__file__))
SESSIONS = "/var/lib/vergence/sessions"
INS, TRIGGER = "INS1", "TRIGGER1"
# s. Files are handed to the disk every 2 s, ext4 commits every 5 s; the rest is for the disk of an emulated machine on a busy one.
LOST_AT_MOST = 12
AS_USER = "runuser -u vergence -- "
begin = time.monotonic()


class Wrong(Exception):
    pass


def say(text):
    print("[%4.0f s] %s" % (time.monotonic() - begin, text), flush=True)


def need(condition, message):
    if not condition:
        raise Wrong(message)


def done(machine, command, limit=120):
    """Output of a command that has to succeed."""
    status, text = machine.run(command, limit)
    need(status == 0, "%s: %d\n%s" % (command, status, text))
    return text


class Vehicle:
    """The machine and what is wired to it. The trigger board has a supply of its own: it runs through power cuts. The INS gets power
    when the machine's shell answers, which is later than an enabled service starts."""

    def __init__(self, given):
        self.given = given
        disk, parcel = os.path.join(given.work, "disk"), os.path.join(given.work, "parcel")
        subprocess.run(["cp", "--sparse=always", os.path.join(given.image, "disk"), disk], check=True)
        folder = os.path.join(given.work, "files")
        os.makedirs(folder, exist_ok=True)
        shutil.copy(given.package, os.path.join(folder, "vergence.deb"))
        shutil.copy(os.path.join(HERE, "rig.yaml"), folder)
        subprocess.run(["mke2fs", "-q", "-F", "-t", "ext4", "-d", folder, parcel, "32M"], check=True)
        self.machine = Machine(given.image, disk, parcel, given.work, [INS, TRIGGER])
        self.ins = None
        self.line = Line(self.machine.path("line"), self.machine.path("serial-" + TRIGGER))
        log = open(os.path.join(given.work, "board.log"), "w", encoding="utf-8")
        # 256 ns an instruction and not faster than the clock on the wall: some 4 million instructions a second, a fifth of a processor.
        self.board = subprocess.Popen(
            WITH_US + ["qemu-system-arm", "-machine", "netduinoplus2", "-nodefaults", "-display", "none", "-icount", "shift=8,align=on,sleep=on",
             "-kernel", given.board, "-chardev", "socket,id=line,path=" + self.machine.path("line"),
             "-serial", "chardev:line"], stdin=subprocess.DEVNULL, stdout=log, stderr=log)

    def power_on(self):
        self.ins_off()
        started = time.monotonic()
        self.machine.power_on()
        self.ins = subprocess.Popen(WITH_US + self.given.ins + [self.machine.path("serial-" + INS)], stdin=subprocess.DEVNULL)
        return time.monotonic() - started

    def ins_off(self):
        if self.ins is not None:
            self.ins.kill()
            self.ins.wait()
            self.ins = None

    def close(self):
        self.ins_off()
        self.board.kill()
        self.board.wait()
        self.line.close()
        self.machine.close()


def install(machine):
    done(machine, "mkdir -p /parcel && mount -o ro /dev/vdb /parcel")
    done(machine, "DEBIAN_FRONTEND=noninteractive apt-get install -qq -y /parcel/vergence.deb", 300)
    need(machine.run("systemctl is-enabled vergence")[1] == "disabled", "installing has enabled the service")
    say("installed: %s, user %s" % (done(machine, "vergence --version | head -n 1"), done(machine, "id vergence")))


def configure(machine):
    done(machine, "install -D -m 644 /parcel/rig.yaml /etc/vergence/rig.yaml")
    listed = json.loads(done(machine, "vergence devices --json 2>/dev/null"))
    say("devices: %s" % ", ".join("%s %s" % (c["driver"], c["serial"]) for c in listed["cameras"])
        + "; " + ", ".join("%s %s" % (p["port"], p["usb_serial"]) for p in listed["serial_ports"] if p["usb_ids"]))
    return listed


def rules(machine):
    """As docs/deployment.md says: names that stay, by rules that the program writes."""
    done(machine, "sed 's#/dev/vergence/ins-%s#/dev/ttyUSB0#; s#/dev/vergence/trigger-%s#/dev/ttyUSB1#' /parcel/rig.yaml >/tmp/ports.yaml" % (INS, TRIGGER))
    done(machine, "vergence devices --rig /tmp/ports.yaml --write-udev >/etc/udev/rules.d/98-vergence-rig.rules")
    done(machine, "udevadm control --reload && udevadm trigger && udevadm settle")
    done(machine, "ls /dev/vergence/ins-%s /dev/vergence/trigger-%s" % (INS, TRIGGER))
    status, text = machine.run("vergence doctor /etc/vergence/rig.yaml --session-dir /var/lib/vergence", 300)
    say("doctor: %d\n%s" % (status, text))


def newest_session(machine, before=""):
    sessions = done(machine, "ls -t %s" % SESSIONS).split()
    need(sessions and sessions[0] != before, "there is no new session")
    return sessions[0]


def rows(machine, session, name):
    return int(done(machine, "cat %s/%s/%s 2>/dev/null | wc -l" % (SESSIONS, session, name)))


def last_stamp(machine, session):
    """s; of the last whole line of poses.csv."""
    line = done(machine, "cat %s/%s/poses.csv | tail -n 2 | head -n 1" % (SESSIONS, session))
    return 1e-9 * int(line.split(",")[1])


def start_service(machine):
    started = time.monotonic()
    status, text = machine.run("systemctl start vergence", 180)
    need(status == 0, "systemctl start vergence: %d %s\n%s" % (status, text, machine.run("journalctl -u vergence --no-pager -o cat | tail -n 40")[1]))
    return time.monotonic() - started


def drive(machine, session, more, limit=240):
    """Until so many more lines are in poses.csv."""
    enough = rows(machine, session, "poses.csv") + more
    deadline = time.monotonic() + limit
    while rows(machine, session, "poses.csv") < enough:
        need(time.monotonic() < deadline, "%d poses did not come in %d s:\n%s" % (more, limit, machine.run("journalctl -u vergence --no-pager -o cat | tail -n 40")[1]))
        time.sleep(2)


def look(machine, session):
    """What a session that was closed holds; → its summary."""
    summary = json.loads(done(machine, "cat %s/%s/summary.json" % (SESSIONS, session)))
    frames, devices = summary["frames"], summary["devices"]
    statuses = done(machine, "tail -n +2 %s/%s/poses.csv | cut -d, -f4,5 | sort | uniq -c" % (SESSIONS, session))
    say("session %s: %d frames read, %d posed; statuses: %s; %d readings of the INS; %d pulses of the board, %d lost; drops %s" % (
        session, frames["read"], frames["posed"], "; ".join(" ".join(line.split()) for line in statuses.splitlines()),
        summary["comparison"]["ins_samples"], devices["board_pulses"], devices["board_lost"], summary["drops"]["frames"]))
    need(frames["read"] > 0 and frames["read"] == sum(frames[word] for word in ("ok", "degraded", "lost")), "frames without a status")
    need(summary["comparison"]["ins_samples"] > 0, "no reading of the INS")
    need(devices["board_pulses"] > 0, "no pulse of the board")
    done(machine, "test -s %s/%s/report.html" % (SESSIONS, session))
    return summary


def service_drives(machine):
    say("ready after %.0f s" % start_service(machine))
    need(machine.run("systemctl is-active vergence")[1] == "active", "the service is not active")
    session = newest_session(machine)
    drive(machine, session, 60)
    pid = done(machine, "systemctl show -P MainPID vergence")
    say(done(machine, "systemctl status vergence --no-pager -n 3"))
    need(done(machine, "stat -c %%U /proc/%s" % pid) == "vergence", "the service is somebody else")
    started = time.monotonic()
    done(machine, "systemctl stop vergence", 120)
    say("stopped after %.0f s" % (time.monotonic() - started))
    result = done(machine, "systemctl show -P Result vergence")
    need(result == "success", "the service ended with %s" % result)
    need(done(machine, "stat -c '%%U %%a' %s/%s" % (SESSIONS, session)).startswith("vergence 750"), "the session is not the user's alone")
    look(machine, session)
    return session


# Small images: most of the time goes into rendering them.
MOCK = (AS_USER + "vergence run /usr/share/vergence/config/mock.yaml --fast --quiet --set rig.state_dir=/var/lib/vergence/mock "
        "--set trigger.rate=10 --set cameras.0.size=[320,240] --set cameras.1.size=[320,240] --set mock.texture_detail=0 --duration %d --out %s/%s %s")


def mock_drive(machine, name, seconds, more=""):
    """A drive through the rendered suburb, in virtual time: the poses are known to be good or not."""
    started = time.monotonic()
    status, text = machine.run("mkdir -p /var/lib/vergence/mock && chown vergence: /var/lib/vergence/mock && " + MOCK % (seconds, SESSIONS, name, more), 1200)
    need(status in (0, 1), "the mock drive: %d\n%s" % (status, text))
    summary = json.loads(done(machine, "cat %s/%s/summary.json" % (SESSIONS, name)))
    frames, calibration = summary["frames"], summary["calibration"]
    say("mock drive of %d s in %.0f s (%s): %d poses, %d ok, %d degraded, %d lost; calibration %s, accepted %d; off the truth by %.1f mm rms" % (
        seconds, time.monotonic() - started, summary["simd"], frames["posed"], frames["ok"], frames["degraded"], frames["lost"],
        calibration["source"], calibration["accepted"], 1e3 * summary["truth"]["ate_m"]))
    return summary


def after_the_cut(vehicle, whole, cut, rows_before, stamp_before):
    machine = vehicle.machine
    say("powered on again, shell after %.0f s" % vehicle.power_on())
    say("file system: %s" % done(machine, "journalctl -b -k -o cat --no-pager | grep -i 'EXT4-fs (vda)' | head -n 3; dumpe2fs -h /dev/vda 2>/dev/null | grep 'Filesystem state'"))
    deadline = time.monotonic() + 300
    while machine.run("systemctl is-active vergence")[1] != "active":
        need(time.monotonic() < deadline, "the enabled service did not start:\n" + machine.run("systemctl status vergence --no-pager -n 30")[1])
        time.sleep(2)
    failed = done(machine, "journalctl -b -u vergence -o cat --no-pager | sed -n 's/.*code=exited, status=\\([0-9]*\\).*/\\1/p'").split()
    say("the enabled service drives, after %d starts that failed for want of the INS, with exit codes %s" % (len(failed), sorted(set(failed))))
    need(set(failed) <= {"3"}, "a device that is not there yet is exit code 3:\n" + machine.run("journalctl -b -u vergence -o cat --no-pager")[1])
    session = newest_session(machine, cut)
    need(session not in (whole, cut), "the session's name is taken")
    drive(machine, session, 30)
    kept = rows(machine, cut, "poses.csv")
    lost = stamp_before - last_stamp(machine, cut)
    say("of the session that was cut, %d of %d lines of poses.csv are there; the last %.1f s are lost" % (kept, rows_before, lost))
    need(kept > 1, "nothing of the session that was cut is left")
    need(lost < LOST_AT_MOST, "that is more than the program's and the file system's periods")
    done(machine, AS_USER + "vergence report %s/%s" % (SESSIONS, cut), 240)
    done(machine, "test -s %s/%s/report.html && test -s %s/%s/summary.json" % (SESSIONS, cut, SESSIONS, whole))
    say("vergence report has made its report")
    done(machine, "systemctl stop vergence", 120)
    look(machine, session)


def test(given):
    vehicle = Vehicle(given)
    machine = vehicle.machine
    try:
        say("power on: shell after %.0f s, %s" % (vehicle.power_on(), done(machine, "uname -sr")))
        install(machine)
        configure(machine)
        rules(machine)
        whole = service_drives(machine)
        first = mock_drive(machine, "mock-1", 6, "--from-scratch")
        need(first["calibration"]["accepted"] > 0, "no calibration was accepted")

        done(machine, "systemctl enable vergence && sync")
        start_service(machine)
        cut = newest_session(machine, whole)
        drive(machine, cut, 60)
        lines, stamp = rows(machine, cut, "poses.csv"), last_stamp(machine, cut)
        say("power cut amid the session %s, %d lines in poses.csv" % (cut, lines))
        machine.power_cut()

        after_the_cut(vehicle, whole, cut, lines, stamp)
        second = mock_drive(machine, "mock-2", 8)
        need(second["frames"]["ok"] > 0, "no pose is ok")
        need(second["calibration"]["source"].endswith("calibration_state.yaml"), "the stored calibration was not taken up")
        started = time.monotonic()
        machine.power_off()
        say("switched off after %.0f s" % (time.monotonic() - started))
    finally:
        vehicle.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("image", "package", "board", "work"):
        parser.add_argument("--" + name, required=True)
    parser.add_argument("ins", nargs="+")
    given = parser.parse_args()
    try:
        test(given)
    except (Wrong, MachineError) as error:
        say("wrong: %s" % error)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
