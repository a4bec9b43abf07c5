#!/usr/bin/env python3
"""Every folder with public headers has a front door: the header named after it, or those that the table in CONTRIBUTING.md names.

A front door is a header that somebody outside the folder includes. Folders that are a program (main.cpp) or private (detail/) need none.

  front_doors.py --root FOLDER     exit 1: findings, one line each
  front_doors.py --self-test
"""
import argparse
import os
import re
import sys
import tempfile

ROOMS = ("app", "core", "drivers", "firmware_iface")
APART = "firmware_iface/trigger/board"  # the board's firmware, built by its own rules
ROW = re.compile(r"^\| `([\w/]+)/?` \|((?: `[\w.]+`,?)+) \|")
INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*"([^"]+)"', re.MULTILINE)


def sources(root, rooms):
    for room in rooms:
        for folder, _, files in os.walk(os.path.join(root, room)):
            for file in files:
                if file.endswith((".hpp", ".h", ".cpp", ".c")):
                    yield os.path.relpath(os.path.join(folder, file), root)


def table(root):
    """folder → headers, of CONTRIBUTING.md."""
    rows = {}
    with open(os.path.join(root, "CONTRIBUTING.md"), encoding="utf-8") as file:
        for line in file:
            row = ROW.match(line)
            if row is not None:
                rows[row.group(1)] = re.findall(r"`([\w.]+)`", row.group(2))
    return rows


def findings(root):
    headers, used, programs = {}, {}, set()
    for name in sources(root, ROOMS + ("tests",)):
        folder = os.path.dirname(name)
        if name.endswith("/main.cpp"):
            programs.add(folder)
        if name.endswith((".hpp", ".h")) and not name.startswith("tests/") and "/detail" not in folder and not folder.startswith(APART):
            headers.setdefault(folder, set()).add(os.path.basename(name))
        with open(os.path.join(root, name), encoding="utf-8", errors="replace") as file:
            for target in INCLUDE.findall(file.read()):
                if os.path.dirname(target) != folder:
                    used[target] = name
    rows = table(root)
    found = ["CONTRIBUTING.md: the table of front doors has %s, where no public header is" % f for f in sorted(set(rows) - set(headers))]
    for folder in sorted(set(headers) - programs):
        own = [os.path.basename(folder) + end for end in (".hpp", ".h") if os.path.basename(folder) + end in headers[folder]]
        if own and folder in rows:
            found.append("CONTRIBUTING.md: %s has %s, and needs no row in the table of front doors" % (folder, own[0]))
        doors = own or rows.get(folder, [])
        if not doors:
            found.append("%s: no header named after the folder, and no row in CONTRIBUTING.md's table of front doors" % folder)
        for door in doors:
            if door not in headers[folder]:
                found.append("CONTRIBUTING.md: %s/%s does not exist" % (folder, door))
            elif "%s/%s" % (folder, door) not in used:
                found.append("%s/%s: nobody outside the folder includes it, so it is no front door" % (folder, door))
    return found


def self_test():
    wrong = []
    user = ("app/a/a.cpp", '#include "core/b/b.hpp"\n#include "core/c/x.hpp"\n')
    for what, files, contributing, expected in (
            ("named after the folder", [user, ("core/b/b.hpp", "")], "", 0),
            ("in the table", [user, ("core/c/x.hpp", ""), ("core/c/y.hpp", "")], "| `core/c` | `x.hpp` | what |\n", 0),
            ("none", [user, ("core/c/x.hpp", "")], "", 1),
            ("not there", [user, ("core/c/x.hpp", "")], "| `core/c` | `x.hpp`, `z.hpp` | what |\n", 1),
            ("not used", [user, ("core/c/y.hpp", "")], "| `core/c` | `y.hpp` | what |\n", 1),
            ("both", [user, ("core/b/b.hpp", "")], "| `core/b` | `b.hpp` | what |\n", 1),
            ("no folder", [user, ("core/b/b.hpp", "")], "| `core/d` | `d.hpp` | what |\n", 1),
            ("private", [user, ("core/b/detail/z.hpp", "")], "", 0),
            ("a program", [("app/p/main.cpp", ""), ("app/p/z.hpp", "")], "", 0)):
        with tempfile.TemporaryDirectory() as root:
            for name, text in files + [("CONTRIBUTING.md", contributing)]:
                os.makedirs(os.path.join(root, os.path.dirname(name)), exist_ok=True)
                with open(os.path.join(root, name), "w", encoding="utf-8") as file:
                    file.write(text)
            found = findings(root)
            if len(found) != expected:
                wrong.append("%s: %s" % (what, found))
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", default=".")
    parser.add_argument("--self-test", action="store_true")
    given = parser.parse_args()
    found = self_test() if given.self_test else findings(given.root)
    print("\n".join(found) if found else "nothing found")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
