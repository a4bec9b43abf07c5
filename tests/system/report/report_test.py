#!/usr/bin/env python3
"""Makes sessions, has `vergence report` write their pages, and looks at them in Chromium. EXAMPLE_SESSION and VERGENCE name the programs."""
import os
import pathlib
import subprocess
import sys
import tempfile

SKIPPED = 77
HERE = pathlib.Path(__file__).resolve().parent
HOSTILE = '{"stamp_ns":1772360200000000000,"kind":"<b>x</b>","message":"</table><script>document.title=1</script> ' + "w" * 400 + '"}\n'

# Everything that must be found: one text over another, letters too small, a page too wide, a console message, one theme only.
BAD = """<!DOCTYPE html><html><body style="background:#fff"><script>console.error("bang")</script><p style="width:3000px">wide</p>
<svg viewBox="0 0 100 20" style="width:300px"><text x="1" y="10" font-size="4">under it</text><text x="3" y="11" font-size="4">over it</text>
<text x="1" y="19" font-size="2">too small to read</text></svg>%s</body></html>""" % ("<p>line</p>" * 20)
COMPLAINTS = ["lies over", "has letters of", "px wide", "console says", "look the same"]


def make(folder, *words):
    subprocess.run([os.environ["EXAMPLE_SESSION"], str(folder), *words], check=True)
    return folder


def tear(folder):
    (folder / "summary.json").unlink()
    (folder / "calibration.yaml").unlink()
    text = (folder / "poses.csv").read_bytes()
    (folder / "poses.csv").write_bytes(text[: len(text) * 2 // 3])
    with open(folder / "events.jsonl", "a", encoding="utf-8") as events:
        events.write(HOSTILE)
    return folder


def drive(folder):
    """A session with every section filled, figures as they really are: the mock's board and INS on simulated lines."""
    configuration = HERE.parents[2] / "app" / "config" / "mock_board.yaml"
    subprocess.run([os.environ["VERGENCE"], "run", str(configuration), "--fast", "--quiet", "--duration", "16", "--out", str(folder),
                    "--set", "comparison.alignment_distance_m=40", "--fault", "knock@10 camera=1 pitch_deg=0.2"], check=True, capture_output=True)
    return folder


def look(*pages):
    """Exit code and words of the looker."""
    run = subprocess.run([sys.executable, str(HERE / "report_in_chromium.py"), *map(str, pages)], check=False, capture_output=True, text=True)
    print(run.stdout + run.stderr, end="")
    return run.returncode, run.stdout


def finds_what_it_must(below):
    page = below / "bad.html"
    page.write_text(BAD, encoding="utf-8")
    code, words = look(page)
    missed = [c for c in COMPLAINTS if c not in words]
    if code == 1 and missed:
        print(f"the looker misses: {', '.join(missed)}")
    return code, not missed


def main():
    with tempfile.TemporaryDirectory(prefix="vergence-report-") as below:
        below = pathlib.Path(below)
        code, found = finds_what_it_must(below)
        if code != 1 or not found:
            return code if code == SKIPPED else 1
        sessions = [make(below / "faults", "6000"), make(below / "good", "2000", "no-faults"), make(below / "no_reference", "800", "no-ins"),
                    tear(make(below / "truncated", "3000")), drive(below / "mock_board")]
        pages = []
        for session in sessions:
            written = subprocess.run([os.environ["VERGENCE"], "report", str(session)], check=True, capture_output=True, text=True)
            page = pathlib.Path(written.stdout.strip())
            assert page == session / "report.html", written.stdout
            pages.append(page)
        return look(*pages)[0]


if __name__ == "__main__":
    sys.exit(main())
