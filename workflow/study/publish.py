"""Put results of the store where people open them.

python -m workflow.study.publish <file of the store> <where people open it>
python -m workflow.study.publish <key file of a list> <folder of the scene>
"""

import contextlib
import filecmp
import json
import os
import shutil
import sys
from collections.abc import Mapping
from pathlib import Path

from roughslip.atomic_write import replacing

LISTED = "published.json"  # in the folder of a scene: the file of the store by name
LINKED_BYTES = 1_000_000  # larger numbers are hard links; all else is copied, because people may save over it


def is_current(path: str | Path, source: str | Path) -> bool:
    """Whether a published file is that of the store."""
    try:
        own, stored = os.stat(path), os.stat(source)
    except OSError:
        return False
    if os.path.samestat(own, stored):
        return True
    return own.st_size == stored.st_size and filecmp.cmp(path, source, shallow=False)


def is_published(folder: Path, files: Mapping[str, str]) -> bool:
    """Whether a folder lists these files of the store, by name, and holds them."""
    return _listed(folder) == files and all(is_current(folder / name, source) for name, source in files.items())


def publish_one(path: Path, source: Path) -> None:
    """Copy or link a file of the store; a file system without hard links gets a copy. Raises OSError."""
    with replacing(path) as temporary:
        if source.suffix == ".nc" and source.stat().st_size >= LINKED_BYTES:
            with contextlib.suppress(OSError):
                os.link(source, temporary)
                return
        shutil.copy2(source, temporary)


def publish(folder: Path, files: Mapping[str, str]) -> None:
    """Publish files that are not current, remove those that are no more. Raises OSError."""
    publish_existing(folder, files)
    for name, source in _listed(folder).items():
        if name not in files and (is_current(folder / name, source) or not os.path.exists(source)):
            (folder / name).unlink(missing_ok=True)
    with replacing(folder / LISTED) as temporary:
        temporary.write_text(json.dumps(files, indent=1) + "\n", encoding="utf-8")


def publish_existing(folder: Path, files: Mapping[str, str]) -> None:
    """Publish those files that the store holds. Raises OSError."""
    for name, source in files.items():
        if os.path.exists(source) and not is_current(folder / name, source):
            publish_one(folder / name, Path(source))


def _listed(folder: Path) -> dict[str, str]:
    try:
        listed = json.loads((folder / LISTED).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return listed if isinstance(listed, dict) else {}


def main() -> None:
    """Publish a file of the store, or all that a key file lists; exit 1 where it cannot be."""
    source, path = map(Path, sys.argv[1:])
    try:
        if source.name == "key.json" and path.suffix == "":
            publish(path, json.loads(source.read_text(encoding="utf-8"))["published"])
        else:
            publish_one(path, source)
    except OSError as error:
        sys.exit(f"publish: error: {error.filename}: {error.strerror}")


if __name__ == "__main__":
    main()
