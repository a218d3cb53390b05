"""Faults of a run: killed processes, a full disk, damaged files. One new run must give the same results.

`python -m workflow.faults --count 200 --seed 1` in the project, or `make faults`. A tiny scene with every stage is run
once undisturbed in a scratch copy of the project, then broken and mended, again and again.
"""
