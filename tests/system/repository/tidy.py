#!/usr/bin/env python3
"""clang-tidy over the product, files of a folder together: most of its time goes into headers, which a batch reads once.

  tidy.py [PREFIX...] --root FOLDER --build FOLDER      files whose path begins with a PREFIX; without one: all
  tidy.py --part K/N ...                                the K-th of N parts of the batches
  tidy.py --self-test

A batch is a file that includes sources of one folder with one compile command, and with no name in the unnamed namespaces of two of
them; what still does not compile together is looked at file by file. Batches that were clean are remembered in BUILD/tidy by
their content, that of every header they include, and the checks: they are looked at again when one of these changes.

Exit: 0 clean, 1 findings, 77 cannot be checked here.
"""
import argparse
import collections
import concurrent.futures
import hashlib
import json
import os
import re
import shlex
import shutil
import subprocess
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../scripts/cmake"))
import united_files  # noqa: E402: of the build

SKIPPED = 77
ROOMS = ("app/", "core/", "drivers/", "firmware_iface/")
MOST_FILES = 16  # of a batch: more takes more memory than two processes may
# Compiled once for each instruction set by including itself again, which only a file by itself can.
DISPATCHED = "hwy/foreach_target.h"
HEADERS = r"/(app|core|drivers|firmware_iface)/.*\.(hpp|h|cpp)$"
FINDING = re.compile(r"^(\S+?):\d+:\d+: (?:error|warning): ", re.MULTILINE)

Batch = collections.namedtuple("Batch", "files command directory")


