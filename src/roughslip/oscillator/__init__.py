"""A mass on a moving belt with stochastic friction: stick-slip motion, its limits, and statistics of its cycles.

    from roughslip.oscillator import equation, motion
    from roughslip.oscillator.friction_laws import stribeck

    belt = equation.Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0)
    cycles = motion.simulate(belt, stribeck.StribeckLaw(0.3), None, 0.0, 100.0).cycles

equation : Oscillator, and the scaled equation of motion
friction_law, friction_laws, laws : FrictionLaw, a module for each law, and LAWS by name
motion : simulate, trajectory, ensemble_counts with MotionOptions; Motion, Trajectory, Counts
limits : equilibrium, hopf_damping, limit_cycle, existence_limit, counts_by_period
grazing : grazing_response, the effect of noise on the existence limit
cycles : count_difference, reattachment_statistics, normality
survival : spells, mean_lifetime, surviving_share, damping_band
path : KeptPath; interpolation of mu_S

Compiled parts: event_loop alternates stick and slip, switching_events ends steps where the equation changes,
runge_kutta holds the integrators, dense_output the motion between the ends of a step. The package imports nothing by
itself, so that a stage depends only on the modules that it names.
"""

__all__ = [
    "cycles",
    "equation",
    "friction_law",
    "friction_laws",
    "grazing",
    "laws",
    "limits",
    "motion",
    "path",
    "survival",
]
