"""Mutates the example configurations, a small data folder and small bags, and runs the program on each.

None may crash, run longer than LIMIT_S of its own time, hold more than LIMIT_BYTES or end with another code than 0, 1, 2 (3 is for
devices, which no run here has). Usage: mutate_examples.py PROGRAM EXAMPLES RUNS [SEED]. The seed of a failure is printed with its files.
mutate_examples.py --bags FOLDER writes the bags alone, for bag_fuzz to begin with.
"""
import bz2
import math
import os
import random
import resource
import shutil
import struct
import subprocess
import sys
import tempfile
import zlib
from pathlib import Path

LIMIT_S = 2.0
LIMIT_BYTES = 1 << 30
CODES = {0, 1, 2}
# What makes a run long without being a mistake is set after the mutated file.
SMALL = [f"cameras.{k}.size=[64, 48]" for k in range(2)] + ["mock.texture_detail=0", "odometry.features=60", "rig.state_dir=none"]
WORDS = ["", "0", "-1", "1", "nan", ".inf", "1e308", "-0", "99999999999999999999", "true", "off", "null", "~", "[]", "{}", "[1, 2]", "{a: b}",
         "&a [*a]", "\"", "'", "\x00", "\xff\xfe", "é", "- -", "cameras", "!!binary x", "|", "%YAML:1.0", "../../etc/passwd", "\t", "#"]


def mutated(data: bytes, rng: random.Random) -> bytes:
    """One to three changes of bytes, words, numbers or lines."""
    for _ in range(rng.randint(1, 3)):
        kind = rng.randrange(7)
        at = rng.randrange(len(data) + 1)
        if kind == 0 and data:
            data = data[: at % len(data)] + bytes([rng.randrange(256)]) + data[at % len(data) + 1 :]
        elif kind == 1:
            data = data[:at] + rng.choice(WORDS).encode("utf-8", "replace") + data[at:]
        elif kind == 2:
            data = data[:at] + data[at + rng.randint(1, 40) :]
        elif kind == 3:
            data = data[:at]
        else:
            lines = data.split(b"\n")
            i = rng.randrange(len(lines))
            if kind == 4:
                lines.insert(i, lines[rng.randrange(len(lines))])
            elif kind == 5:
                digits = [j for j, c in enumerate(lines[i]) if chr(c).isdigit()]
                if digits:
                    j = rng.choice(digits)
                    lines[i] = lines[i][:j] + rng.choice(WORDS).encode("utf-8", "replace") + lines[i][j + 1 :]
            else:
                lines[i] = lines[i].replace(b":", b": " + rng.choice(WORDS).encode("utf-8", "replace"), 1)
            data = b"\n".join(lines)
    return data


