#!/usr/bin/env python3
"""Checks of the source tree itself, one word each:

  arrows    every #include goes where the table below allows
  cycles    no two folders include from one another, directly or round about
  words     no file in the tree names a place of one machine or a habit the project does not have
  safety    every test that docs/safety_tests.csv names exists
  format    every C and C++ file is as clang-format writes it
  self-test the checks above find what they must, and nothing else

Exit: 0 clean, 1 findings (one line each, file:line first), 77 cannot be checked here (the line says why).
"""
import argparse
import concurrent.futures
import os
import re
import shutil
import subprocess
import sys
import tempfile

SKIPPED = 77
SOURCE_SUFFIXES = (".hpp", ".cpp", ".h", ".c", ".cc", ".inl")
ROOMS = ("firmware_iface", "drivers", "core", "app", "tests")

# room → folders it may include from. A room may always include from itself; tests may include everything.
ARROWS = {
    "app": ("drivers/", "core/", "firmware_iface/"),
    "drivers": ("firmware_iface/", "core/types/", "core/memory/", "core/math/"),
    "drivers/mock": ("core/camera/",),  # renders through the lens models; beside what drivers/ may
    "core": (),
    "firmware_iface": (),
}

# Built by somebody else's rules: the board's firmware, and the card that is compiled inside the kernel's own tree.
WORLDS_OF_THEIR_OWN = ("firmware_iface/trigger/board/", "tests/rigs/kernel/")

# Libraries (the include's first folder) → where they may be used.
LIBRARIES = {
    "opencv2": ("app/checkerboard/", "tests/"),  # the checkerboard tool; the program needs none of it
    "opencv": ("app/checkerboard/", "tests/"),
    "fastdds": ("app/ros2/", "tests/"),  # the ROS 2 bridge; the program links no DDS
    "fastrtps": ("app/ros2/", "tests/"),
    "dds": ("tests/",),  # Cyclone DDS, which reads what the bridge publishes
    "openssl": ("tests/",),
    "png.h": ("app/datasets/", "app/recording/", "tests/"),
    "jpeglib.h": ("app/datasets/", "tests/"),
    "Eigen": ("app/", "core/", "drivers/", "tests/"),
    "hwy": ("core/", "drivers/mock/", "tests/"),
    "GeographicLib": ("core/comparison/", "drivers/mock/", "tests/"),
    "yaml-cpp": ("app/", "tests/"),
    "nlohmann": ("app/", "tests/"),
    "CLI": ("app/", "tests/"),
    "fmt": ("app/", "tests/"),
    "ceres": ("tests/",),
    "gtest": ("tests/",),
    "gmock": ("tests/",),
    "benchmark": ("tests/",),
}

# firmware_iface: pure functions and layouts, so these and nothing that reads a clock, a file or another thread.
PURE_HEADERS = frozenset(
    "algorithm array bit bitset cassert charconv cmath compare concepts cstddef cstdint cstring limits numbers numeric optional span "
    "string_view tuple type_traits utility variant assert.h limits.h stdbool.h stddef.h stdint.h string.h".split())

# core: no input or output and no threads of its own.
NOT_IN_CORE = frozenset("condition_variable cstdio filesystem fstream future iostream mutex shared_mutex stdio.h thread unistd.h".split())

INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*(?:"([^"]+)"|<([^>]+)>)')

PLACES = ("work", "home", "root")
WORDS = (
    (re.compile(r"(?<![\w.~$}/-])/(?:%s)/" % "|".join(PLACES)), "a path of one machine"),
    (re.compile("-march=" + "native"), "code for one machine only: SIMD is dispatched at run time"),
    (re.compile("random_" + "device"), "another result on every run: use core/math/random.hpp with a seed"),
)
WORDS_SUFFIXES = SOURCE_SUFFIXES + (".md", ".txt", ".cmake", ".json", ".yaml", ".yml", ".py", ".rules", ".sh", "")


def tree_files(root):
    """Files of the tree, relative: what git tracks, or in an unpacked archive everything but build folders."""
    git = subprocess.run(["git", "-C", root, "ls-files", "-z"], capture_output=True, check=False) if shutil.which("git") else None
    if git is not None and git.returncode == 0 and git.stdout:
        names = [n for n in git.stdout.decode("utf-8", "surrogateescape").split("\0") if n]
        return sorted(n for n in names if os.path.isfile(os.path.join(root, n)))
    found = []
    for folder, folders, files in os.walk(root):
        folders[:] = [f for f in folders if not f.startswith((".git", "build")) and f != "sessions"]
        found += [os.path.relpath(os.path.join(folder, f), root) for f in files]
    return sorted(found)


