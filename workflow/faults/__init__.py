"""Faults of a run: killed processes, a full disk, damaged files. One new run must give the same results."""
