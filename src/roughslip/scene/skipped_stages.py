"""Which stages a scene does without, and why: told in its costs."""

from __future__ import annotations

from roughslip.scene.rules import OF_FRICTION, STAGES, STRIP_STAGES, Scene, friction_is_given, get, stages_needed

# Stages beside another one, where the scene leaves something open.
_BESIDE = {
    "training_square": ("chaos_square", "expansion.samples is given"),
    "spacing": ("oscillator", "ensemble.nodes_per_correlation_length is given"),
    "grinding": ("scan", "the scan is a file"),
}


def not_needed(scene: Scene) -> dict[str, str]:
    """The stages of any target that do not run for those of the scene, each with the reason."""
    needed = stages_needed(scene)
    every = {stage: None for stages in STAGES.values() for stage in stages} | dict.fromkeys(_BESIDE)
    return {stage: _reason(scene, stage, needed) for stage in every if stage not in needed}


def _reason(scene: Scene, stage: str, needed: set[str]) -> str:
    if stage in _BESIDE:
        beside, reason = _BESIDE[stage]
        return reason if beside in needed else _reason(scene, beside, needed)
    if stage in STAGES["figure_scan"]:
        return "no surface is sampled" if get(scene, "roughness.scan") else "roughness.scan is not given"
    serves = [target for target, stages in STAGES.items() if stage in stages]
    if stage in STRIP_STAGES:
        if friction_is_given(scene) and OF_FRICTION.intersection(scene["targets"]):
            return "friction.statistics is given"
        serves += sorted(OF_FRICTION)
    return f"not asked for: {', '.join(serves)}"
