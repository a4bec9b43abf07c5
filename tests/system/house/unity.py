#!/usr/bin/env python3
"""Finds what keeps a library marked UNITY from being compiled as one file: a name that the unnamed namespaces of two of its files define.

  unity.py [--root .] | --self-test

Kernels that Highway compiles for many instruction sets, and files listed after ALONE, stay out of it (scripts/cmake/targets.cmake).
Exit: 0 clean, 1 findings (one line each).
"""
import argparse
import collections
import glob
import os
import re
import sys

LIBRARY = re.compile(r"vergence_library\((\w+) UNITY(.*?)\bDEPENDS\b", re.DOTALL)
UNNAMED = re.compile(r"^namespace \{$(.*?)^\}  // namespace$", re.DOTALL | re.MULTILINE)
DEFINITIONS = (
    re.compile(r"^(?:struct|class|enum class|enum) (\w+)"),
    re.compile(r"^(?:inline |static )?(?:constexpr|const) .*?\b(k[A-Z]\w*)"),
    re.compile(r"^(?:template <.*?> ?)?(?:\[\[\w+\]\] )?[A-Za-z][\w:<>,&*\s]*?[\s&*](\w+)\([^;]*$"),
    re.compile(r"^(?:template <.*?> ?)?(?:\[\[\w+\]\] )?[A-Za-z][\w:<>,&*\s]*?[\s&*](\w+)\(.*\{"),
)
MORE_CONSTANTS = re.compile(r",\s*(k[A-Z]\w*)\s*[={\[]")


def defined(text):
    """Names that a file's unnamed namespaces define; of overloads the name alone: a call may find either."""
    names = set()
    for block in UNNAMED.findall(text):
        depth = 0
        for line in block.splitlines():
            if depth == 0:
                for pattern in DEFINITIONS:
                    found = pattern.match(line)
                    if found:
                        names.add(found.group(1))
                        break
                if line.startswith(("constexpr", "const ")):
                    names.update(MORE_CONSTANTS.findall(line))
            depth += line.count("{") - line.count("}")
    return names


def libraries(root):
    """(folder, name, united files) of every library marked UNITY."""
    for listing in sorted(glob.glob(os.path.join(root, "*/**/CMakeLists.txt"), recursive=True)):
        folder = os.path.dirname(listing)
        if os.path.relpath(folder, root).startswith("build"):
            continue
        with open(listing, encoding="utf-8") as file:
            text = re.sub(r"#.*", "", file.read())
        for name, body in LIBRARY.findall(text):
            sources, _, alone = body.partition("ALONE")
            files = [w for w in sources.split() if w.endswith(".cpp") and "$" not in w and w not in alone.split()]
            yield folder, name, files


def findings(root):
    found = []
    for folder, name, files in libraries(root):
        places = collections.defaultdict(list)
        for file in files:
            with open(os.path.join(folder, file), encoding="utf-8") as source:
                text = source.read()
            if "hwy/foreach_target.h" in text:
                continue
            for word in defined(text):
                places[word].append(file)
        found += ["%s: %s is defined in %s: one of them is to stand after ALONE" % (name, word, ", ".join(sorted(where)))
                  for word, where in sorted(places.items()) if len(where) > 1]
    return found


def self_test():
    text = ("namespace a {\nnamespace {\n\nconstexpr int kA = 1, kB = 2;\nstruct S {\n  int kInner = 0;\n};\n"
            "[[nodiscard]] bool f(int x) {\n  return g(x);\n}\nvoid long_one(int a,\n              int b) {\n}\n}  // namespace\n"
            "int outside(int) { return 0; }\n}\n")
    expected = {"kA", "kB", "S", "f", "long_one"}
    return [] if defined(text) == expected else ["found %s, expected %s" % (sorted(defined(text)), sorted(expected))]


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
