"""One small module a stage: read, call the package, write. `__main__` runs them.

A job ends with the process that started it, so that a killed Snakemake leaves no writer behind. This is set before
numpy is imported, which takes seconds on a busy machine.
"""

import ctypes
import gc
import os
import signal
import sys

PARENT = "ROUGHSLIP_PARENT"  # in the environment: the process that starts the stages


def die_with_parent() -> None:
    """Ask the kernel to kill this process when its parent dies.

    Linux only, and only for the direct parent: a rule's shell line starts the stage with `exec`. A parent that died
    before this call sends no signal any more. The Snakefile puts its process id into PARENT.
    """
    if sys.platform == "linux":
        set_parent_death_signal = 1  # PR_SET_PDEATHSIG of <linux/prctl.h>
        ctypes.CDLL(None).prctl(set_parent_death_signal, signal.SIGKILL, 0, 0, 0)
        if os.environ.get(PARENT, str(os.getppid())) != str(os.getppid()):
            os.kill(os.getpid(), signal.SIGKILL)


# One thread a job: jobs run side by side, and no bit may depend on the number of cores.
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
