"""Remove results that no scene uses: python -m workflow.study.unused [folder of scenes of the caller].

`snakemake clean_unused` runs it.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

from roughslip.errors import InputError
from workflow.keys import STORE, Names
from workflow.study.publish import is_current
from workflow.study.scenes import FOLDERS, Scenes


def unused(names: Names) -> list[Path]:
    """Folders of scenes that are gone, and folders of the store that no scene names.

    Raises InputError where a scene has a mistake: what it names is not known.
    """
    scenes = names.scenes
    if bad := sorted(set(scenes.names).difference(scenes.valid)):
        raise InputError(f"clean_unused: nothing is removed while scenes have mistakes: {', '.join(bad)}")
    used = {Path(file).parts[:4] for name in scenes.valid for file in names.published(name).values()}
    used |= {Path(names.publication(name).folder).parts for name in scenes.valid}
    results = Path("results")
    gone = [path for path in sorted(results.glob("*")) if path.is_dir() and path.name not in {*scenes.names, *FOLDERS}]
    stored = [path for path in Path(STORE).glob("*/*") if path.is_dir() and path.parts not in used]
    of_several = (path for path in stored if any(is_current(results / file.name, file) for file in path.glob("*")))
    return [*gone, *sorted({*stored}.difference(of_several))]


def main() -> None:
    """Remove it, with a line for each folder; exit 1 with a line where a scene has a mistake."""
    root = Path(__file__).resolve().parents[2]
    try:
        folders = unused(Names(Scenes(root, words=[], own=next(iter(sys.argv[1:]), None)), root, writes=False))
    except InputError as error:
        sys.exit(f"clean_unused: error: {error}")
    for folder in folders:
        print(f"removed: {folder}", flush=True)
        shutil.rmtree(folder)


if __name__ == "__main__":
    main()