def configured(root, build):
    """A folder below BUILD whose compile_commands.json has every file by itself, which BUILD itself need not."""
    folder = os.path.join(build, "tidy", "configured")
    done = subprocess.run(["cmake", "-S", root, "-B", folder, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=RelWithDebInfo", "-DVERGENCE_UNITY=OFF",
                           "-DVERGENCE_CCACHE=OFF", "-DVERGENCE_TESTS=OFF", "-DVERGENCE_CHECKERBOARD=ON"], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit("cannot configure %s:\n%s" % (folder, done.stderr))
    return folder


def commands(root, build):
    """{file: (compiler's arguments without the files, directory)} of the product."""
    with open(os.path.join(build, "compile_commands.json"), encoding="utf-8") as file:
        entries = json.load(file)
    found = {}
    for entry in entries:
        name = os.path.relpath(os.path.realpath(os.path.join(entry["directory"], entry["file"])), os.path.realpath(root))
        if not name.startswith(ROOMS) or name in found:
            continue
        words, kept = shlex.split(entry["command"]), []
        while words:
            word = words.pop(0)
            if word in ("-o", "-c", "-MF", "-MT", "-MQ"):
                words.pop(0)
            elif word not in ("-MD", "-MMD"):
                kept.append(word)
        found[name] = (kept, entry["directory"])
    return found


def batches(root, build, prefixes):
    """Every file of the product in one batch."""
    open_ones, closed = {}, []
    for name, (command, directory) in sorted(commands(root, build).items()):
        if prefixes and not name.startswith(tuple(prefixes)):
            continue
        with open(os.path.join(root, name), encoding="utf-8") as file:
            text = file.read()
        if name.endswith(".c") or DISPATCHED in text:
            closed.append(Batch([name], command, directory))
            continue
        names, key = united_files.defined(text), (os.path.dirname(name), tuple(command))
        for batch, taken in open_ones.setdefault(key, []):
            if len(batch.files) < MOST_FILES and not names & taken:
                batch.files.append(name)
                taken |= names
                break
        else:
            open_ones[key].append((Batch([name], command, directory), set(names)))
    return closed + [batch for same in open_ones.values() for batch, _ in same]


def configurations(root):
    """The tree's .clang-tidy files, relative."""
    return [".clang-tidy"] + sorted(
        os.path.relpath(os.path.join(folder, ".clang-tidy"), root)
        for room in ROOMS for folder, _, files in os.walk(os.path.join(root, room)) if ".clang-tidy" in files)


def content(batch, unit, folder):
    """A hash of all that clang-tidy reads of a batch, or None where that is not known."""
    listed = subprocess.run(["clang++", *batch.command[1:], "-MM", "-w", unit], capture_output=True, text=True, check=False, cwd=batch.directory)
    if listed.returncode != 0:
        return None
    read = sorted(set(listed.stdout.replace("\\\n", " ").split(":", 1)[-1].split()))
    total = hashlib.sha256(" ".join(batch.command).encode())
    for path in read + [os.path.join(folder, c) for c in configurations(folder)]:
        with open(os.path.join(batch.directory, path), "rb") as file:
            total.update(path.encode() + hashlib.sha256(file.read()).digest())
    return total.hexdigest()


def copy_configurations(root, build):
    for name in configurations(root):
        copy = os.path.join(build, "tidy", name)
        os.makedirs(os.path.dirname(copy), exist_ok=True)
        shutil.copyfile(os.path.join(root, name), copy)


def run(unit, batch):
    """What clang-tidy says of one file: nothing, or its findings."""
    # A file of a batch shadows names of another: the compiler has looked for shadows in each. It has checked formats, too.
    done = subprocess.run(["clang-tidy", "--quiet", "--header-filter=" + HEADERS, unit, "--", *batch.command[1:], "-Wno-shadow", "-Wno-format-security"],
                          capture_output=True, text=True, check=False, cwd=batch.directory)
    return "" if done.returncode == 0 else done.stdout.strip() or done.stderr.strip()


def look(root, build, batch):
    """Findings of a batch as text; empty: it is clean."""
    root, folder = os.path.realpath(root), os.path.join(os.path.realpath(build), "tidy")
    unit = os.path.join(folder, batch.files[0])  # below the same configurations as the files
    os.makedirs(os.path.dirname(unit), exist_ok=True)
    with open(unit, "w", encoding="utf-8") as file:
        file.writelines('#include "%s"  // NOLINT\n' % os.path.join(root, f) for f in batch.files)
    stamp, key = unit + ".clean", content(batch, unit, root)
    if key is not None and os.path.exists(stamp):
        with open(stamp, encoding="utf-8") as file:
            if file.read() == key:
                return ""
    single = len(batch.files) == 1
    found = run(os.path.join(root, batch.files[0]) if single else unit, batch)
    if "clang-diagnostic-error" in found and not single:
        found = "\n".join(filter(None, (run(os.path.join(root, f), batch) for f in batch.files)))
    if not found and key is not None:
        with open(stamp, "w", encoding="utf-8") as file:
            file.write(key)
    return found


def part_of(found, part):
    """The K-th of N parts, which PART names as K/N."""
    k, n = (int(number) for number in part.split("/"))
    return found[k - 1::n]


def without_repetition(found):
    """Of what several batches say about one header, the first."""
    seen, kept = set(), []
    for block in re.split(r"\n(?=\S+?:\d+:\d+: (?:error|warning): )", "\n".join(found)):
        if block and block.split("\n")[0] not in seen:
            seen.add(block.split("\n")[0])
            kept.append(block)
    return kept


def self_test():
    wrong = [] if without_repetition([]) == [] else ["nothing found is a finding"]
    found = list(range(23))
    parts = [part_of(found, "%d/5" % k) for k in range(1, 6)]
    if sorted(sum(parts, [])) != found:
        wrong.append("parts: %s" % parts)
    if without_repetition(["a.hpp:1:2: error: x\n  code", "a.hpp:1:2: error: x\n  code\nb.hpp:1:2: error: x"]) != [
            "a.hpp:1:2: error: x\n  code", "b.hpp:1:2: error: x"]:
        wrong.append("repetitions")
    if shutil.which("clang-tidy") and shutil.which("clang++"):
        import tempfile
        with tempfile.TemporaryDirectory() as root:
            build = os.path.join(root, "build")
            os.makedirs(build)
            os.makedirs(os.path.join(root, "core/a"))
            texts = {
                ".clang-tidy": "Checks: '-*,bugprone-sizeof-expression'\nWarningsAsErrors: '*'\n",
                "core/a/h.hpp": "#pragma once\ninline int one() { return 1; }\n",
                "core/a/a.cpp": '#include "core/a/h.hpp"\nnamespace {\nint same() {\n  return one();\n}\n}  // namespace\nint a() { return same(); }\n',
                "core/a/b.cpp": '#include "core/a/h.hpp"\nnamespace {\nint same() {\n  return 2;\n}\n}  // namespace\nint b() { return same(); }\n',
                "core/a/c.cpp": '#include "core/a/h.hpp"\nint c() { return one(); }\n',
            }

            def put(name, text):
                with open(os.path.join(root, name), "w", encoding="utf-8") as file:
                    file.write(text)
            for name, text in texts.items():
                put(name, text)
            put("build/compile_commands.json", json.dumps(
                [{"directory": root, "file": os.path.join(root, f), "command": "c++ -I%s -o x.o -c %s" % (root, os.path.join(root, f))}
                 for f in texts if f.endswith(".cpp")]))
            copy_configurations(root, build)
            made = batches(root, build, [])
            if sorted(b.files for b in made) != [["core/a/a.cpp", "core/a/c.cpp"], ["core/a/b.cpp"]]:
                wrong.append("batches: %s" % [b.files for b in made])
            together = next(b for b in made if len(b.files) == 2)
            for text, expected in ((texts["core/a/h.hpp"], False), ("#pragma once\ninline int one() { return sizeof(sizeof(int)); }\n", True),
                                   (texts["core/a/h.hpp"], False)):
                put("core/a/h.hpp", text)
                if bool(look(root, build, together)) != expected:
                    wrong.append("a header with%s a finding" % ("" if expected else "out"))
            put("core/a/c.cpp", '#include "core/a/h.hpp"\nint c() { return sizeof(sizeof(int)); }\n')
            if "c.cpp:2:" not in look(root, build, together):
                wrong.append("a finding in a file of a batch")
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", default=".")
    parser.add_argument("--build", default="build", help="a configured build, of which a folder `tidy` is made")
    parser.add_argument("--part", default="1/1")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--self-test", action="store_true")
    parser.add_argument("prefixes", nargs="*")
    given = parser.parse_args()
    if given.self_test:
        found = self_test()
    elif shutil.which("clang-tidy") is None or shutil.which("clang++") is None:
        print("skipped: needs clang-tidy and clang++: sudo apt install clang-tidy clang")
        return SKIPPED
    else:
        todo = part_of(batches(given.root, configured(given.root, given.build), given.prefixes), given.part)
        if not todo:
            print("no file begins with any of: %s" % " ".join(given.prefixes))
            return 1
        copy_configurations(given.root, given.build)
        with concurrent.futures.ThreadPoolExecutor(given.jobs) as pool:
            found = without_repetition(list(filter(None, pool.map(lambda batch: look(given.root, given.build, batch), todo))))
        print("%d batches of %d files" % (len(todo), sum(len(b.files) for b in todo)))
    print("\n".join(found) if found else "nothing found")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
