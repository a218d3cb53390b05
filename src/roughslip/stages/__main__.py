"""Run a stage, as its rule does: python -m roughslip.stages design --key <key file>, or figures figure2 --key ..."""

import sys
from importlib import import_module

from roughslip.stages.runtime.command import execute

if __name__ == "__main__":
    module = import_module(f"roughslip.stages.{sys.argv.pop(1)}")
    several = {stage.name: stage for stage in getattr(module, "STAGES", ())}
    execute(several[sys.argv.pop(1)] if several else module.STAGE, module.work)
