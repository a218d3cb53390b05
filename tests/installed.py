"""Run by `make package` in an environment that holds the wheel alone, without ducc0: names, a contact next to Hertz."""

import runpy
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import roughslip

SUBJECTS = ("surface", "scan", "contact", "chaos", "friction", "oscillator", "probability")

packages = [roughslip, *(import_module(f"roughslip.{subject}") for subject in SUBJECTS)]
names = [getattr(package, name) for package in packages for name in package.__all__]
folder = Path(roughslip.__file__).parent
assert "site-packages" in folder.parts, f"not the installed package: {folder}"
assert (folder / "py.typed").is_file()
assert (folder / "report/templates/page.html.j2").is_file()
assert not any(map(find_spec, ("snakemake", "matplotlib", "jsonschema", "ducc0"))), "the study is installed too"
runpy.run_path(str(Path(__file__).parents[1] / "examples/contact_hertz.py"))
print(f"roughslip {roughslip.__version__}: {len(names)} public names")
