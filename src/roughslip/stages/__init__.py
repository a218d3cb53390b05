"""One small module a stage: read, call the package, write. `__main__` runs them."""

import gc
import os
import signal
import sys

from roughslip.stages.runtime.parent import die_with_parent

# Before numpy is imported. One thread a job: jobs run side by side, and no bit may depend on the number of cores.
for _library in ("OPENBLAS", "OMP", "MKL", "NUMBA"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"
os.environ.setdefault("MPLBACKEND", "Agg")

# True while Python is looking for the module of `python -m roughslip.stages`. Ctrl-C ends a job without a
# traceback, which Snakemake would show. What imports make stays: collecting garbage among it takes a sixth of a start.
IS_JOB = sys.argv[:1] == ["-m"]
if IS_JOB:
    die_with_parent()
    gc.disable()
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
