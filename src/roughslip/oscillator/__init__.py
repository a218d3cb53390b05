"""A mass on a moving belt with dry friction: stick, slip, cycles and their limits."""
