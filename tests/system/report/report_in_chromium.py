#!/usr/bin/env python3
"""Loads report pages in headless Chromium at desktop and phone size in both themes: no console message, no text over another, none cut off
at the page's edge, letters large enough. Says what is wrong with each page; exit code 1 if anything is, 77 without Chromium.

    report_in_chromium.py [--pictures DIR] PAGE...
"""
import argparse
import base64
import http.client
import json
import pathlib
import shutil
import socket
import subprocess
import sys
import tempfile
import time

SKIPPED = 77
SIZES = {"desktop": (1280, 900, False), "phone": (360, 740, True)}
CHROMIUM = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
            "--disable-component-update", "--disable-sync"]

# Every visible piece of text with its box: the words of an SVG text, or the lines of an HTML text node.
PROBE = """
const boxes = [];
const add = (words, r, px) => { if (r.width > 0 && r.height > 0) boxes.push({words: words.slice(0, 60), l: r.left, t: r.top, r: r.right, b: r.bottom, px}); };
for (const e of document.querySelectorAll('svg text')) {
  const scale = e.ownerSVGElement.getBoundingClientRect().width / e.ownerSVGElement.viewBox.baseVal.width;
  add(e.textContent, e.getBoundingClientRect(), parseFloat(getComputedStyle(e).fontSize) * scale);
}
const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
for (let n; n = walker.nextNode();) {
  if (!n.textContent.trim() || n.parentElement.closest('svg')) continue;
  const range = document.createRange();
  range.selectNodeContents(n);
  for (const r of range.getClientRects()) add(n.textContent.trim(), r, parseFloat(getComputedStyle(n.parentElement).fontSize));
}
return {boxes, width: document.documentElement.clientWidth, scroll: document.documentElement.scrollWidth,
        background: getComputedStyle(document.body).backgroundColor};
"""


class Driver:
    """The few words of WebDriver that are needed."""

    def __init__(self, chromedriver, chromium, profile):
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = probe.getsockname()[1]
        self.process = subprocess.Popen([chromedriver, f"--port={self.port}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self._wait_until_ready()
        options = {"binary": chromium, "args": CHROMIUM + [f"--user-data-dir={profile}"]}
        wanted = {"browserName": "chrome", "goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"}}
        self.session = self.call("POST", "/session", {"capabilities": {"alwaysMatch": wanted}})["sessionId"]

    def _wait_until_ready(self):
        for _ in range(200):
            try:
                if self.call("GET", "/status")["ready"]:
                    return
            except OSError:
                pass
            time.sleep(0.1)
        raise RuntimeError("chromedriver does not answer")

    def call(self, method, path, body=None):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=120)
        connection.request(method, path, None if body is None else json.dumps(body), {"Content-Type": "application/json"})
        value = json.loads(connection.getresponse().read())["value"]
        if isinstance(value, dict) and "error" in value:
            raise RuntimeError(f"{path}: {value['message'][:300]}")
        return value

    def word(self, method, path, body=None):
        return self.call(method, f"/session/{self.session}{path}", body)

    def devtools(self, command, **parameters):
        return self.word("POST", "/goog/cdp/execute", {"cmd": command, "params": parameters})

    def close(self):
        try:
            self.word("DELETE", "")
        except (OSError, RuntimeError, AttributeError):
            pass
        self.process.terminate()
        self.process.wait(20)


def overlaps(boxes):
    """Pairs of texts whose boxes share more than a sliver. Line boxes are taller than their letters: a fifth is let through."""
    boxes = sorted(boxes, key=lambda b: b["t"])
    found = []
    for i, a in enumerate(boxes):
        for b in boxes[i + 1:]:
            if b["t"] >= a["b"]:
                break
            wide = min(a["r"], b["r"]) - max(a["l"], b["l"])
            high = min(a["b"], b["b"]) - max(a["t"], b["t"])
            if wide > 1 and high > 0.2 * min(a["b"] - a["t"], b["b"] - b["t"]):
                found.append((a["words"], b["words"]))
    return found


def problems_of(seen, min_px):
    problems = [f"\"{a}\" lies over \"{b}\"" for a, b in overlaps(seen["boxes"])[:5]]
    if seen["scroll"] > seen["width"]:
        problems.append(f"the page is {seen['scroll']} px wide in a window of {seen['width']} px")
    outside = [b["words"] for b in seen["boxes"] if b["l"] < -0.5 or b["r"] > seen["width"] + 0.5]
    problems += [f"\"{words}\" is cut off at the edge" for words in outside[:5]]
    small = [b for b in seen["boxes"] if b["px"] < min_px]
    problems += [f"\"{b['words']}\" has letters of {b['px']:.1f} px" for b in small[:3]]
    if len(seen["boxes"]) < 20:
        problems.append("hardly any text is on the page")
    return problems


def look_at(driver, page, pictures):
    """Sentences about what is wrong with a page."""
    problems = []
    backgrounds = set()
    for size, (width, height, phone) in SIZES.items():
        for theme in ("light", "dark"):
            driver.devtools("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=2 if phone else 1, mobile=phone)
            driver.devtools("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": theme}])
            driver.word("POST", "/url", {"url": page.resolve().as_uri()})
            seen = driver.word("POST", "/execute/sync", {"script": PROBE, "args": []})
            backgrounds.add(seen["background"])
            problems += [f"{page.name} ({size}, {theme}): {p}" for p in problems_of(seen, 9.0)]
            for entry in driver.word("POST", "/se/log", {"type": "browser"}):
                problems.append(f"{page.name} ({size}, {theme}): console says {entry['message'][:200]}")
            if pictures:
                shot = driver.devtools("Page.captureScreenshot", format="png", captureBeyondViewport=True)
                (pictures / f"{page.parent.name}-{size}-{theme}.png").write_bytes(base64.b64decode(shot["data"]))
    if len(backgrounds) != 2:
        problems.append(f"{page.name}: light and dark look the same ({', '.join(backgrounds)})")
    if pictures:
        driver.devtools("Emulation.setEmulatedMedia", features=[])
        pdf = driver.word("POST", "/print", {"background": False, "page": {"width": 21.0, "height": 29.7}, "shrinkToFit": True})
        (pictures / f"{page.parent.name}.pdf").write_bytes(base64.b64decode(pdf))
    return problems


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--pictures", type=pathlib.Path)
    parser.add_argument("pages", nargs="+", type=pathlib.Path)
    arguments = parser.parse_args()
    chromium, chromedriver = shutil.which("chromium"), shutil.which("chromedriver")
    if not chromium or not chromedriver:
        print("skipped: needs Chromium and its driver (apt install chromium chromium-driver)")
        return SKIPPED
    with tempfile.TemporaryDirectory(prefix="vergence-report-", ignore_cleanup_errors=True) as profile:
        driver = Driver(chromedriver, chromium, profile)
        try:
            problems = [p for page in arguments.pages for p in look_at(driver, page, arguments.pictures)]
        finally:
            driver.close()
    print("\n".join(problems) if problems else f"{len(arguments.pages)} pages are as they should be")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
