"""Tags of MATLAB's files of version 5, checked before they are read: SciPy follows damaged ones out of its memory.

Layout after The MathWorks, MAT-File Format (2019): 128 bytes of header, then elements. Each has a tag of 8
bytes, its kind and its size, and fills 8 bytes or a multiple of them. One of at most 4 bytes may have a tag of 4.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

from roughslip.errors import InputError
from roughslip.scan.limits import MOST_BYTES

_ORDER = {b"IM": "<", b"MI": ">"}
_MATRIX, _PACKED = 14, 15  # kinds of element
_NUMBERS = frozenset((1, 2, 3, 4, 5, 6, 7, 9, 12, 13))  # kinds that hold integers, single and double precision
_CLASSES = range(6, 16)  # arrays of numbers and truth values
_COMPLEX = 0x800


def check_matlab(path: Path) -> None:
    """Refuses a file of version 5 in which an element leaves its file or its array, or an array has other parts."""
    content = path.read_bytes()
    order = _ORDER.get(content[126:128])
    if order is None or b"\0" in content[:4]:  # of version 4, or no such file
        return
    try:
        for kind, part in _elements(content[128:], order):
            unpacked = part
            if kind == _PACKED:
                whole = zlib.decompressobj().decompress(part, MOST_BYTES)
                kind, unpacked = next(_elements(whole, order), (0, b""))
            if kind != _MATRIX:
                raise ValueError(f"an element of kind {kind} instead of an array")
            _check_array(unpacked, order)
    except (ValueError, struct.error, zlib.error) as error:
        raise InputError(f"{path}: truncated or damaged ({error}); export it again") from error


def _elements(content: bytes, order: str) -> Iterator[tuple[int, bytes]]:
    """Kind and content of each element."""
    at = 0
    while at < len(content):
        kind, size = struct.unpack_from(f"{order}II", content, at)
        short = kind >> 16
        start, size = (at + 4, short) if short else (at + 8, size)
        if size > (4 if short else len(content) - start):
            raise ValueError(f"an element of {size} bytes does not fit")
        kind &= 0xFFFF
        yield kind, content[start : start + size]
        at = at + 8 if short else start + size + (0 if kind == _PACKED else -size % 8)


def _check_array(content: bytes, order: str) -> None:
    """An array of numbers is its flags, shape, name, real parts and, of complex numbers, imaginary parts."""
    parts = list(_elements(content, order))
    (flags,) = struct.unpack_from(f"{order}I", parts[0][1] if parts else b"")
    kinds = [kind for kind, _ in parts[3:]]
    if flags & 0xFF in _CLASSES and (len(kinds) != (2 if flags & _COMPLEX else 1) or not _NUMBERS.issuperset(kinds)):
        raise ValueError(f"an array with parts of kinds {kinds} instead of its numbers")
