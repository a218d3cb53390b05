"""What surrounds the science: rules, what they ask for, measurements. Imported as `from workflow.x import y` alone.

The import limits numerical libraries to one thread, before they are imported: results and times do not depend on cores.
"""

import os

for _library in ("OPENBLAS", "OMP", "MKL", "NUMBA"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"
