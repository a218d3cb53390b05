"""Scene files: types, overlays, rules across keys, targets."""
