"""Run by `make package` in an environment that holds the wheel alone, without ducc0: names, two examples, no study."""

import runpy
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import roughslip

SUBJECTS = ("surface", "scan", "contact", "chaos", "friction", "oscillator", "probability", "record")

packages = [roughslip, *(import_module(f"roughslip.{subject}") for subject in SUBJECTS)]
names = [getattr(package, name) for package in packages for name in package.__all__]
folder = Path(roughslip.__file__).parent
assert "site-packages" in folder.parts, f"not the installed package: {folder}"
assert (folder / "py.typed").is_file()
study = ("snakemake", "matplotlib", "jsonschema", "ducc0", "roughslip.scene", "roughslip.study", "roughslip.report")
assert not any(map(find_spec, study)), "the study is installed too"
for example in ("contact", "own_law_and_trace"):
    runpy.run_path(str(Path(__file__).parents[1] / f"examples/{example}.py"))
runpy.run_module("roughslip", run_name="__main__")
print(f"{len(names)} public names")
