#!/usr/bin/env python3
"""Checks udev rules: syntax (udevadm verify too where it exists), jumps, and that no device is open to everybody.

  udev_rules.py FILE…    exit 0 clean, 1 findings (file:line first)
  udev_rules.py --self-test
"""
import re
import shutil
import subprocess
import sys

TOKEN = re.compile(r'\s*([A-Z_]+)(\{[^}"]+\})?\s*(==|!=|\+=|-=|:=|=)\s*"([^"]*)"\s*(,|$)')

# key → operators udev takes with it (udev(7)); True: needs {name}.
MATCH = ("==", "!=")
ASSIGN = ("=", "+=", "-=", ":=")
KEYS = {
    "ACTION": (MATCH, False), "DEVPATH": (MATCH, False), "KERNEL": (MATCH, False), "KERNELS": (MATCH, False),
    "NAME": (MATCH + ASSIGN, False), "SYMLINK": (MATCH + ASSIGN, False), "SUBSYSTEM": (MATCH, False), "SUBSYSTEMS": (MATCH, False),
    "DRIVER": (MATCH, False), "DRIVERS": (MATCH, False), "ATTR": (MATCH + ("=",), True), "ATTRS": (MATCH, True),
    "ENV": (MATCH + ASSIGN, True), "TAG": (MATCH + ASSIGN, False), "TAGS": (MATCH, False), "TEST": (MATCH, None),
    "OWNER": (("=", ":="), False), "GROUP": (("=", ":="), False), "MODE": (("=", ":="), False), "GOTO": (("=",), False),
    "LABEL": (("=",), False), "IMPORT": (MATCH + ("=",), True), "RUN": (ASSIGN, None), "OPTIONS": (("=", "+="), False),
}


def tokens_of(line):
    """[(key, name, operator, value)] of a rule; ValueError with a message where it is none."""
    tokens, at, comma = [], 0, True
    while at < len(line):
        token = TOKEN.match(line, at)
        if token is None:
            raise ValueError("not KEY operator \"value\": %s" % line[at:].strip()[:60])
        comma = token.group(5) == ","
        tokens.append((token.group(1), (token.group(2) or "")[1:-1], token.group(3), token.group(4)))
        at = token.end()
    if comma:
        raise ValueError("ends with a comma")
    return tokens


def wrong_with(tokens):
    for key, name, operator, value in tokens:
        if key not in KEYS:
            yield "there is no key %s" % key
            continue
        operators, named = KEYS[key]
        if operator not in operators:
            yield "%s does not take %s" % (key, operator)
        if named is not None and named != bool(name):
            yield "%s %s" % (key, "needs a name in braces" if named else "takes no name in braces")
        if key == "MODE" and (re.fullmatch("0?[0-7]{3}", value) is None or int(value[-1]) != 0):
            yield "MODE %s is open to everybody, or is no mode" % value
    keys = [token[0] for token in tokens]
    if "MODE" in keys and "GROUP" not in keys:
        yield "MODE without GROUP"
    acts = any(operator in ASSIGN and key not in ("GOTO", "LABEL") for key, _, operator, _ in tokens)
    if acts and not any(operator in MATCH for _, _, operator, _ in tokens):
        yield "a rule that matches every device"


def check(text):
    """[(line number, message)]"""
    findings, labels, jumps = [], set(), []
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        try:
            tokens = tokens_of(line.strip())
        except ValueError as error:
            findings.append((number, str(error)))
            continue
        findings += [(number, message) for message in wrong_with(tokens)]
        labels.update(value for key, _, _, value in tokens if key == "LABEL")
        jumps += [(number, value) for key, _, _, value in tokens if key == "GOTO"]
    findings += [(number, "GOTO %s leads nowhere" % label) for number, label in jumps if label not in labels]
    return findings


def verify_by_udevadm(files):
    """udevadm's own verdict, where this udev has one (systemd 254 and later)."""
    if shutil.which("udevadm") is None or subprocess.run(["udevadm", "verify", "--help"], capture_output=True, check=False).returncode != 0:
        return []
    done = subprocess.run(["udevadm", "verify", *files], capture_output=True, text=True, check=False)
    return [] if done.returncode == 0 else (done.stdout + done.stderr).strip().splitlines()


def self_test():
    good = 'SUBSYSTEM=="tty", ATTRS{serial}=="1", GROUP="dialout", MODE="0660"\n'
    bad = ('SUBSYSTEM=="tty" MODE="0660"', 'SUBSYSTEM=="tty", GROUP="dialout", MODE="0666"', 'SUBSYSTEM="tty", GROUP="dialout"',
           'ATTRS=="x", GROUP="dialout"', 'SUBSYSTEM=="tty", MODE="0660"', 'KERNEL=="a", GOTO="nowhere"', 'KERNL=="a", GROUP="dialout"',
           'KERNEL=="a, GROUP="dialout"', 'GROUP="dialout"', 'KERNEL=="a",', 'ACTION=="add", ATTRS{x}="1"')
    wrong = ["found in a good rule: %s" % (finding,) for finding in check(good)]
    wrong += ["not found: %s" % rule for rule in bad if not check(rule + "\n")]
    return wrong


def main():
    if sys.argv[1:] == ["--self-test"]:
        findings = self_test()
    else:
        findings = verify_by_udevadm(sys.argv[1:])
        for name in sys.argv[1:]:
            with open(name, encoding="utf-8") as file:
                findings += ["%s:%d: %s" % (name, number, message) for number, message in check(file.read())]
    print("\n".join(findings) if findings else "udev rules: nothing found")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
