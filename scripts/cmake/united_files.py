#!/usr/bin/env python3
"""Which files of a target can be compiled as one, some thousand lines together: files whose unnamed namespaces define no name twice, and no
constant that another's function defines again, which would be a warning.

  united_files.py FOLDER FILE…    a line for each group of files, separated by semicolons; FILE relative to FOLDER
  united_files.py --self-test

A group of its own is a kernel that Highway compiles for many instruction sets, as it includes itself, and what includes a header of the
kernel's that defines a name of the C library's otherwise.
"""
import os
import re
import sys
import tempfile

STAYS_ALONE = ("hwy/foreach_target.h", "<asm/termbits.h>")
MOST_LINES = 5000  # of a group: larger ones leave one of two processors without work at the end

UNNAMED = re.compile(r"^namespace \{$(.*?)^\}  // namespace$", re.DOTALL | re.MULTILINE)
DEFINITIONS = (
    re.compile(r"^(?:struct|class|enum class|enum) (\w+)"),
    re.compile(r"^using (\w+) ="),
    re.compile(r"^(?:inline |static )?(?:constexpr|const) .*?\b(k[A-Z]\w*)"),
    re.compile(r"^(?:template <.*?> ?)?(?:\[\[\w+\]\] )?[A-Za-z][\w:<>,&*\s]*?[\s&*](\w+)\([^;]*$"),
    re.compile(r"^(?:template <.*?> ?)?(?:\[\[\w+\]\] )?[A-Za-z][\w:<>,&*\s]*?[\s&*](\w+)\(.*\{"),
)
USED = re.compile(r"^using (?:\w+::)+(\w+);", re.MULTILINE)
CONSTANTS = re.compile(r"^(?:constexpr|const) [^;]*;", re.MULTILINE)
MORE_CONSTANTS = re.compile(r",\s*(k[A-Z]\w*)\s*[={\[]")
LOCAL_CONSTANT = re.compile(r"^ +(?:static )?(?:constexpr|const) .*?\b(k[A-Z]\w*)\s*[={\[(]", re.MULTILINE)


def defined(text):
    """Names that a file's unnamed namespaces define; of overloads the name alone: a call may find either."""
    names = set()
    for block in UNNAMED.findall(text):
        for statement in CONSTANTS.findall(block):
            names.update(MORE_CONSTANTS.findall(statement))
        depth = 0
        for line in block.splitlines():
            if depth == 0:
                for pattern in DEFINITIONS:
                    found = pattern.match(line)
                    if found:
                        names.add(found.group(1))
                        break
            depth += line.count("{") - line.count("}")
    return names


def local_names(text):
    """Names that a file may share with another such file, but not with a definition: constants of functions, using-declarations."""
    lines = (match.group(0) for match in LOCAL_CONSTANT.finditer(text))
    return set(LOCAL_CONSTANT.findall(text)) | {name for line in lines for name in MORE_CONSTANTS.findall(line)} | set(USED.findall(text))


def groups(folder, files):
    """Each file of `folder` in one group, with the first that has room and none of its names."""
    found = []
    for file in files:
        with open(os.path.join(folder, file), encoding="utf-8") as source:
            text = source.read()
        if any(word in text for word in STAYS_ALONE):
            found.append(([file], set(), set(), MOST_LINES))
            continue
        names, inner, lines = defined(text), local_names(text), text.count("\n")
        for i, (members, taken, shadows, size) in enumerate(found):
            if size + lines <= MOST_LINES and not names & (taken | shadows) and not inner & taken:
                found[i] = (members + [file], taken | names, shadows | inner, size + lines)
                break
        else:
            found.append(([file], names, inner, lines))
    return [group[0] for group in found]


def self_test():
    text = ("namespace a {\nnamespace {\n\nconstexpr int kA = 1, kB = 2,\n              kC = 3;\nusing Kind = S::Kind;\nstruct S {\n  int kInner = 0;\n};\n"
            "[[nodiscard]] bool f(int x) {\n  return g(x);\n}\nvoid long_one(int a,\n              int b) {\n}\n}  // namespace\n"
            "int outside(int) { return 0; }\n}\n")
    expected = {"kA", "kB", "kC", "Kind", "S", "f", "long_one"}
    if defined(text) != expected:
        return "found %s, expected %s" % (sorted(defined(text)), sorted(expected))
    with tempfile.TemporaryDirectory() as folder:
        sources = {"a.cpp": text, "b.cpp": text, "c.cpp": "int other;\n", "d.cpp": "void d() {\n  constexpr int kA = 3;\n}\n", "u.cpp": "using test::S;\n", "k.cpp": '#include "hwy/foreach_target.h"\n', "long.cpp": "\n" * MOST_LINES}
        for name, content in sources.items():
            with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                file.write(content)
        found = groups(folder, sorted(sources))
    wanted = [["a.cpp", "c.cpp"], ["b.cpp"], ["d.cpp", "u.cpp"], ["k.cpp"], ["long.cpp"]]
    return None if found == wanted else "grouped %s, expected %s" % (found, wanted)


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    for group in groups(sys.argv[1], sys.argv[2:]):
        print(";".join(group))
    return None


if __name__ == "__main__":
    sys.exit(main())
