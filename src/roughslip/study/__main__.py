"""Run a stage, as its rule does: python -m roughslip.study --key <key file>.

What a process is asked for before numpy is imported, which takes seconds on a busy machine: to end with its parent and
on Ctrl-C, and to take one thread. Jobs run side by side, and no bit may depend on the number of cores.
"""

import gc
import os
import signal

from roughslip.study import die_with_parent

if __name__ == "__main__":
    die_with_parent()
    # Ctrl-C ends a job without a traceback, which Snakemake would show.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    gc.disable()  # collecting garbage among what imports make takes a sixth of a start
    for library in ("OPENBLAS", "OMP", "MKL", "NUMBA"):
        os.environ[f"{library}_NUM_THREADS"] = "1"
    os.environ.setdefault("MPLBACKEND", "Agg")
    from roughslip.study.job import main

    main()
