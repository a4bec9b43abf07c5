#!/usr/bin/env python3
"""Pose lines of a mock drive in real time against its poses.csv: over a Unix socket beside readers that do not read, over UDP, by the
documented reader; and what is said where the socket cannot be had."""
import json
import os
import pathlib
import socket
import subprocess
import sys
import tempfile
import threading

import drive as d

KEYS = {"version", "type", "frame", "stamp_ns", "state", "status", "reason", "pose", "covariance", "motion_covariance", "length_sigma", "enu", "inliers", "stereo_inliers",
        "reprojection_px", "estimate_ms", "age_ms", "dropped"}
SLACK_MS = 50  # of a machine that runs other tests beside this one; the figure itself is publish_bench's


def check_lines(lines, poses, placed_wanted):
    """Every pose line against its row of poses.csv."""
    kinds = [line["type"] for line in lines]
    assert "status" in kinds and all(line["version"] == 2 for line in lines), kinds
    lines = [line for line in lines if line["type"] == "pose"]
    assert lines, "no line came"
    placed = 0
    frames = [line["frame"] for line in lines]
    assert frames == sorted(set(frames)), "lines out of order, or one twice"
    for line in lines:
        assert set(line) == KEYS, set(line) ^ KEYS
        row = poses[line["frame"]]
        assert line["stamp_ns"] == int(row["stamp_ns"])
        for key in ("state", "status"):
            assert line[key] == row[key], (line, row)
        assert line["reason"] == row["reason"], (line, row)
        assert line["inliers"] == int(row["inliers"])
        if line["status"] == "lost":
            assert line["pose"] is None and line["enu"] is None and line["covariance"] is None
            continue
        assert len(line["covariance"]) == len(line["motion_covariance"]) == 21
        for ours, name in zip(line["pose"]["position_m"], "xyz"):
            assert abs(ours - float(row[name])) < 2e-4, (line, row)
        assert line["age_ms"] is not None and line["age_ms"] > 0
        if line["enu"] and row["east"]:
            placed += 1
            for ours, name in zip(line["enu"]["enu_m"], ("east", "north", "up")):
                assert abs(ours - float(row[name])) < 2e-3, (name, line, row)
            assert abs(line["enu"]["latitude_deg"] - float(row["latitude_deg"])) < 1e-7
            turn = abs(line["enu"]["heading_deg"] - float(row["heading_deg"]))
            assert min(turn, 360 - turn) < 1e-2, (line, row)
    assert placed > 20 or not placed_wanted, f"only {placed} lines are on the earth"


def read_images(stream):
    """(camera, stamp, size, bytes) of all images until the stream ends."""
    images = []
    for line in iter(stream.readline, b""):
        line = json.loads(line)
        if line["type"] == "image":
            images.append((line["camera"], line["stamp_ns"], (line["width"], line["height"]), stream.read(line["bytes"])))
    return images


def over_unix(below):
    path = below / "pose.sock"
    run = d.Drive(below / "unix", 22, "--set", f"publish.pose_stream=unix://{path}", "--set", "comparison.alignment_distance_m=15")
    reader = d.connected(path)
    idle = [d.connected(path) for _ in range(3)]  # they never read, and disturb nobody
    pictures = d.connected(path)
    pictures.recv(1)  # the session has begun
    pictures.sendall(b'{"request": "images", "rate_hz": 2}\n')
    stream = pictures.makefile("rb")
    stream.readline()  # the rest of the line above
    images = []
    thread = threading.Thread(target=lambda: images.extend(read_images(stream)))
    thread.start()
    lines = [json.loads(line) for line in reader.makefile("r", encoding="utf-8")]
    assert run.end() == 0, run.messages()
    thread.join(30)
    for socket_ in idle:
        socket_.close()
    poses = run.poses()
    check_lines(lines, poses, True)
    stamps = {int(row["stamp_ns"]) for row in poses.values()}
    assert 2 * 15 <= len(images) <= 2 * 50, len(images)
    assert [camera for camera, *_ in images] == [0, 1] * (len(images) // 2)
    for _, stamp, (width, height), pixels in images:
        assert stamp in stamps and len(pixels) == width * height and len(set(pixels)) > 10, (stamp, width, height)
    kinds = [line["type"] for line in lines]
    assert kinds.count("pose") > 0.9 * len(poses), (len(lines), len(poses))
    assert kinds.index("calibration") < kinds.index("pose") and "alignment" in kinds, kinds
    devices = run.summary()["devices"]
    assert devices["lines"] + devices["lines_dropped"] == len(poses), devices
    assert devices["line_behind_pose_p99_us"] < SLACK_MS * 1000, devices
    assert devices["line_age_p99_us"] > devices["line_behind_pose_p99_us"], devices
    assert not path.exists(), "the socket file stays behind"
    # A long result is wrapped; its further lines are indented.
    last = [line for line in run.messages().splitlines() if not line.startswith(" ")][-3:]
    assert [line.split(":")[0] for line in last] == ["result", "to do", "report"], last


def over_udp(below):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(20)
        run = d.Drive(below / "udp", 6, "--set", "publish.pose_stream=udp://127.0.0.1:%d" % receiver.getsockname()[1])
        lines = []
        ended = threading.Event()

        def read():
            while not ended.is_set():
                try:
                    lines.append(json.loads(receiver.recv(65536)))
                except TimeoutError:
                    return
                receiver.settimeout(3)

        thread = threading.Thread(target=read)
        thread.start()
        assert run.end() in (0, 1), run.messages()  # 1: on a busy machine six seconds may be too short to verify the calibration
        ended.set()
        thread.join(30)
    check_lines(lines, run.poses(), False)
    assert len([line for line in lines if line["type"] == "pose"]) > 0.8 * len(run.poses())


def documented_reader(below):
    path = below / "reader.sock"
    run = d.Drive(below / "reader", 4, "--set", f"publish.pose_stream=unix://{path}")
    d.connected(path).close()
    reader = subprocess.run([sys.executable, os.path.join(os.environ["SOURCES"], "docs/read_poses.py"), f"unix://{path}", "recalibrate"],
                            check=True, capture_output=True, text=True, timeout=60)
    assert run.end() in (0, 1), run.messages()  # 1: while the rig is recalibrated no pose is ok
    rows = run.poses()
    printed = [line.split() for line in reader.stdout.splitlines()]
    assert len(printed) > 0.8 * len(rows), len(printed)
    for frame, status, reason, *place in printed:
        row = rows[int(frame)]
        assert status == row["status"] and reason == (row["reason"] or "-")
        assert abs(float(place[0]) - float(row["x"])) < 1e-3
    others = [json.loads(line) for line in reader.stderr.splitlines()]
    assert [line["accepted"] for line in others if line["type"] == "response"] == [True], others
    assert [event["kind"] for event in run.events()].count("recalibration_requested") == 1


def without_a_place(below):
    run = d.Drive(below / "nowhere", 2, "--set", f"publish.pose_stream=unix://{below}/no/folder/pose.sock")
    assert run.end() == 0, run.messages()
    assert "the run continues without the pose stream" in run.messages(), run.messages()
    bad = d.Drive(below / "bad", 2, "--set", "publish.pose_stream=tcp://somewhere:1")
    assert bad.end() == 2, bad.messages()
    assert "publish.pose_stream" in bad.messages() and not bad.session.exists(), bad.messages()


def main():
    with tempfile.TemporaryDirectory(prefix="vergence-lines-") as below:
        for case in (over_unix, over_udp, documented_reader, without_a_place):
            case(pathlib.Path(below))
            print(f"{case.__name__}: as it should be", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
