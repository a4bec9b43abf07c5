#!/usr/bin/env python3
"""Makes sessions, has `vergence report` write their pages, and looks at them in Chromium. EXAMPLE_SESSION and VERGENCE name the programs."""
import os
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
HOSTILE = '{"stamp_ns":1772360200000000000,"kind":"<b>x</b>","sentence":"</table><script>document.title=1</script> ' + "w" * 400 + '"}\n'


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


def main():
    with tempfile.TemporaryDirectory(prefix="vergence-report-") as below:
        below = pathlib.Path(below)
        sessions = [make(below / "faults", "6000"), make(below / "good", "2000", "no-faults"), make(below / "no_reference", "800", "no-ins"),
                    tear(make(below / "torn", "3000"))]
        pages = []
        for session in sessions:
            written = subprocess.run([os.environ["VERGENCE"], "report", str(session)], check=True, capture_output=True, text=True)
            page = pathlib.Path(written.stdout.strip())
            assert page == session / "report.html", written.stdout
            pages.append(str(page))
        return subprocess.run([sys.executable, str(HERE / "report_in_chromium.py"), *pages], check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
