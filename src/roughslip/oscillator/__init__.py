"""A mass on a moving belt with stochastic friction: stick-slip motion, its limits, and statistics of its cycles.

    belt = Oscillator(mass_kg=1.0, natural_frequency_rad_per_s=316.0, damping_ratio=0.17,
                      belt_velocity_m_per_s=0.948, normal_force_n=2500.0)
    cycles = simulate(belt, StribeckLaw(0.3), duration_periods=100.0).cycles

- Oscillator, StribeckLaw, CoulombLaw, TableLaw, friction_law: mass on the belt, and friction against sliding speed;
  MemoryLaw: friction that ages at rest, with its limits critical_stiffness and growth_rates
- simulate, trajectory: its motion, with or without scatter, by MotionOptions
- limit_cycle, equilibrium, hopf_damping, existence_limit: the cycle without scatter, and its limits
- Machine: both with the friction that scatters, `changed` in any parameter; ensemble: many of its motions
- grazing_response, durations_by_theory: how scatter moves the limit, and how long stick-slip and sliding last
- answer: whether it stick-slips, where that ends or begins, and why, by runs
- uncertainty_budget: how sure that is, and which uncertain input decides it
- attractors_of: where it ends without scatter, in stick-slip, in a vibration without sticking or in steady sliding
- run_until_known, states_of, durations: when it is in stick-slip and when it slides, and how long
- reattachment_statistics, count_difference: statistics of ensembles

`__init__.pyi` lists all public names and their modules.
"""

from roughslip.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
