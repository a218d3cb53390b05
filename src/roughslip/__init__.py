"""roughslip: from rough surfaces to the scatter of friction and of stick-slip vibration."""

__version__ = "0.1.0"
