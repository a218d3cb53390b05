"""One small command a stage: read, call the package, write."""

import os
import signal
import sys

from roughslip.stages.runtime.parent import die_with_parent

# Before numpy is imported. One thread a job: jobs run side by side, and no bit may depend on the number of cores.
for _library in ("OPENBLAS", "OMP", "MKL", "NUMBA"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"
os.environ.setdefault("MPLBACKEND", "Agg")

# Python is looking for the module of `python -m roughslip.stages.<stage>`: this is a job. Ctrl-C ends it without a
# traceback, which Snakemake would show.
if sys.argv[:1] == ["-m"]:
    die_with_parent()
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