def lines_of(root, name):
    with open(os.path.join(root, name), encoding="utf-8", errors="replace") as file:
        return file.read().splitlines()


def room_of(name):
    first = name.split("/", 1)[0]
    return first if first in ROOMS else None


def forbidden(name, target, quoted):
    """Why file `name` may not include `target`, or None."""
    room = room_of(name)
    if room is None or name.startswith(WORLDS_OF_THEIR_OWN):
        return None
    to = room_of(target)
    if to is not None:
        if room == "tests":
            return None
        if "/detail/" in target and not name.startswith(target.split("/detail/")[0] + "/"):
            return "detail/ is private to its folder"
        if to == room:
            return None
        allowed = ARROWS[room]
        for narrower, more in ARROWS.items():
            if name.startswith(narrower + "/") and narrower != room:
                allowed = allowed + more
        if not target.startswith(allowed or ("\0",)):
            return "no arrow from %s to %s" % ("/".join(name.split("/")[:2]), "/".join(target.split("/")[:2]))
        return None
    library = target.split("/", 1)[0]
    if library in LIBRARIES and not name.startswith(LIBRARIES[library]):
        return "%s has no place in %s" % (library, room)
    if quoted and library not in LIBRARIES:
        return "quoted includes start at the repository's root"
    if room == "firmware_iface" and target not in PURE_HEADERS:
        return "firmware_iface is pure: <%s> is not among the headers it may use" % target
    if room == "core" and target in NOT_IN_CORE:
        return "core does no input or output and starts no threads"
    return None


def arrows(root):
    findings = []
    for name in tree_files(root):
        if not name.endswith(SOURCE_SUFFIXES) or room_of(name) is None:
            continue
        for number, line in enumerate(lines_of(root, name), 1):
            include = INCLUDE.match(line)
            if include is None:
                continue
            target = include.group(1) or include.group(2)
            why = forbidden(name, target, include.group(1) is not None)
            if why is not None:
                findings.append("%s:%d: #include of %s: %s" % (name, number, target, why))
    return findings


def folder_of(name):
    """The folder whose file it is; detail/ is a part of the folder above."""
    folder = os.path.dirname(name)
    return folder[:-len("/detail")] if folder.endswith("/detail") else folder


def folder_edges(root):
    """{(from, to): the first include that goes there}: folder to folder, and between the two below their last common one."""
    edges = {}
    for name in tree_files(root):
        if not name.endswith(SOURCE_SUFFIXES) or room_of(name) is None or name.startswith(WORLDS_OF_THEIR_OWN):
            continue
        for number, line in enumerate(lines_of(root, name), 1):
            include = INCLUDE.match(line)
            if include is None or include.group(1) is None or room_of(include.group(1)) is None:
                continue
            here, there = folder_of(name), folder_of(include.group(1))
            if here == there:
                continue
            why = "%s:%d" % (name, number)
            edges.setdefault(("of " + here, "of " + there), why)
            a, b = here.split("/"), there.split("/")
            same = next((i for i, (x, y) in enumerate(zip(a, b)) if x != y), None)
            if same is not None:  # else one lies in the other
                edges.setdefault(("/".join(a[:same + 1]), "/".join(b[:same + 1])), why)
    return edges


def cycles(root):
    """One finding a group of folders that reach one another. `of X`: X's own files, without the folders below it."""
    edges = folder_edges(root)
    reach = {}
    for start in {a for a, _ in edges}:
        seen, todo = set(), [start]
        while todo:
            at = todo.pop()
            for a, b in edges:
                if a == at and b not in seen:
                    seen.add(b)
                    todo.append(b)
        reach[start] = seen
    groups = {frozenset(b for b in seen if a in reach.get(b, ())) for a, seen in reach.items() if a in seen}
    return ["%s include from one another: %s" % (
        ", ".join(sorted(group)), ", ".join(sorted("%s -> %s (%s)" % (a, b, why) for (a, b), why in edges.items() if a in group and b in group)))
            for group in sorted(groups, key=sorted)]


def words(root):
    findings = []
    for name in tree_files(root):
        if os.path.splitext(name)[1] not in WORDS_SUFFIXES:
            continue
        for number, line in enumerate(lines_of(root, name), 1):
            for pattern, why in WORDS:
                if pattern.search(line):
                    findings.append("%s:%d: %s: %s" % (name, number, why, line.strip()[:100]))
    return findings


