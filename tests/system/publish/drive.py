"""A mock drive in real time with small images, and what its session holds."""
import csv
import json
import os
import pathlib
import re
import socket
import subprocess
import time

SMALL = ["--set", "cameras.0.size=[320,240]", "--set", "cameras.1.size=[320,240]", "--set", "mock.texture_detail=0"]


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Drive:
    """`vergence run` in the background; its messages go to a file."""

    def __init__(self, folder, seconds, *words):
        self.session = pathlib.Path(folder)
        self.log = self.session.with_suffix(".log")
        configuration = os.path.join(os.environ["SOURCES"], "app/config/mock.yaml")
        command = [os.environ["VERGENCE"], "run", configuration, "--out", str(self.session), "--duration", str(seconds), *SMALL, *words]
        with open(self.log, "wb") as log:
            self.process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stderr=log)

    def messages(self):
        return self.log.read_text(encoding="utf-8")

    def wait_for(self, pattern, seconds=60):
        """The first group of a message of that form."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            found = re.search(pattern, self.messages())
            if found:
                return found.group(1)
            if self.process.poll() is not None:
                break
            time.sleep(0.05)
        raise AssertionError(f"the program does not say {pattern}:\n{self.messages()}")

    def end(self, seconds=120):
        code = self.process.wait(seconds)
        return code

    def stop(self):
        if self.process.poll() is None:
            self.process.terminate()
        return self.process.wait(60)

    def poses(self):
        with open(self.session / "poses.csv", encoding="utf-8") as file:
            return {int(row["frame"]): row for row in csv.DictReader(file)}

    def summary(self):
        return json.loads((self.session / "summary.json").read_text(encoding="utf-8"))

    def events(self):
        return [json.loads(line) for line in (self.session / "events.jsonl").read_text(encoding="utf-8").splitlines()]


def connected(path, seconds=60):
    """A reader of the Unix socket, as soon as there is one."""
    until = time.monotonic() + seconds
    while True:
        reader = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            reader.connect(str(path))
            return reader
        except OSError:
            reader.close()
            if time.monotonic() > until:
                raise
            time.sleep(0.02)
