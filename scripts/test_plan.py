#!/usr/bin/env python3
"""What tests and compile steps cost, and which tests belong to a share of a tier.

  test_plan.py costs BUILD                       the slowest tests and compile steps, and times by tier, folder and target
  test_plan.py share BUILD TIER TURN SECONDS     the argument of CTest's -I for one share of the tier

A tier is divided, in CTest's order, into shares that take SECONDS by their tests' COST properties (seconds; 1 where there is none). Turns follow
one another through the shares. A test that costs more than a share is left out with a message on stderr; what a test requires is run with it.
"""
import collections
import json
import os
import subprocess
import sys

SHOWN = 40
TIERS = ("default", "rig", "statistics", "hardening", "deploy")
CORES = os.cpu_count() or 1


def listed(build):
    """[(name, tier, folder, seconds of one processor)] in CTest's order."""
    shown = subprocess.run(["ctest", "--test-dir", build, "--show-only=json-v1"], capture_output=True, text=True, check=True)
    found = []
    for test in json.loads(shown.stdout)["tests"]:
        properties = {p["name"]: p["value"] for p in test.get("properties", [])}
        labels = properties.get("LABELS", [])
        tier = next((label for label in labels if label in TIERS), "")
        folder = next((label for label in labels if label not in TIERS), "")
        alone = properties.get("RUN_SERIAL", False) or properties.get("PROCESSORS", 1) > 1
        found.append((test["name"], tier, folder, float(properties.get("COST", 1)) * (CORES if alone else 1)))
    return found


def share(build, tier, turn, seconds):
    budget = seconds * CORES
    shares, used, left_out = [[]], 0.0, []
    # CTest's -I counts from 1 the tests that pass its other filters, which is the tier as a label.
    for number, (name, _, _, cost) in enumerate([test for test in listed(build) if test[1] == tier], 1):
        if cost > budget:
            left_out.append("%s (%.0f s)" % (name, cost / CORES))
            continue
        if used + cost > budget:
            shares.append([])
            used = 0.0
        shares[-1].append(number)
        used += cost
    if left_out:
        print("test: in no share, as they take more than %.0f s: %s" % (seconds, ", ".join(left_out)), file=sys.stderr)
    chosen = shares[turn % len(shares)]
    print("test: share %d of %d of the tier %s" % (turn % len(shares) + 1, len(shares), tier), file=sys.stderr)
    return "0,0,0," + ",".join(str(number) for number in chosen)


def test_seconds(build):
    """{name: mean seconds} of CTest's record of earlier runs."""
    seconds = {}
    path = os.path.join(build, "Testing", "Temporary", "CTestCostData.txt")
    if os.path.exists(path):
        with open(path, encoding="utf-8") as file:
            for line in file:
                words = line.split()
                if len(words) == 3:
                    seconds[words[0]] = float(words[2])
    return seconds


def compile_seconds(build):
    """{object or program: seconds} of ninja's log; of several entries for one output the last counts."""
    seconds = {}
    with open(os.path.join(build, ".ninja_log"), encoding="utf-8") as file:
        for line in file:
            words = line.rstrip("\n").split("\t")
            if len(words) == 5:
                seconds[words[3]] = (int(words[1]) - int(words[0])) / 1000
    return seconds


def table(title, rows, unit="s"):
    print("\n%s" % title)
    for name, value in rows:
        print("%9.1f %s  %s" % (value, unit, name))


def largest(times, count=SHOWN):
    return sorted(times.items(), key=lambda item: -item[1])[:count]


def costs(build):
    seconds = test_seconds(build)
    by_tier, by_folder, tests = collections.Counter(), collections.Counter(), {}
    for name, tier, folder, _ in listed(build):
        if name in seconds:
            tests[name] = seconds[name]
            by_tier[tier] += seconds[name]
            by_folder[folder] += seconds[name]
    table("slowest tests", largest(tests))
    table("tests by tier, seconds of one processor", by_tier.most_common())
    table("tests by folder", by_folder.most_common())
    steps, by_target = {}, collections.Counter()
    for output, time in compile_seconds(build).items():
        if output.endswith((".o", ".gch")) or "CMakeFiles" not in output:
            steps[output] = time
            target = output.split(".dir/")[0].replace("CMakeFiles/", "") if ".dir/" in output else output
            by_target[target] += time
    table("slowest compile and link steps", largest(steps))
    table("build by target", by_target.most_common(SHOWN))
    table("in all", [("tests", sum(tests.values())), ("build", sum(steps.values()))])


def main(words):
    if words[:1] == ["costs"] and len(words) == 2:
        costs(words[1])
    elif words[:1] == ["share"] and len(words) == 5:
        print(share(words[1], words[2], int(words[3]), float(words[4])))
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main(sys.argv[1:])
