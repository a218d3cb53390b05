"""Run the tests of the night, and keep the evidence that they passed: `make nightly`.

The evidence names the trees of the sources and of the tests as Git does, so that anybody can see whether it is of this
commit, and the CPU seconds that they took.
"""

import argparse
import json
import resource
import subprocess
import sys
from pathlib import Path

EVIDENCE = Path("results/reference/evidence/nightly.json")


def git(*words: str) -> str:
    return subprocess.run(["git", *words], check=True, capture_output=True, text=True).stdout.strip()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-j", "--jobs", default="2", help="processes")
    jobs = parser.parse_args().jobs
    if git("status", "--porcelain", "src", "tests"):
        sys.exit("src or tests hold changes that are not committed: commit them, and run make nightly again")
    trees = {name: git("rev-parse", f"HEAD:{name}") for name in ("src", "tests")}
    command = [sys.executable, "-m", "pytest", "-n", jobs, "--dist", "loadfile", "-m", "nightly"]
    ended = subprocess.run(command, stdout=subprocess.PIPE, text=True)
    print(ended.stdout)
    if ended.returncode:
        sys.exit(ended.returncode)
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = round(usage.ru_utime + usage.ru_stime)
    passed = ended.stdout.strip().rsplit("\n", 1)[-1].strip("= ").partition(" in ")[0]
    EVIDENCE.write_text(json.dumps({**trees, "passed": passed, "cpu_seconds": seconds}, indent=2) + "\n")


if __name__ == "__main__":
    main()
