"""Run a module of this folder as a job that ends with Snakemake: python -m workflow.job benchmarks.plot ..."""

from __future__ import annotations

import os
import runpy
import sys

from roughslip.stages.runtime.parent import PARENT, die_with_parent

if __name__ == "__main__":
    die_with_parent()
    os.environ[PARENT] = str(os.getpid())  # of the processes that the module starts
    sys.argv[:] = sys.argv[1:]
    runpy.run_module(f"workflow.{sys.argv[0]}", run_name="__main__", alter_sys=True)
