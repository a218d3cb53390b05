"""The part of a scene that a stage reads, as an object: `scene.material.poisson_ratio`.

Keys are checked when a study is planned. So jobs need no pydantic, whose import takes longer than that of numpy.
"""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from roughslip.scene.types import Scene
else:

    class Scene(SimpleNamespace):
        """A scene or a section of one, frozen. It holds only the keys that a stage reads."""

        def __getattr__(self, name: str) -> Any:
            """Called for a missing attribute alone."""
            raise AttributeError(
                f"{name} is not among the keys that this stage reads; add it to `reads` of its row, "
                f"which has {', '.join(vars(self))} here"
            )

        def __setattr__(self, name: str, value: Any) -> None:
            raise AttributeError(f"{name} cannot be set: a scene is frozen")


def part(values: Mapping[str, Any]) -> Scene:
    """The object of nested dicts, whose lists become tuples."""
    held: dict[str, Any] = {
        name: part(one) if isinstance(one, Mapping) else as_tuples(one) for name, one in values.items()
    }
    return Scene(**held)


def as_tuples(value: Any) -> Any:
    """Lists, and those in them, as tuples."""
    return tuple(map(as_tuples, value)) if isinstance(value, list) else value


def without_nulls(values: Any) -> Any:
    """Nested dicts without the keys that have no value."""
    if not isinstance(values, dict):
        return values
    return {key: without_nulls(value) for key, value in values.items() if value is not None}
