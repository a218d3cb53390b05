"""One small command a stage: read, call the package, write."""

import os

# Before numpy is imported. One thread a job: jobs run side by side, and no bit may depend on the number of cores.
for _library in ("OPENBLAS", "OMP", "MKL", "NUMBA"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"
os.environ.setdefault("MPLBACKEND", "Agg")
