"""References that the study is judged by: made once, kept by git, never part of a run.

One thread a process: libraries read these variables when they are imported.
"""

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[_variable] = "1"
