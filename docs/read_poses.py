#!/usr/bin/env python3
"""Reads the pose stream: read_poses.py unix:///run/vergence/pose.sock [recalibrate] | udp://127.0.0.1:9870

Poses are printed to standard output; lines of other types (calibration, alignment, status, response) to standard error unchanged. With
`recalibrate` that is requested once. docs/live_interface.md is the schema. Ends when the program does.
"""
import json
import socket
import sys

VERSION = 2


def lines(address, request=None):
    """Lines as they come, from `publish.pose_stream` of the configuration."""
    kind, _, place = address.partition("://")
    if kind == "unix":
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as stream:
            stream.connect(place)
            for number, line in enumerate(stream.makefile("r", encoding="utf-8")):
                if request and number == 0:  # the first line shows that the session has begun
                    stream.sendall(json.dumps({"request": request}).encode() + b"\n")
                yield line
    else:
        host, _, port = place.rpartition(":")
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as datagrams:
            datagrams.bind((host, int(port)))
            while True:
                yield datagrams.recv(65536).decode("utf-8")


def main():
    for text in lines(*sys.argv[1:3]):
        line = json.loads(text)
        if line["version"] != VERSION:
            sys.exit("read_poses: the stream has version %s, this program reads version %d" % (line["version"], VERSION))
        if line["type"] != "pose":
            print(text.rstrip(), file=sys.stderr, flush=True)
            continue
        place = ["%9.3f" % v for v in line["pose"]["position_m"]] if line["pose"] else ["no pose"]
        print(line["frame"], line["status"], line["reason"] or "-", *place, flush=True)


if __name__ == "__main__":
    main()
