"""`python -m roughslip`: the version, and where to read on."""

from pathlib import Path

import roughslip

clone = Path(__file__).resolve().parents[2]
has_manual = (clone / "docs" / "index.md").is_file()
manual = clone / "docs" / "index.md" if has_manual else "docs/index.md in a clone of the project"
print(f"roughslip {roughslip.__version__}")
print(f"manual: {manual}; `make docs` there builds it as a site")
print("in Python: help(roughslip), help(roughslip.contact)")
print(f"the study (scenes, figures, verdicts): `make help` in {clone}" if has_manual else "the study runs from a clone")