def png(width: int, height: int, seed: int) -> bytes:
    """A grey picture of blocks that move by the seed."""
    rows = bytearray()
    for y in range(height):
        rows.append(0)
        rows.extend(((((x + seed) // 7) * 7919 + (y // 5) * 104729) * 2654435761 >> 13) & 0xFF for x in range(width))

    def chunk(name: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))

    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(bytes(rows))) + chunk(b"IEND", b"")


def write_folder(folder: Path) -> None:
    pairs, width, height = 5, 96, 72
    for side in ("left", "right"):
        (folder / side).mkdir(parents=True)
        for i in range(pairs):
            (folder / side / f"{i:03d}.png").write_bytes(png(width, height, 2 * i + (5 if side == "right" else 0)))
    (folder / "times.txt").write_text("".join(f"{0.1 * i:.1f}\n" for i in range(pairs)))
    (folder / "truth.tum").write_text("".join(f"{0.1 * i:.1f} 0 0 {0.5 * i} 0 0 0 1\n" for i in range(pairs)))
    lens = f"size: [{width}, {height}], model: pinhole-radtan, intrinsics: [80, 80, 48, 36], distortion: [0.0, 0.0, 0.0, 0.0]"
    (folder / "calibration.yaml").write_text(
        f"version: 1\nrig: {{name: tiny, baseline: 0.5}}\ncameras:\n  - {{name: left, {lens}}}\n  - {{name: right, {lens},\n"
        "     T_camera_left: [1, 0, 0, -0.5, 0, 1, 0, 0, 0, 0, 1, 0], sigma_total: [0.001, 0.001, 0.001, 0.001, 0.001, 0.001]}\n"
        "found: {stamp: 1403636584763555584, source: online, frames: 60, reprojection_px: 0.18, scale_sigma: 0.0021}\n"
    )


class Message:
    """Values of a ROS message one after the other: aligned and behind four bytes (CDR), or as ROS 1 has them."""

    def __init__(self, cdr: bool, ns: int):
        self.cdr, self.body = cdr, b""
        if not cdr:
            self.put("I", 7)
        self.put("I", ns // 10**9).put("I", ns % 10**9).text("f")

    def put(self, kind: str, *values) -> "Message":
        for value in values:
            size = struct.calcsize("<" + kind)
            if self.cdr:
                self.body += bytes(-len(self.body) % size)
            self.body += struct.pack("<" + kind, value)
        return self

    def text(self, word: str) -> "Message":
        raw = word.encode() + (b"\0" if self.cdr else b"")
        return self.blob(raw)

    def blob(self, raw: bytes) -> "Message":
        self.put("I", len(raw))
        self.body += raw
        return self

    def bytes(self) -> bytes:
        return (b"\0\1\0\0" if self.cdr else b"") + self.body


TOPICS = ["/left/image_raw", "/right/image_raw", "/left/camera_info", "/right/camera_info", "/fix", "/imu"]
TYPES = ["Image", "Image", "CameraInfo", "CameraInfo", "NavSatFix", "Imu"]


def messages(cdr: bool) -> list:
    """(topic's number, time, bytes) of five pairs with their calibration and an INS."""
    width, height, out = 96, 72, []
    for i in range(5):
        ns = 10**18 + 10**8 * i
        for k in range(2):
            rows = bytes((((x + 2 * i + 5 * k) // 7) * 7919 + (y // 5) * 104729) * 2654435761 >> 13 & 0xFF for y in range(height) for x in range(width))
            out.append((k, ns, Message(cdr, ns).put("I", height, width).text("mono8").put("B", 0).put("I", width).blob(rows).bytes()))
            info = Message(cdr, ns).put("I", height, width).text("plumb_bob").put("I", 5).put("d", *[0.0] * 5)
            info.put("d", 80, 0, 48, 0, 80, 36, 0, 0, 1).put("d", 1, 0, 0, 0, 1, 0, 0, 0, 1)
            out.append((2 + k, ns, info.put("d", 80, 0, 48, -40 * k, 0, 80, 36, 0, 0, 0, 1, 0).bytes()))
        fix = Message(cdr, ns).put("b", 0).put("H", 1).put("d", -27.5, 153 + 1e-5 * i, 40).put("d", *[1.0] * 9).put("B", 2)
        out.append((4, ns, fix.bytes()))
        out.append((5, ns, Message(cdr, ns).put("d", 0, 0, 0, 1).put("d", *[1e-4] * 9).put("d", *[0.0] * 24).bytes()))
    return out


def mcap() -> bytes:
    def text(word: str) -> bytes:
        return struct.pack("<I", len(word)) + word.encode()

    def record(op: int, body: bytes) -> bytes:
        return struct.pack("<BQ", op, len(body)) + body

    chunk = b""
    for i, (topic, kind) in enumerate(zip(TOPICS, TYPES)):
        chunk += record(3, struct.pack("<H", i) + text("sensor_msgs/msg/" + kind) + text("ros2msg") + text(""))
        chunk += record(4, struct.pack("<HH", i, i) + text(topic) + text("cdr") + text(""))
    for i, ns, body in messages(True):
        chunk += record(5, struct.pack("<HIQQ", i, 0, ns, ns) + body)
    whole = record(6, struct.pack("<QQQI", 0, 0, len(chunk), 0) + text("") + struct.pack("<Q", len(chunk)) + chunk)
    return b"\x89MCAP0\r\n" + record(1, text("ros2") + text("")) + whole + record(15, bytes(4)) + record(2, bytes(20)) + b"\x89MCAP0\r\n"


def rosbag(compression: str) -> bytes:
    def fields(**values: bytes) -> bytes:
        return b"".join(struct.pack("<I", len(n) + 1 + len(v)) + n.encode() + b"=" + v for n, v in values.items())

    def record(header: bytes, data: bytes) -> bytes:
        return struct.pack("<I", len(header)) + header + struct.pack("<I", len(data)) + data

    chunk = b""
    for i, (topic, kind) in enumerate(zip(TOPICS, TYPES)):
        about = fields(topic=topic.encode(), type=b"sensor_msgs/" + kind.encode(), md5sum=b"*", message_definition=b"")
        chunk += record(fields(op=b"\7", conn=struct.pack("<I", i), topic=topic.encode()), about)
    for i, ns, body in messages(False):
        chunk += record(fields(op=b"\2", conn=struct.pack("<I", i), time=struct.pack("<II", ns // 10**9, ns % 10**9)), body)
    packed = bz2.compress(chunk) if compression == "bz2" else chunk
    head = record(fields(op=b"\3", index_pos=bytes(8), conn_count=bytes(4), chunk_count=bytes(4)), b" " * 40)
    return b"#ROSBAG V2.0\n" + head + record(fields(op=b"\5", compression=compression.encode(), size=struct.pack("<I", len(chunk))), packed)


def write_bags(folder: Path) -> None:
    folder.mkdir()
    (folder / "a.mcap").write_bytes(mcap())
    (folder / "a.bag").write_bytes(rosbag("none"))
    (folder / "b.bag").write_bytes(rosbag("bz2"))


def run(command: list, work: Path) -> str:
    """What is wrong with how the program ended; empty: nothing. Too little of a busy machine is not hanging: what hangs does so twice."""
    first = run_once(command, work)
    if first != "hangs":
        return first
    shutil.rmtree(work / "out", ignore_errors=True)
    return run_once(command, work)


def run_once(command: list, work: Path) -> str:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        # Of the wall's time far more than LIMIT_S: the machine may be busy with other things.
        done = subprocess.run(command, cwd=work, stdin=subprocess.DEVNULL, capture_output=True, timeout=15 * LIMIT_S, preexec_fn=limit)
    except subprocess.TimeoutExpired:
        return "hangs"
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    if done.returncode not in CODES:
        return f"ends with {done.returncode}: {done.stderr[-400:]!r}"
    if used > LIMIT_S:
        return f"took {used:.1f} s"
    if done.returncode == 2 and not done.stderr.startswith(b"vergence: "):
        return f"refuses without a message: {done.stderr[-400:]!r}"
    return ""


def limit() -> None:
    resource.setrlimit(resource.RLIMIT_DATA, (LIMIT_BYTES, LIMIT_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(4 * LIMIT_S), math.ceil(4 * LIMIT_S)))


def one_folder(program: str, original: Path, work: Path, rng: random.Random) -> str:
    folder = work / "data"
    shutil.copytree(original, folder)
    files = sorted(p for p in folder.rglob("*") if p.is_file())
    text = [p for p in files if p.suffix != ".png"]
    for _ in range(rng.randint(1, 2)):
        file = rng.choice(text if rng.random() < 0.8 else files)
        file.write_bytes(mutated(file.read_bytes(), rng))
    if rng.random() < 0.1:
        rng.choice(files).unlink()
    options = rng.choice([[], [], ["--from-scratch"], ["--focal", "80", "--baseline", "0.5"], ["--baseline", "0.3"], ["--frames", "3"]])
    return run([program, "replay", "data", "--quiet", "--threads", "1", "--out", "out", *options], work)


def one_bag(program: str, bags: list, work: Path, rng: random.Random) -> str:
    bag = rng.choice(bags)
    data = bag.read_bytes()
    # Pixels are most of a bag: all but a few changes are where records begin.
    at = rng.randrange(len(data)) if rng.random() < 0.3 else 0
    spoilt = data[:at] + mutated(data[at : at + 2000], rng) + data[at + 2000 :] if bag.name != "b.bag" else mutated(data, rng)
    (work / bag.name).write_bytes(spoilt)
    options = rng.choice([[], [], ["--from-scratch"], ["--ins-topic", "/fix"], ["--left-topic", "/right/image_raw"], ["--frames", "3"]])
    return run([program, "replay", bag.name, "--quiet", "--threads", "1", "--out", "out", *options], work)


def one_configuration(program: str, examples: list, work: Path, rng: random.Random) -> str:
    text = rng.choice(examples).read_bytes()
    (work / "rig.yaml").write_bytes(mutated(text, rng))
    mocked = [f"cameras.{k}.driver=mock" for k in range(2)] + ["trigger.driver=mock", "ins.driver=mock"]
    settings = [word for key in SMALL + (mocked if b"driver: mock" not in text else []) for word in ("--set", key)]
    return run([program, "run", "rig.yaml", "--fast", "--duration", "0.1", "--quiet", "--threads", "1", "--out", "out", *settings], work)


def main() -> int:
    if sys.argv[1] == "--bags":
        write_bags(Path(sys.argv[2]))
        return 0
    program, examples, runs = os.path.abspath(sys.argv[1]), sorted(Path(sys.argv[2]).glob("mock*.yaml")), int(sys.argv[3])
    seed = int(sys.argv[4]) if len(sys.argv) > 4 else 1
    failures = 0
    with tempfile.TemporaryDirectory(prefix="vergence-mutate-") as root:
        original = Path(root) / "original"
        write_folder(original)
        write_bags(Path(root) / "bags")
        bags = sorted((Path(root) / "bags").iterdir())
        for bag in bags:  # as they are they are drives
            done = subprocess.run([program, "replay", bag, "--quiet", "--out", root + "/" + bag.name], capture_output=True)
            if done.returncode > 1:
                print(f"{bag.name} as it is ends with {done.returncode}: {done.stderr.decode()}")
                failures += 1
        for i in range(seed, seed + runs):
            rng = random.Random(i)
            work = Path(root) / "work"
            work.mkdir()
            if i % 2:
                wrong = one_configuration(program, examples, work, rng)
            else:
                wrong = one_bag(program, bags, work, rng) if i % 4 else one_folder(program, original, work, rng)
            if wrong:
                failures += 1
                print(f"seed {i}: {wrong}")
                keep = Path(os.environ.get("KEEP_FAILURES", root + "/kept")) / str(i)
                shutil.copytree(work, keep, dirs_exist_ok=True)
            shutil.rmtree(work)
    print(f"{runs} runs, {failures} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
