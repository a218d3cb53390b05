"""Measured friction records: the mean curve over speed and the scatter about it, with their errors.

`__init__.pyi` lists all public names and their modules.
"""

from roughslip.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
