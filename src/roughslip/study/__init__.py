"""The study: its graph of stages, the job that runs one, and the work of each stage in a module.

A job ends with the process that started it, so that a killed Snakemake leaves no writer behind.
"""

import ctypes
import os
import signal
import sys

PARENT = "ROUGHSLIP_PARENT"  # in the environment: the process that starts the jobs


def die_with_parent() -> None:
    """Ask the kernel to kill this process when its parent dies.

    Linux only, and only for the direct parent: a rule's shell line starts the job with `exec`. A parent that died
    before this call sends no signal any more. The Snakefile puts its process id into PARENT.
    """
    if sys.platform == "linux":
        set_parent_death_signal = 1  # PR_SET_PDEATHSIG of <linux/prctl.h>
        ctypes.CDLL(None).prctl(set_parent_death_signal, signal.SIGKILL, 0, 0, 0)
        if os.environ.get(PARENT, str(os.getppid())) != str(os.getppid()):
            os.kill(os.getpid(), signal.SIGKILL)
