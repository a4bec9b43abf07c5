"""Writes the usage examples of public headers into files that a compiler can look at, one a room: header_examples.py ROOT OUT HEADER…

An example is a block of comment lines `///     code` after an empty `///`, of which one ends as code does. It becomes a function in the header's own
namespace; what it takes for given (a rig, a frame, a driver) is the function's parameters, and types declared before it, CONTEXTS of example_contexts.py. `use(…)`,
which takes anything, stands for what a reader would do.
"""
import pathlib
import re
import sys

from example_contexts import CONTEXTS

ROOMS = ("core", "app", "drivers", "firmware_iface")
CODE = re.compile(r"^\s*///     ( *\S.*)$")
ENDS_AS_CODE = re.compile(r";\s*(//.*)?$")
EMPTY = re.compile(r"^\s*///$")


def examples(text):
    """(number of the first line, lines) of each example in a header."""
    found, block = [], None
    before_empty = False
    for number, line in enumerate(text.split("\n") + [""], 1):
        code = CODE.match(line)
        if code and (block is not None or before_empty):
            block = block or (number, [])
            block[1].append(code.group(1))
        elif block is not None:
            if any(ENDS_AS_CODE.search(code) for code in block[1]):
                found.append(block)
            block = None
        before_empty = bool(EMPTY.match(line))
    return found


def namespace_of(text):
    named = re.search(r"^namespace ([\w:]+) \{", text, re.M)
    return named.group(1) if named else "vergence"


def function(header, index, text, example, context, before=""):
    line, code = example
    name = re.sub(r"\W", "_", header) + f"_{index}"
    body = "\n".join(code)
    return (f"namespace {namespace_of(text)} {{\nnamespace {{\n{before}\n}}\n[[maybe_unused]] static auto {name}({context}) {{\n"
            f'#line {line} "{header}"\n{body}\n}}\n}}\n')


def main():
    root, out, headers = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3:]
    rooms = {room: ([], []) for room in ROOMS}
    known = set()
    for header in headers:
        text = (root / header).read_text(encoding="utf-8")
        includes, functions = rooms[header.split("/")[0]]
        for index, example in enumerate(examples(text)):
            needs, *context = CONTEXTS.get(header, ((), ""))
            known.add(header)
            includes += [header, *needs]
            functions.append(function(header, index, text, example, *context))
    stale = set(CONTEXTS) - known
    if stale:
        sys.exit(f"example_contexts.py has contexts for headers without an example: {', '.join(sorted(stale))}")
    for room, (includes, functions) in rooms.items():
        lines = [f'#include "{header}"' for header in dict.fromkeys(includes)]
        lines.append("namespace vergence {\ntemplate <class... T>\nstatic void use(T&&... /*anything*/) {}\n}")
        (out / f"{room}_examples.cpp").write_text("\n".join(lines + functions), encoding="utf-8")


if __name__ == "__main__":
    main()
