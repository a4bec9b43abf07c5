#!/usr/bin/env python3
"""Classes of the product that have grown into two: more than MOST_MEMBERS data members or MOST_METHODS methods.

A class is what the keyword `class` declares; a `struct` is a bag of values, which may have many. Methods are counted by name, so that
overloads are one; a constructor, a destructor and what is deleted or defaulted do not count, nor does what is overridden (the interface
asks for it). Read by a small parser of declarations, which needs no compiler.

The table OVER is for exceptions, with their figures; it is empty.

  class_sizes.py --root FOLDER [--list]     exit 1: findings, one line each
  class_sizes.py --self-test
"""
import argparse
import os
import re
import sys

ROOMS = ("app", "core", "drivers", "firmware_iface")
SUFFIXES = (".hpp", ".h", ".cpp")
MOST_MEMBERS = 20
MOST_METHODS = 30

# (file, class): (members, methods), which may only become fewer.
OVER = {}

COMMENT_OR_TEXT = re.compile(
    r'R"([^()\s\\]{0,16})\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\'|//[^\n]*|/\*.*?\*/', re.DOTALL)
CLASS = re.compile(r"\bclass\s+(?:\[\[\w+\]\]\s*)?(\w+)(?:\s+final)?\s*(?::[^;{(]*(?:<[^;{]*>)?[^;{(]*)?\{")
NOT_A_MEMBER = re.compile(r"^(?:using|typedef|friend|static_assert|enum|struct|class|union|template\s*<[^;]*>\s*(?:struct|class|friend))\b")


def blanked(text):
    """The same text without comments and literals; lines stay where they are. Digit separators are digits."""
    text = re.sub(r"(?<=[0-9a-fA-F])'(?=[0-9a-fA-F])", "0", text)
    return COMMENT_OR_TEXT.sub(lambda m: '""' + "\n" * m.group(0).count("\n"), text)


def end_of_block(text, at):
    """Behind the brace that closes the one at `at`."""
    depth = 0
    for i in range(at, len(text)):
        depth += (text[i] == "{") - (text[i] == "}")
        if depth == 0:
            return i + 1
    return len(text)


def is_body(here):
    """Whether a brace behind `here` opens a function's body, which ends its declaration; an initialiser, an enumeration and a nested class
    go on to their `;`."""
    if re.match(r"\s*(struct|class|enum|union)\b", here):
        return False
    if re.search(r"\)\s*(?:noexcept\s*)?:(?!:)", here):  # a constructor's list: `a_{1}` is none, `a_(2) {` is one
        return re.search(r"[)}]\s+$", here) is not None
    if "=" in re.sub(r"\([^()]*\)|operator\s*\S+?\(", "", here):
        return False
    return re.search(r"\)[\w\s&>:,\-\[\]<>()*.]*$", here) is not None


def declarations(body):
    """The declarations of a class body, without bodies and initialisers in braces."""
    found, here, i = [], "", 0
    while i < len(body):
        c = body[i]
        if c == "{":
            i = end_of_block(body, i)
            if is_body(here):
                if not re.match(r"\s*;", body[i:]):
                    found.append(here + "{}")
                    here = ""
            else:
                here += "{}"
            continue
        if c == ";":
            found.append(here)
            here = ""
        else:
            here += c
        i += 1
    cleaned = []
    for d in found:
        d = re.sub(r"\b(public|private|protected)\s*:(?!:)", "", d)
        d = re.sub(r"\[\[[^\]]*\]\]", "", d)
        d = re.sub(r"^\s*#[^\n]*$", "", d, flags=re.MULTILINE)
        d = re.sub(r'^[\s"]+', "", d)  # what is left of a comment in front of it
        d = " ".join(d.split())
        if d:
            cleaned.append(d)
    return cleaned


def without_brackets(text, opening, closing):
    depth, out = 0, ""
    for i, c in enumerate(text):
        if c == opening and not (opening == "<" and text[i - 1:i] in ("<", "-", "")):
            depth += 1
        elif c == closing and depth > 0:
            depth -= 1
        elif depth == 0:
            out += c
    return out


def sizes(name, body):
    """(data members, names of methods) of a class."""
    members, methods = 0, set()
    for d in declarations(body):
        d = re.sub(r"^template <.*?> (?=[\w:\[~])", "", d) if d.startswith("template") else d
        if NOT_A_MEMBER.match(d):
            if re.match(r"^(?:struct|class|enum|union)\b.*\{\}\s*\w", d):
                members += 1
            continue
        plain = without_brackets(d, "<", ">")
        method = re.match(r"^(.*?)(operator\s*[^\s(]+|operator\(\)|~?\w+)\s*\(", plain)
        if method and "=" not in method.group(1) and not re.match(r"\(\s*\*", plain[method.end(2):].lstrip()):
            word = method.group(2)
            if word.lstrip("~") == name or re.search(r"\boverride\b|= default|= delete", plain.split(")")[-1]):
                continue
            methods.add(word)
            continue
        if re.search(r"\bstatic\b|\bconstexpr\b", plain):
            continue  # a constant
        members += 1 + without_brackets(without_brackets(plain, "{", "}"), "(", ")").count(",")
    return members, methods


