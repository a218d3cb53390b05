"""A mass on a moving belt with stochastic friction: stick-slip motion, its limits, and statistics of its cycles.

    belt = Oscillator(mass_kg=1.0, natural_frequency_rad_per_s=316.0, damping_ratio=0.17,
                      belt_velocity_m_per_s=0.948, normal_force_n=2500.0)
    cycles = simulate(belt, StribeckLaw(0.3), duration_periods=100.0).cycles

- Oscillator, StribeckLaw, CoulombLaw, TableLaw: the system
- simulate, trajectory, ensemble_counts: its motion, with or without scatter, by MotionOptions
- limit_cycle, hopf_damping, existence_limit, grazing_response: the cycle without scatter, its limits, and their shift
- answer: whether it stick-slips with ScatteringFriction, where that ends or begins, and why, by a Sampling of runs
- run_until_known, states_of: when it is in stick-slip and when in steady sliding
- ends_in_stick_slip, basin_share: from which initial states it comes to which of them without scatter
- residence, trough_map, residence_by_theory: how long both last, by long runs and by theory
- reattachment_statistics, count_difference, damping_band: statistics of ensembles

`__init__.pyi` lists all public names and their modules.
"""

from roughslip.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
