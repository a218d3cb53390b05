"""A mass on a moving belt with stochastic friction: stick-slip motion, its limits, and statistics of its cycles.

    belt = equation.Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0)
    cycles = motion.simulate(belt, friction_laws.stribeck.StribeckLaw(0.3), None, 0.0, 100.0).cycles

For users: equation, laws, motion, limits, grazing, cycles, survival, path. The package imports nothing by itself, so
that a stage depends only on the modules that it names.
"""
