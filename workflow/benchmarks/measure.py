"""Names of cases, until all stress campaigns import them from workflow.evidence.rows."""

from workflow.evidence.rows import case, fields, power

__all__ = ["case", "fields", "power"]
