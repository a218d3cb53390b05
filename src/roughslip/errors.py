"""Typed errors. Each message says what went wrong, how far it got and what to try."""

import numbers


class RoughslipError(Exception):
    """Base of every error that this package raises on purpose.

    scene_keys : keys of a scene that change what the message names, with commas; none where no scene has it
    """

    def __init__(self, message: str = "", scene_keys: str = "") -> None:
        super().__init__(message)
        self.scene_keys = scene_keys

    @property
    def in_scene(self) -> str:
        """The message for the user of a scene, who has keys in place of arguments."""
        some = "s" if "," in self.scene_keys or " or " in self.scene_keys else ""
        return f"{self}; scene key{some}: {self.scene_keys}" if self.scene_keys else str(self)


class InputError(RoughslipError):
    """One or more mistakes in what a user gave: a line per mistake, all of them at once."""

    def __init__(self, lines: list[str] | tuple[str, ...] | str, scene_keys: str = "") -> None:
        self.lines = (lines,) if isinstance(lines, str) else tuple(lines)
        super().__init__("\n".join(self.lines), scene_keys)


class ParameterError(RoughslipError, ValueError):
    """A parameter or an array outside the domain of the method that was given it."""


class ConvergenceError(RoughslipError):
    """An iteration ended without reaching its tolerance.

    residual : the residual reached, in the unit that the message names
    work : iterations, convolutions or evaluations spent
    """

    def __init__(self, message: str, residual: float, work: int, scene_keys: str = "") -> None:
        self.residual, self.work = residual, work
        super().__init__(f"{message} (residual reached {residual:.3e}, work {work})", scene_keys)


class IllPosedError(RoughslipError):
    """The data cannot determine what is asked: too few samples, a singular system, no valid marginal."""


class StoreError(RoughslipError):
    """A result file is missing, truncated, altered or not what the reader expects."""


class MissingPackageError(RoughslipError, ImportError):
    """A package of an extra is not installed; the message says what installs it."""


def real(name: str, value: object) -> float:
    """The value as a float; ParameterError where it is no real number."""
    if type(value) is float:  # at once: the check by class takes a microsecond
        return value
    if getattr(value, "shape", None) == () and not getattr(value, "mask", False):
        value = value.item()  # type: ignore[attr-defined]  # of an array without dimensions
    if not isinstance(value, numbers.Real) or isinstance(value, bool):
        raise ParameterError(f"{name} must be a real number, not {value!r}")
    return float(value)


def whole(name: str, value: object) -> int:
    """The value as an int; ParameterError where it is no whole number."""
    if not isinstance(value, numbers.Integral) or isinstance(value, bool):
        raise ParameterError(f"{name} must be a whole number, not {value!r}")
    return int(value)