def safety(root):
    test = re.compile(r"^(?:TEST|TEST_F|TEST_P|TYPED_TEST_P)\(\s*(\w+),\s*(\w+)|^fuzz_target\((\w+)", re.MULTILINE)
    there = set()
    for name in tree_files(root):
        if name.startswith("tests/") and name.endswith((".cpp", ".hpp", "CMakeLists.txt")):
            there |= {"%s.%s" % (suite or "fuzz", case or target) for suite, case, target in test.findall("\n".join(lines_of(root, name)))}
    table = "docs/safety_tests.csv"
    return ["%s:%d: there is no test %s" % (table, number, test)
            for number, line in enumerate(lines_of(root, table), 1) for test in re.findall(r"\b\w+\.\w+\b", line.rsplit('","', 1)[-1]) if test not in there]


def sources(root):
    return [n for n in tree_files(root) if n.endswith(SOURCE_SUFFIXES)]


def run_each(command_of, names, max_lines):
    """Runs a command for every name, as many at once as there are cores; what those that fail say first."""
    def one(name):
        done = subprocess.run(command_of(name), capture_output=True, text=True, check=False)
        return "\n".join((done.stdout + done.stderr).strip().splitlines()[:max_lines]) if done.returncode != 0 else None
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        return [finding for finding in pool.map(one, names) if finding is not None]


def format_files(root):
    """Many files a process: starting one costs more than formatting. Of each file the first finding."""
    names = [os.path.join(root, n) for n in sources(root)]
    batches = [names[i:i + 32] for i in range(0, len(names), 32)]
    said = run_each(lambda batch: ["clang-format", "--dry-run", "-Werror"] + batch, batches, None)
    first = {}
    for line in "\n".join(said).splitlines():
        place = re.match(r"(.+?):\d+:\d+: error: ", line)
        if place is not None:
            first.setdefault(place.group(1), line)
        elif not line.startswith(" ") and "clang-format" in line:  # clang-format's own trouble
            first.setdefault(line, line)
    return list(first.values()) or said