def classes(text):
    """(line, name, members, methods) of every class."""
    text = blanked(text)
    for m in CLASS.finditer(text):
        if re.search(r"\benum\s+$", text[:m.start()][-8:]):
            continue
        end = end_of_block(text, m.end() - 1)
        members, methods = sizes(m.group(1), text[m.end():end - 1])
        yield text.count("\n", 0, m.start()) + 1, m.group(1), members, len(methods)


def tree(root):
    for room in ROOMS:
        for folder, _, files in os.walk(os.path.join(root, room)):
            for file in sorted(files):
                if file.endswith(SUFFIXES):
                    yield os.path.join(folder, file)


def every_class(root):
    for path in tree(root):
        with open(path, encoding="utf-8") as file:
            text = file.read()
        for line, name, members, methods in classes(text):
            yield os.path.relpath(path, root), line, name, members, methods


def listing(root):
    largest = sorted(every_class(root), key=lambda c: (-c[3], -c[4]))
    return ["%3d members, %2d methods: %s:%d %s" % (members, methods, path, line, name) for path, line, name, members, methods in largest]


def judged(found, over):
    """Findings among (path, line, name, members, methods), with the table of those that may be over."""
    left, findings = dict(over), []
    for path, line, name, members, methods in found:
        most = left.pop((path, name), (MOST_MEMBERS, MOST_METHODS))
        what = "%s:%d: %s has %d members and %d methods" % (path, line, name, members, methods)
        if members > max(most[0], MOST_MEMBERS) or methods > max(most[1], MOST_METHODS):
            findings.append("%s; more than %d or %d are two classes" % (what, most[0], most[1]))
        elif (path, name) in over and (members, methods) != most:
            findings.append("%s, the table OVER says %d and %d: write the new figures there, or take the row out" % (what, most[0], most[1]))
    return findings + ["%s: no class %s, which the table OVER has" % key for key in sorted(left)]


def self_test():
    cases = (
        ("class A { int a, b = 1; std::map<int, int> c{}; };", 3, 0),
        ("class A : public B<int, 3> { public: A(); ~A() override; void f(int a, int b); void f(); int g() const { return a_; } private: int a_; };", 1, 2),
        ("class A { using X = int; enum class E { a, b }; static constexpr int k = 3; struct P; struct Q { int a, b; }; P* p_ = nullptr; };", 1, 0),
        ("class A { [[nodiscard]] bool f() noexcept override; void g() = delete; int h() noexcept { if (a) { b(); } return 1; } std::array<int, 3> d_{{1, 2, 3}}; };", 1, 1),
        ("class A { std::function<void(int, int)> f_; void (*p_)(int) = nullptr; };", 2, 0),
        ("class A { A() : a_{1}, b_(2) {} int a_; int b_; // c; d;\n };", 2, 0),
        ("class A { template <class T, int N> void f(T t) { t(); } const Options& options_; };", 1, 1),
        ("class A { bool operator==(const A&) const = default; A& operator+=(int) { return *this; } };", 0, 1),
    )
    wrong = []
    for text, members, methods in cases:
        found = [(m, n) for _, _, m, n in classes(text)]
        if found[:1] != [(members, methods)]:
            wrong.append("%s: %s instead of %s" % (text, found, (members, methods)))
    over = {("a.hpp", "A"): (25, 3)}
    for found, count in (
            ([("a.hpp", 1, "A", 25, 3), ("b.hpp", 1, "B", 20, 30)], 0),
            ([("a.hpp", 1, "A", 26, 3)], 1),
            ([("a.hpp", 1, "A", 25, 31)], 1),
            ([("a.hpp", 1, "A", 24, 3)], 1),
            ([("a.hpp", 1, "A", 25, 3), ("b.hpp", 1, "B", 21, 0)], 1),
            ([("a.hpp", 1, "A", 25, 3), ("b.hpp", 1, "A", 0, 31)], 1),
            ([], 1)):
        if len(judged(found, over)) != count:
            wrong.append("%s: %s" % (found, judged(found, over)))
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", default=".")
    parser.add_argument("--list", action="store_true", help="every class, the largest first")
    parser.add_argument("--self-test", action="store_true")
    given = parser.parse_args()
    if given.list:
        print("\n".join(listing(given.root)))
        return 0
    found = self_test() if given.self_test else judged(every_class(given.root), OVER)
    print("\n".join(found) if found else "nothing found")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
