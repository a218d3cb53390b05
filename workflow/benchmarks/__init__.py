"""Benchmarks: run time against error, measured in turns with public solvers on one thread."""

import workflow.evidence  # noqa: F401  limits libraries to one thread before they are imported