def self_test():
    cases = (  # file, line, found?
        ("core/a/a.cpp", '#include "core/b/b.hpp"', False),
        ("core/a/a.cpp", '#include "app/runtime/errors.hpp"', True),
        ("core/a/a.cpp", '#include "drivers/camera.hpp"', True),
        ("core/a/a.cpp", "#include <opencv2/core.hpp>", True),
        ("core/a/a.cpp", "  #  include <opencv2/core.hpp>", True),
        ("core/a/a.cpp", "#include <Eigen/Core>", False),
        ("core/a/a.cpp", "#include <iostream>", True),
        ("core/a/a.cpp", "#include <vector>", False),
        ("core/a/a.cpp", '#include "a.hpp"', True),
        ("core/a/a.cpp", '#include "hwy/highway.h"', False),
        ("core/a/a.cpp", '#include "fmt/format.h"', True),
        ("core/a/a.cpp", '#include "core/b/detail/inner.hpp"', True),
        ("core/b/b.cpp", '#include "core/b/detail/inner.hpp"', False),
        ("core/a/a.cpp", '#include "tests/support/shared_data.hpp"', True),
        ("core/a/a.cpp", "#include <GeographicLib/Geodesic.hpp>", True),
        ("core/comparison/a.cpp", "#include <GeographicLib/Geodesic.hpp>", False),
        ("drivers/gige/a.cpp", '#include "core/types/image.hpp"', False),
        ("drivers/gige/a.cpp", '#include "firmware_iface/iidc/iidc.hpp"', False),
        ("drivers/gige/a.cpp", '#include "core/camera/camera.hpp"', True),
        ("drivers/mock/a.cpp", '#include "core/camera/camera.hpp"', False),
        ("drivers/mock/a.cpp", '#include "core/types/image.hpp"', False),
        ("drivers/mock/a.cpp", '#include "core/bundle/bundle.hpp"', True),
        ("drivers/mock/a.cpp", '#include "app/runtime/errors.hpp"', True),
        ("drivers/v4l2/a.cpp", "#include <opencv2/core.hpp>", True),
        ("firmware_iface/xbus/a.cpp", '#include "firmware_iface/xbus/xbus.hpp"', False),
        ("firmware_iface/xbus/a.cpp", '#include "core/types/time.hpp"', True),
        ("firmware_iface/xbus/a.cpp", "#include <chrono>", True),
        ("firmware_iface/xbus/a.cpp", "#include <Eigen/Core>", True),
        ("firmware_iface/xbus/a.cpp", "#include <cstdint>", False),
        ("firmware_iface/trigger/board/a.c", "#include <stm32.h>", False),
        ("tests/rigs/kernel/a.c", '#include "core.h"', False),
        ("tests/rigs/emulators/a.c", '#include "core.h"', True),
        ("app/report/a.cpp", '#include "core/estimator/estimator.hpp"', False),
        ("app/checkerboard/a.cpp", "#include <opencv2/core.hpp>", False),
        ("app/report/a.cpp", "#include <opencv2/core.hpp>", True),
        ("app/datasets/a.cpp", "#include <png.h>", False),
        ("app/report/a.cpp", "#include <png.h>", True),
        ("app/report/a.cpp", '#include "tests/support/shared_data.hpp"', True),
        ("tests/unit/core/a.cpp", '#include "core/b/detail/inner.hpp"', False),
        ("tests/unit/core/a.cpp", "#include <ceres/ceres.h>", False),
    )
    wrong = []

    def expect(found, expected, what):
        if bool(found) != expected:
            wrong.append("%s: %s" % (what, "not found" if expected else "found: %s" % found))

    with tempfile.TemporaryDirectory() as root:
        def put(name, text):
            path = os.path.join(root, name)
            os.makedirs(os.path.dirname(path), exist_ok=True)
            with open(path, "w", encoding="utf-8") as file:
                file.write(text)
            return path

        for name, line, expected in cases:
            path = put(name, "#pragma once\n" + line + "\n")
            found = arrows(root)
            expect(found, expected, "%s with %s" % (name, line))
            if found and not found[0].startswith(name + ":2:"):
                wrong.append("%s: the finding does not name the line: %s" % (name, found[0]))
            os.remove(path)
        def put_includes(pairs):
            return [put(name, '#include "%s"\n' % target) for name, target in pairs]

        for pairs, expected in (
                ((("core/a/a.cpp", "core/b/b.hpp"), ("core/b/b.cpp", "core/c/c.hpp")), False),
                ((("core/a/a.cpp", "core/b/b.hpp"), ("core/b/b.cpp", "core/a/a.hpp")), True),
                ((("core/a/a.cpp", "core/b/b.hpp"), ("core/b/b.cpp", "core/c/c.hpp"), ("core/c/c.cpp", "core/a/a.hpp")), True),
                ((("core/a/a.cpp", "core/a/detail/x.hpp"), ("core/a/detail/x.cpp", "core/a/a.hpp")), False),
                ((("core/a/a.cpp", "core/a/sub/x.hpp"), ("core/a/sub/x.cpp", "core/a/a.hpp")), True),
                ((("core/a/x/a.cpp", "core/b/y/b.hpp"), ("core/b/z/b.cpp", "core/a/w/a.hpp")), True),
                ((("tests/system/a/a.cpp", "tests/system/b/b.hpp"), ("tests/system/b/b.cpp", "tests/system/a/a.hpp")), True)):
            paths = put_includes(pairs)
            expect(cycles(root), expected, "cycle in %s" % (pairs,))
            for path in paths:
                os.remove(path)
        path = put("tests/a/a_test.cpp", "TEST(Suite, case) {\n")
        for text, expected in (("Suite.case", False), ("Suite.other", True)):
            table = put("docs/safety_tests.csv", '"A statement","%s"\n' % text)
            expect(safety(root), expected, "table with %s" % text)
            os.remove(table)
        os.remove(path)
        for text, expected in (("see /%s/me/x\n" % PLACES[1], True), ("in ../%s/data, app/%s/x\n" % (PLACES[0], PLACES[1]), False),
                               ("$HOME/%s/x\n" % PLACES[0], False), ("-march=" + "native\n", True)):
            path = put("docs/a.md", text)
            expect(words(root), expected, "word in %r" % text)
            os.remove(path)
        if shutil.which("clang-format"):
            put(".clang-format", "BasedOnStyle: Google\n")
            path = put("core/a/a.cpp", "int  f ( );\n")
            expect(format_files(root), True, "badly formatted file")
            put("core/a/a.cpp", "int f();\n")
            expect(format_files(root), False, "well formatted file")
            os.remove(path)
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("check", choices=("arrows", "cycles", "words", "safety", "format", "self-test"))
    parser.add_argument("--root", default=".")
    given = parser.parse_args()
    if given.check == "format" and shutil.which("clang-format") is None:
        print("skipped: needs clang-format: sudo apt install clang-format")
        return SKIPPED
    checks = {"arrows": arrows, "cycles": cycles, "words": words, "safety": safety, "format": format_files, "self-test": lambda _: self_test()}
    findings = checks[given.check](given.root)
    print("\n".join(findings) if findings else "%s: nothing found" % given.check)
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
