"""The pages in a browser: no errors, every picture is drawn, links have targets, they fit a phone, light and dark.

Any Chromium will do; without one the tests skip.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from html import unescape
from pathlib import Path

import pytest

from roughslip import store
from roughslip.report.page import MEASURED, Evidence, SceneReport, page
from tests.report.test_report_answer import MACHINE, machine_scene

REFERENCE = Path(__file__).resolve().parents[2] / "results" / "reference"
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
BROWSER = next((found for name in NAMES if (found := shutil.which(name))), None)

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(BROWSER is None, reason=f"no browser found: {', '.join(NAMES)}"),
]

LISTEN = """<script>window.wrong = [];
addEventListener("error", e => wrong.push(String(e.message || e.target.outerHTML.slice(0, 80))), true);
for (const kind of ["error", "warn"]) console[kind] = (...words) => wrong.push(words.join(" "));</script>"""

# Contrast as the Web Content Accessibility Guidelines 2.1 define it, of every element with text of its own.
PROBE = """<script>addEventListener("load", () => {
  const channel = c => { c /= 255; return c <= 0.03928 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4; };
  const light = ([r, g, b]) => 0.2126 * channel(r) + 0.7152 * channel(g) + 0.0722 * channel(b);
  const numbers = text => text.match(/[0-9.]+/g).map(Number);
  const behind = element => { for (; element; element = element.parentElement) {
    const colour = numbers(getComputedStyle(element).backgroundColor);
    if (colour.length < 4 || colour[3] > 0) return colour.slice(0, 3); } return [255, 255, 255]; };
  const faint = [], TARGET = "Natural reading";
  for (const element of document.body.querySelectorAll("*")) {
    if (![...element.childNodes].some(node => node.nodeType === 3 && node.data.trim())) continue;
    if (["SCRIPT", "STYLE"].includes(element.tagName)) continue;
    const [a, b] = [light(numbers(getComputedStyle(element).color).slice(0, 3)), light(behind(element))];
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (ratio < 4.5) faint.push(element.outerHTML.slice(0, 80) + " " + ratio.toFixed(2));
  }
  const found = {
    wrong, faint,
    pictures: [...document.querySelectorAll("svg[role=img]")].map(
      svg => [svg.getAttribute("aria-label"), svg.getBoundingClientRect().width / innerWidth]),
    unfolded: [...document.querySelectorAll("details[open]")].map(details => details.innerText.includes(TARGET)),
    back: getComputedStyle(document.body).backgroundColor,
    links: [...document.links].filter(link => link.hash).map(link =>
      [link.getAttribute("href"), !!document.getElementById(link.hash.slice(1))]),
    ids: [...document.querySelectorAll("[id]")].map(element => element.id),
    width: [document.documentElement.scrollWidth, innerWidth],
  };
  document.body.innerHTML = "";
  document.body.appendChild(document.createElement("pre")).textContent = JSON.stringify(found);
});</script>"""


@pytest.fixture(scope="module")
def text():
    """The page of the kept results, with every kind of evidence."""
    scenes = []
    for name in ("paper", "resolved"):
        kept = REFERENCE / name
        figures = {figure: (kept / f"{figure}.png").read_bytes() for figure in ("figure2", "figure3", "figure5")}
        claims, costs = (store.read_json(kept / f"{file}.json") for file in ("claims", "costs"))
        scenes.append(SceneReport(name, "Kept", figures, dict.fromkeys(figures, "A caption."), {}, claims, costs, "{}"))
    picture = (REFERENCE / "paper" / "figure2.png").read_bytes()
    stress = [{"stage": "a", "problems": 1, "outcomes": {"converged": 1}, "worst_residual_over_tolerance": 0.1}]
    return page(scenes, store.versions(), Evidence(dict.fromkeys(MEASURED, picture), stress))


LIGHT, DARK = "rgb(255, 255, 255)", "rgb(22, 24, 28)"


WINDOWS = {"phone": (390, 844, LIGHT), "desk": (1280, 900, LIGHT), "dark": (1280, 900, DARK)}


@pytest.fixture(scope="module", params=WINDOWS)
def probed(request, text, tmp_path_factory):
    """What the browser reports of the page, loaded at a verdict in a window of a phone's size or a desk's."""
    return probe(text, tmp_path_factory.mktemp("browser"), *WINDOWS[request.param], "#paper-fig2-pc-lhs")


def probe(text, folder, width, height, back, place=""):
    """What the browser reports of a page at a place. back : colour of the background that the reader asked for"""
    (folder / "page.html").write_text(
        text.replace("<head>", f"<head>{LISTEN}").replace("</body>", f"{PROBE}</body>"), encoding="utf-8"
    )
    command = [
        *(BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars"),
        *(f"--user-data-dir={folder / 'profile'}", f"--window-size={width},{height}"),
        f"--blink-settings=preferredColorScheme={int(back == LIGHT)}",
        *("--virtual-time-budget=20000", "--dump-dom", f"{(folder / 'page.html').as_uri()}{place}"),
    ]
    run = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    block = re.search(r"<pre[^>]*>(.*?)</pre>", run.stdout, re.S)
    assert block, run.stderr[-2000:]
    return json.loads(unescape(block[1])) | {"asked": back}


@pytest.mark.parametrize("window", WINDOWS)
@pytest.mark.parametrize("shown", ["likely", "unlikely"])
def test_the_pages_of_machines_are_read_anywhere(shown, window, tmp_path):
    """Text of every verdict and drawing stands out, nothing is wider than the window, every link leads somewhere."""
    answer = MACHINE | {"probability": {"value": float(shown == "likely"), "interval": [0.0, 1.0], "unit": "1"}}
    figures = {name: (REFERENCE / "paper" / "figure2.png").read_bytes() for name in ("figure2", "figure_map")}
    text = page([machine_scene(answer, figures=figures, captions=dict.fromkeys(figures, "A caption."))], {})
    seen = probe(text, tmp_path, *WINDOWS[window])
    assert seen["wrong"] == seen["faint"] == []
    assert seen["back"] == seen["asked"]
    assert all(there for _, there in seen["links"])
    scroll, width = seen["width"]
    assert scroll <= width


def test_the_page_of_the_study_is_read_anywhere(probed):
    """Each picture fills the width of a desk; on a phone it scrolls in its frame, so that its text stays readable.

    A link to a verdict unfolds its details. What is wider than the page, pictures and code, scrolls by itself.
    """
    assert probed["wrong"] == probed["faint"] == []
    pictures = probed["pictures"]
    assert len(pictures) == 2 * 3 + len(MEASURED)
    scroll, width = probed["width"]
    assert scroll <= width
    least, most = (1.0, 4.0) if width < 800 else (0.5, 1.0)
    assert all(label and least < share <= most for label, share in pictures)
    assert probed["unfolded"] == [True]
    assert probed["back"] == probed["asked"]
    assert probed["links"]
    assert all(there for _, there in probed["links"])
    assert len(probed["ids"]) == len(set(probed["ids"]))
    for name in ("paper", "resolved"):
        claims = store.read_json(REFERENCE / name / "claims.json")
        assert {f"{name}-{claim['id']}" for claim in claims} <= set(probed["ids"])
