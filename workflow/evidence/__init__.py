"""What git keeps of the results of benchmarks and stress campaigns.

Importing this package limits numerical libraries to one thread, so import it before them.
"""

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[_variable] = "1"
