"""Public names of a package, each imported from its module at first use.

`__init__.pyi` of a package lists them, a line a name, for tools and for this module. So the import of one module
imports no other one, and a stage depends only on the modules that it uses (`compilation/source_hash.py`).
"""

import re
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

_NAME = re.compile(r"^from (\S+) import (\w+) as \2$", re.MULTILINE)


def public_names(package: str, file: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """What `__init__.py` of a package defines as `__getattr__`, `__dir__` and `__all__` (PEP 562).

    package, file : `__name__` and `__file__` of the package
    """
    places = {name: module for module, name in _NAME.findall(Path(file).with_suffix(".pyi").read_text("utf-8"))}

    def find(name: str) -> Any:
        if Path(file).with_name(name).joinpath("__init__.pyi").is_file():  # a subject: `roughslip.contact`
            return import_module(f"{package}.{name}")
        if name not in places:
            raise AttributeError(f"{package} has no public name {name!r}; it has {', '.join(sorted(places))}")
        value = getattr(import_module(places[name]), name)
        setattr(sys.modules[package], name, value)
        return value

    return find, lambda: sorted({*vars(sys.modules[package]), *places}), sorted(places)
