"""roughslip: from rough surfaces to the scatter of friction and of stick-slip vibration.

Public are the names in `__all__` of this package and of surface, scan, record, contact, chaos, friction, oscillator
and probability, and `roughslip.plot`. All quantities are in SI units; x slides along the belt, y lies across it.
"""

from roughslip.public_names import public_names

__version__ = "2.0.0"
__getattr__, __dir__, __all__ = public_names(__name__, __file__)
