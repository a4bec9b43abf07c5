"""Mutates the example configurations and a small data folder, and runs the program on each.

None may crash, run longer than LIMIT_S of its own time, hold more than LIMIT_BYTES or end with another code than 0, 1, 2 (DESIGN §6; 3 is for
devices, which no run here has). Usage: mutate_examples.py PROGRAM EXAMPLES RUNS [SEED]. The seed of a failure is printed with its files.
"""
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
        "     T_camera_left: [1, 0, 0, -0.5, 0, 1, 0, 0, 0, 0, 1, 0], sigma_wide: [0.001, 0.001, 0.001, 0.001, 0.001, 0.001]}\n"
        "found: {stamp: 1403636584763555584, source: online, frames: 60, reprojection_px: 0.18, scale_sigma: 0.0021}\n"
    )


def run(command: list, work: Path) -> str:
    """What is wrong with how the program ended; empty: nothing."""
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
        return f"refuses without a sentence: {done.stderr[-400:]!r}"
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


def one_configuration(program: str, examples: list, work: Path, rng: random.Random) -> str:
    text = rng.choice(examples).read_bytes()
    (work / "rig.yaml").write_bytes(mutated(text, rng))
    mocked = [f"cameras.{k}.driver=mock" for k in range(2)] + ["trigger.driver=mock", "ins.driver=mock"]
    settings = [word for key in SMALL + (mocked if b"driver: mock" not in text else []) for word in ("--set", key)]
    return run([program, "run", "rig.yaml", "--fast", "--duration", "0.1", "--quiet", "--threads", "1", "--out", "out", *settings], work)


def main() -> int:
    program, examples, runs = os.path.abspath(sys.argv[1]), sorted(Path(sys.argv[2]).glob("mock*.yaml")), int(sys.argv[3])
    seed = int(sys.argv[4]) if len(sys.argv) > 4 else 1
    failures = 0
    with tempfile.TemporaryDirectory(prefix="vergence-mutate-") as root:
        original = Path(root) / "original"
        write_folder(original)
        for i in range(seed, seed + runs):
            rng = random.Random(i)
            work = Path(root) / "work"
            work.mkdir()
            wrong = one_folder(program, original, work, rng) if i % 2 else one_configuration(program, examples, work, rng)
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
