"""Stress campaigns: thousands of random problems of every stage, each answer judged by code that the solver lacks."""

import workflow.evidence  # noqa: F401  It limits numerical libraries to one thread and must precede them.
