#!/usr/bin/env python3
"""Prints the poses that vergence publishes: read_poses.py unix:///run/vergence/pose.sock | udp://127.0.0.1:9870

One JSON object a line, docs/live_interface.md says what is in it. Ends when the program does.
"""
import json
import socket
import sys


def lines(address):
    """Lines as they come, from `publish.pose_stream` of the configuration."""
    kind, _, place = address.partition("://")
    if kind == "unix":
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as stream:
            stream.connect(place)
            yield from stream.makefile("r", encoding="utf-8")
    else:
        host, _, port = place.rpartition(":")
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as datagrams:
            datagrams.bind((host, int(port)))
            while True:
                yield datagrams.recv(65536).decode("utf-8")


def main():
    for line in lines(sys.argv[1]):
        pose = json.loads(line)
        if pose["version"] != 2:
            sys.exit("read_poses: the stream has version %s, this program reads version 2" % pose["version"])
        if pose["type"] != "pose":  # calibration, alignment, status: docs/live_interface.md
            continue
        place = ["%9.3f" % v for v in pose["pose"]["position_m"]] if pose["pose"] else ["no pose"]
        print(pose["frame"], pose["status"], pose["reason"] or "-", *place, flush=True)


if __name__ == "__main__":
    main()
