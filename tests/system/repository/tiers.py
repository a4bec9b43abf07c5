#!/usr/bin/env python3
"""Every test of a build folder carries exactly one tier as a label: tiers.py BUILD"""
import json
import subprocess
import sys

TIERS = {"default", "rig", "statistics", "hardening", "deploy"}


def main(build):
    shown = subprocess.run(["ctest", "--test-dir", build, "--show-only=json-v1"], capture_output=True, text=True, check=True)
    wrong = []
    for test in json.loads(shown.stdout)["tests"]:
        labels = [p["value"] for p in test.get("properties", []) if p["name"] == "LABELS"]
        # CTest makes up a test NAME_NOT_BUILT, without labels, for each program of a tier that is not built.
        if not test["name"].endswith("_NOT_BUILT") and len(TIERS & set(sum(labels, []))) != 1:
            wrong.append("%s: %s" % (test["name"], labels or "no label"))
    print("\n".join(wrong) if wrong else "every test has one tier")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
