"""Figures inside the page, as SVG elements that thumbnails show again without a second copy."""

from __future__ import annotations

import base64
import re
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from typing import Any

from roughslip.report.words import SURE, amount

PNG = b"\x89PNG\r\n\x1a\n"
READABLE = 1.15  # pixels a point on a narrow screen: text of 9 points has 10 pixels; a wider picture then scrolls
PIXELS = 160 / 72  # of a PNG a point
LARGEST_SVG = 300_000  # bytes, after reduction; a PNG takes the place of a larger one


def reduced(svg: str) -> str:
    """A drawing of matplotlib without comments, metadata and spare digits: coordinates in points to 0.01."""
    svg = re.sub(r"<!--.*?-->|<metadata>.*?</metadata>|<style.*?</style>", "", svg[svg.index("<svg") :], flags=re.S)
    svg = re.sub(r' (?:d|x|y)="[^"]*"', lambda match: re.sub(r"(\.\d\d)\d+", r"\1", match[0]), svg)
    svg = re.sub(r'<g id="[^"]*"', "<g", svg).replace("xlink:href", "href")  # matplotlib refers to no group or image,
    svg = re.sub(r'(<image [^>]*?) id="[^"]*"', r"\1", svg)  # and alike images have the same id
    return re.sub(r">\s+<", "><", re.sub(r"\s*\n\s*", " ", svg))


def chosen(svg: str, png: bytes) -> bytes:
    """The reduced SVG, or the PNG where the former is too large."""
    small = reduced(svg).encode()
    return small if len(small) <= LARGEST_SVG else png


def size(content: bytes) -> tuple[float, float]:
    """Width and height of a PNG [pixels] or of an SVG [points]."""
    if content.startswith(PNG):
        return struct.unpack(">II", content[16:24])
    box = re.search(rb'viewBox="0 0 ([\d.]+) ([\d.]+)"', content)
    if box is None:
        raise ValueError("a drawing has no viewBox at the origin; write it with roughslip.figures.style.save")
    return float(box[1]), float(box[2])


def element(content: bytes, name: str, seen: str) -> str:
    """The figure as an SVG element. name : prefix of its ids, unique on the page; seen : what it shows, in words"""
    width, height = size(content)
    readable = READABLE * width / (PIXELS if content.startswith(PNG) else 1.0)
    if content.startswith(PNG):
        picture = base64.b64encode(content).decode()
        inside = f'<image href="data:image/png;base64,{picture}" width="{width:g}" height="{height:g}"/>'
    else:
        text = content.decode()
        inside = re.sub(
            r'(\bid="|\bhref="#|url\(#)', rf"\g<1>{name}-", text[text.index(">") + 1 : text.rindex("</svg>")]
        )
    look = f'class="drawing" style="--readable: {readable:.0f}px" viewBox="0 0 {width:g} {height:g}"'
    head = f'<div class="wide" tabindex="0"><svg {look} role="img" aria-label="{escape(seen)}">'
    return f'{head}<g id="{name}-drawing">{inside}</g></svg></div>'


def thumbnail(content: bytes, name: str) -> str:
    """The figure again, small; the link around it says what it is."""
    width, height = size(content)
    box = f'class="drawing" viewBox="0 0 {width:g} {height:g}"'
    return f'<svg {box} aria-hidden="true"><use href="#{name}-drawing"/></svg>'


@dataclass(frozen=True)
class Plot:
    """Curves in a box of 100 by 100, as points of SVG, by `with_scatter` and `without_scatter`.

    across, along : lengths of the axes in words
    """

    lines: Mapping[str, str]
    across: str
    along: str


def plots(motion: Mapping[str, Any]) -> dict[str, Plot]:
    """Displacement and speed against time, and the cycle: speed against displacement."""
    units = {"time_s": "s", "displacement_m": "m", "velocity_m_per_s": "m s-1"}
    box = {}
    for name in units:
        values = [value for curve in motion.values() for value in curve[name]]
        box[name] = min(values), max(max(values) - min(values), 1e-300)
    drawn = {}
    for title, x, y in (
        ("displacement", "time_s", "displacement_m"),
        ("speed", "time_s", "velocity_m_per_s"),
        ("cycle", "displacement_m", "velocity_m_per_s"),
    ):
        lines = {
            kind: " ".join(
                f"{100 * (a - box[x][0]) / box[x][1]:.4g},{100 - 100 * (b - box[y][0]) / box[y][1]:.4g}"
                for a, b in zip(curve[x], curve[y], strict=True)
            )
            for kind, curve in motion.items()
        }
        drawn[title] = Plot(lines, *(amount(box[axis][1], units[axis], SURE) for axis in (x, y)))
    return drawn
