# ruff: noqa: F401 (the imports under TYPE_CHECKING are the list of public names)
"""Closed-form and averaged theory: gains, slow motion under a law, stability, wheels' momentum.

    from torquer.theory import Spinner, bdot_gain, chart, evolve

- *Gains* of B-dot from the damping time, and within what sampling and lag allow.
- *Slow motion* of an axisymmetric satellite under a law: closed averaged equations
  (`torquer.theory.evolution`), the average of any law, maps, equilibria, the full motion beside.
- *Stability* of linear periodic systems: monodromy matrices, charts, Mathieu's equation.
- *Small-parameter method*: forced periodic motion; a satellite with a pitch wheel, or that the
  gravity gradient holds upright, or with a permanent magnet.
- *Momentum* that wheels take up while a satellite keeps its attitude.
- *Formulas*: a law's averaged equations, derived symbolically, in LaTeX.

Numbers beyond the range of a theory are refused, or the result's `notes` say what is doubtful.
"""

from typing import TYPE_CHECKING

from torquer.lazy import lazily

if TYPE_CHECKING:
    from torquer.theory.averaging import averaged_motion, averaged_rates, converged_nodes
    from torquer.theory.comparison import Comparison, compare, fitted_order, resonances
    from torquer.theory.design import (
        design_table,
        gain_for,
        gain_of,
        slow_time,
        times_over_directions,
    )
    from torquer.theory.equilibria import (
        Equilibrium,
        find_equilibria,
        rates_of_evolution,
        rates_of_law,
        tends_to,
    )
    from torquer.theory.evolution import EVOLUTIONS
    from torquer.theory.evolution.model import Case, Evolution, Slow
    from torquer.theory.first_integrals import drifts
    from torquer.theory.floquet import (
        Transitions,
        chart,
        degree_of_stability,
        exponents,
        monodromy,
        multipliers,
        transitions,
    )
    from torquer.theory.full_motion import Fast, by_euler, osculating, slow_of, state_of
    from torquer.theory.gains import (
        Sampling,
        bdot_gain,
        bdot_greatest_gain,
        damped_share,
        damping_efficiency,
        driven_rate_rad_s,
        sampling_limit_rad_s,
        saturated_damping_time_s,
    )
    from torquer.theory.mathieu import (
        Edges,
        characteristic_values,
        edges,
        first_tongue,
        first_tongue_of_strength,
        first_tongue_solutions,
        half_trace,
        half_trace_series,
        hill_equation,
        mathieu_equation,
        mathieu_parameters,
        multipliers_from_half_trace,
    )
    from torquer.theory.orbit_field import OrbitField
    from torquer.theory.periodic_systems import PeriodicSystem, periodic_system
    from torquer.theory.pitch_wheel import (
        PitchWheel,
        pitch_offset_averaged_polar,
        pitch_offset_direct_dipole,
        pitch_wheel_response,
    )
    from torquer.theory.planar_magnet import (
        PlanarMagnet,
        along_field,
        closed_tongue,
        dipole_direction,
        motion_edges,
        pitch_acceleration,
        tongue_edges,
        tracking_half_trace,
        tracking_motion,
        uniform_rotation,
    )
    from torquer.theory.poincare import (
        Resonance,
        Response,
        departure,
        forced_response,
        periodic_motion,
        remainder,
        small_parameter,
    )
    from torquer.theory.second_moments import (
        averaged_moments,
        closed_moments,
        direct_dipole_moments,
        moments_by_quadrature,
        tilted_dipole_moments,
    )
    from torquer.theory.slow_loop import cycle_map, greatest_step
    from torquer.theory.slow_motion import evolve, evolve_law, map_of_evolution, map_of_law
    from torquer.theory.slow_result import SlowMotion
    from torquer.theory.spinner import Spinner
    from torquer.theory.steady_bdot import (
        SteadyBdot,
        mean_offset,
        motion_from_rest,
        published_offset,
        published_swing,
        steady_bdot_response,
    )
    from torquer.theory.symbolic import as_latex, averaged_equations
    from torquer.theory.validity import Limit, within
    from torquer.theory.wheel_accumulation import (
        Growth,
        Held,
        air_torque,
        cyclic_bounds,
        growth_of,
        held_torque,
        momentum_under,
        orbital_axes,
        saturation_time,
    )

__getattr__, __dir__, __all__ = lazily(__name__, __file__)
