#!/usr/bin/env python3
"""What the trigger board's image promises beside what it does: no heap, no C library, no floating point, a stack that suffices.

    check_image.py FOLDER    where trigger_board.elf was built, with the call graphs of -fcallgraph-info=su beside its objects

Prints sizes and the deepest stack. Exit: 0 as promised, 1 not (one line each), 77 cannot be checked here (the line says why).
"""
import os
import re
import shutil
import subprocess
import sys

ALLOWED_LIBRARY = {"memcpy", "memset"}
LIBRARY = re.compile(r"^_*(malloc|calloc|realloc|free|sbrk|brk|mmap|v?s?n?printf|puts|exit|abort|atexit|memcpy|memset|memmove|strlen)(_r)?$")
FLOATING = re.compile(r"^__aeabi_(f|d|i2[fd]|ui2[fd]|l2[fd]|ul2[fd])")
LARGEST_FLASH = 32 * 1024
LARGEST_RAM = 32 * 1024
# Not compiled here, so without a graph: the compiler's 64-bit division (two functions deep, by its code).
FOREIGN = {"__aeabi_uldivmod": 80, "__aeabi_ldivmod": 80, "__aeabi_idiv0": 0, "__aeabi_ldiv0": 0}
# An exception stacks eight words and perhaps one to align (PM0214); no floating-point registers, for the image has none.
EXCEPTION = 36
# One interrupt of each priority at once, and a fault above both.
INTERRUPTS = (("tim2_handler", "tim5_handler", "exti9_5_handler"), ("usart1_handler",), ("on_bus_fault",))


def read_graphs(folder):
    sizes, calls = {}, {}
    for where, _, files in os.walk(folder):
        for name in files:
            if not name.endswith(".ci"):
                continue
            with open(os.path.join(where, name), encoding="utf-8") as file:
                text = file.read()
            for title, label in re.findall(r'node: \{ title: "([^"]*)" label: "([^"]*)"', text):
                title = re.sub(r"^.*:(on_bus_fault)$", r"\1", title)  # called by name, from assembly
                size = re.search(r"\\n(\d+) bytes \(([^)]*)\)", label)
                if size is not None:
                    sizes[title] = (int(size.group(1)), size.group(2))
            for source, target in re.findall(r'edge: \{ sourcename: "([^"]*)" targetname: "([^"]*)"', text):
                calls.setdefault(source, set()).add(target)
    return sizes, calls


def deepest(name, sizes, calls, findings, path=()):
    """Bytes below the entry of a function, and through which functions."""
    if name in path:
        findings.append("%s calls itself: its stack has no bound" % " > ".join(path + (name,)))
        return 0, ()
    if name in FOREIGN:
        return FOREIGN[name], (name,)
    if name not in sizes:
        findings.append("%s: calls %s, whose stack is not known" % (path[-1] if path else "?", name))
        return 0, ()
    size, kind = sizes[name]
    if kind not in ("static", "dynamic,bounded"):
        findings.append("%s: its stack is %s" % (name, kind))
    most, through = 0, ()
    for target in calls.get(name, ()):
        below, names = deepest(target, sizes, calls, findings, path + (name,))
        if below > most:
            most, through = below, names
    return size + most, (name,) + through


def main():
    folder = sys.argv[1]
    image = os.path.join(folder, "trigger_board.elf")
    if not os.path.exists(image) or shutil.which("arm-none-eabi-nm") is None:
        print("skipped: needs the trigger board's image: sudo apt install gcc-arm-none-eabi, then configure again")
        return 77
    findings = []
    symbols = {}
    for line in subprocess.run(["arm-none-eabi-nm", image], capture_output=True, text=True, check=True).stdout.splitlines():
        value, kind, name = line[:8], line[9:10], line[11:]
        symbols[name] = int(value, 16) if value.strip() else None
        if kind in "Uw":
            findings.append("%s is undefined" % name)
        if LIBRARY.match(name) and name not in ALLOWED_LIBRARY:
            findings.append("%s is linked: the image has no heap and no C library" % name)
        if FLOATING.match(name):
            findings.append("%s is linked: the image has no floating point" % name)

    sections = subprocess.run(["arm-none-eabi-size", "-A", image], capture_output=True, text=True, check=True).stdout
    size = {m.group(1): int(m.group(2)) for m in re.finditer(r"^(\.\w+)\s+(\d+)", sections, re.MULTILINE)}
    flash = size.get(".text", 0) + size.get(".data", 0)
    ram = sum(size.get(s, 0) for s in (".stack", ".data", ".bss", ".noinit"))
    print("flash %d bytes, RAM %d bytes of which stack %d" % (flash, ram, size.get(".stack", 0)))
    if flash > LARGEST_FLASH or ram > LARGEST_RAM:
        findings.append("larger than %d bytes of flash or %d of RAM" % (LARGEST_FLASH, LARGEST_RAM))

    sizes, calls = read_graphs(folder)
    stack, through = deepest("reset_handler", sizes, calls, findings)
    print("main loop %d bytes: %s" % (stack, " > ".join(n.rsplit(":", 1)[-1] for n in through)))
    for handlers in INTERRUPTS:
        most = max((deepest(h, sizes, calls, findings) for h in handlers), key=lambda d: d[0])
        print("interrupt %d bytes: %s" % (most[0] + EXCEPTION, " > ".join(n.rsplit(":", 1)[-1] for n in most[1])))
        stack += most[0] + EXCEPTION
    print("deepest stack %d bytes of %d" % (stack, size.get(".stack", 0)))
    if 2 * stack > size.get(".stack", 0):
        findings.append("the stack has less than twice what is needed")
    for finding in sorted(set(findings)):
        print(finding)
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
