#!/usr/bin/env python3
"""Every test that a page names exists: named_tests.py --root . docs/safety.md …, or --self-test.

A name is `Suite.test` of GoogleTest or `name` of add_test() in a table's column that is headed `test`. Exit: 0 all are there, 1 not (a line each).
"""
import argparse
import os
import re
import sys
import tempfile

GTEST = re.compile(r"\bTEST(?:_F|_P)?\(\s*(\w+)\s*,\s*(\w+)\s*\)")
CTEST = re.compile(r"\badd_test\(\s*NAME\s+([\w.]+)")
TARGET = re.compile(r"\bfuzz_target\(\s*(\w+)")  # adds fuzz.NAME


def known_tests(root):
    names = set()
    for folder, below, files in os.walk(os.path.join(root, "tests")):
        below[:] = [b for b in below if not b.startswith("build")]
        for file in files:
            if not file.endswith((".cpp", "CMakeLists.txt")):
                continue
            with open(os.path.join(folder, file), encoding="utf-8") as text:
                content = text.read()
            names |= {f"{suite}.{test}" for suite, test in GTEST.findall(content)}
            names |= set(CTEST.findall(content))
            names |= {f"fuzz.{name}" for name in TARGET.findall(content)}
    return names


def named(page):
    """(line, name) of every test that a table of the page names."""
    column = None
    for number, line in enumerate(page.splitlines(), 1):
        if not line.startswith("|"):
            column = None
            continue
        cells = [c.strip() for c in line.strip("|").split("|")]
        if column is None:
            column = cells.index("test") if "test" in cells else -1
        elif 0 <= column < len(cells) and not set(cells[column]) <= set("-: "):
            for name in re.findall(r"`([^`]+)`", cells[column]):
                yield number, name


def check(root, pages):
    tests = known_tests(root)
    findings, seen = [], 0
    for page in pages:
        with open(os.path.join(root, page), encoding="utf-8") as text:
            for number, name in named(text.read()):
                seen += 1
                if name not in tests:
                    findings.append(f"{page}:{number}: there is no test {name}")
    if seen == 0:
        findings.append("no page names a test: is a column headed `test`?")
    return findings


def self_test():
    with tempfile.TemporaryDirectory() as root:
        os.makedirs(os.path.join(root, "tests", "a"))
        with open(os.path.join(root, "tests", "a", "a_test.cpp"), "w", encoding="utf-8") as file:
            file.write("TEST_F(Suite,\n       isThere) {}\nINSTANTIATE_TEST_SUITE_P(x, y);\n")
        with open(os.path.join(root, "tests", "CMakeLists.txt"), "w", encoding="utf-8") as file:
            file.write("add_test(NAME a.whole COMMAND x)\nfuzz_target(line SOURCES x)\n")
        with open(os.path.join(root, "page.md"), "w", encoding="utf-8") as file:
            file.write("| what | test |\n|---|---|\n| `no.test` | `Suite.isThere`, `a.whole`, `fuzz.line` |\n| b | `Suite.isGone` |\n\n"
                       "| other | word |\n|---|---|\n| a | `Not.looked` |\n")
        with open(os.path.join(root, "bare.md"), "w", encoding="utf-8") as file:
            file.write("no table\n")
        found = check(root, ["page.md"])
        assert found == ["page.md:4: there is no test Suite.isGone"], found
        assert len(check(root, ["bare.md"])) == 1
    return 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pages", nargs="*")
    parser.add_argument("--root", default=".")
    parser.add_argument("--self-test", action="store_true")
    arguments = parser.parse_args()
    if arguments.self_test:
        return self_test()
    findings = check(arguments.root, arguments.pages)
    print("\n".join(findings), end="\n" if findings else "")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
