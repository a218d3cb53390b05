"""Licences of all packages that a run installs, from what they say of themselves: `python -m workflow.study.licences`.

Prints docs/licences.md. A test compares it with the lock and with what is installed.
"""

from __future__ import annotations

import re
from collections import defaultdict
from importlib.metadata import PackageMetadata, PackageNotFoundError, metadata
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

# Packages whose metadata name no licence, or many words: what the licence file in them says.
READ = {
    "conda-inject": "MIT",
    "docutils": "Public Domain, BSD-2-Clause, one file GPL-3.0",
    "ducc0": "GPL-2.0-or-later, its transforms BSD-3-Clause too",
    "kiwisolver": "BSD-3-Clause",
    "matplotlib": "Matplotlib (PSF style)",
    "cycler": "BSD-3-Clause",
    "numpi": "MIT",
    "pyreadline3": "BSD-3-Clause",
    "scipy": "BSD-3-Clause",
    "surfacetopography": "MIT",
}

# What asks more of those who pass it on than its notice, and what that means here.
COPYLEFT = {
    "certifi": "a list of certificates, unchanged: MPL binds changes of its files alone",
    "docutils": "a tool of the GPL for Emacs, which nothing here runs or passes on",
    "ducc0": "imported, not passed on with roughslip; an image or installer that holds both is GPL software as a "
    "whole, unless it takes the transforms alone, under their BSD licence",
    "igor2": "a reader of files, by which SurfaceTopography knows one format; LGPL binds changes of it alone",
    "pathspec": "unchanged: MPL binds changes of its files alone",
}

_COPYLEFT = re.compile(r"GPL|General Public|MPL|Mozilla|EUPL|CDDL|CC-BY-SA", re.IGNORECASE)


def normal(name: str) -> str:
    """The name of a package as registries compare it (PEP 503)."""
    return re.sub(r"[-_.]+", "-", name).lower()


def locked(lock: Path) -> list[str]:
    """Normal names of the packages of a lock file."""
    return sorted({normal(name) for name in re.findall(r"(?m)^([\w.-]+)==", lock.read_text(encoding="utf-8"))})


def licence(name: str) -> str | None:
    """The licence of an installed package by its normal name; None where it is not installed."""
    if name in READ:
        return READ[name]
    try:
        found: PackageMetadata = metadata(name)
    except PackageNotFoundError:
        return None
    classifiers = [
        line.rpartition(" :: ")[2] for line in found.get_all("Classifier") or [] if line.startswith("License")
    ]
    text = (found.get("License-Expression") or found.get("License") or "").strip()
    short = text if text and "\n" not in text and len(text) < 80 and text != "UNKNOWN" else ""
    return short or ", ".join(sorted(set(classifiers))) or _of_its_file(name)


def is_copyleft(text: str) -> bool:
    """Whether a licence asks more than its notice of those who pass the package on."""
    return _COPYLEFT.search(text) is not None


def page(lock: Path) -> str:
    """docs/licences.md."""
    by_licence = defaultdict(list)
    for name in locked(lock):
        by_licence[licence(name) or "not installed here"].append(name)
    lines = [
        "# Licences",
        "",
        "roughslip is under the MIT licence. A run installs the packages of `requirements.lock`; what is listed is",
        "what they say of themselves. Those that ask more than their notice of whoever passes them on:",
        "",
        *(f"- **{name}** ({licence(name)}): {why}." for name, why in sorted(COPYLEFT.items())),
        "",
        "All of them:",
        "",
        "| licence | packages |",
        "|---|---|",
        *(
            f"| {text} | {', '.join(names)} |"
            for text, names in sorted(by_licence.items(), key=lambda row: row[0].lower())
        ),
        "",
        "Made by `python -m workflow.study.licences > docs/licences.md`. Known weaknesses of the locked versions, for",
        "advice: `pipx run pip-audit -r requirements.lock --require-hashes --disable-pip`.",
        "",
    ]
    return "\n".join(lines)


def _of_its_file(name: str) -> str:
    """What the licence file of a package begins with."""
    from importlib.metadata import files

    for path in files(name) or []:
        if re.search(r"licen[cs]e|copying", path.name, re.IGNORECASE):
            text = path.read_text(encoding="utf-8")
            for known in ("MIT License", "Apache License", "BSD 3-Clause", "BSD 2-Clause"):
                if known.lower() in text.lower():
                    return known
            if "Permission is hereby granted, free of charge" in text:
                return "MIT"
            if "Redistribution and use in source and binary forms" in text:
                return "BSD"
    return "not stated"


if __name__ == "__main__":
    print(page(ROOT / "requirements.lock"), end="")
