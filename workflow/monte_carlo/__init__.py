"""Monte Carlo references of the pressure at the centre and of the friction of windows.

They are made once, git keeps them in results/reference/<scene>, and no run of the study makes or reads them.
"""

import workflow.evidence  # noqa: F401  limits libraries to one thread before they are imported
