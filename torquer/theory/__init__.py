"""Closed-form and averaged theory: gains, slow motion under a law, stability, wheels' momentum.

    from torquer.theory import Spinner, bdot_gain, chart, evolve

- *A law in short*: averaged motion, times and gains, from a few numbers or a scenario
  (`law_motion`, `law_gains`), as `torquer theory` prints them.
- *Gains* of B-dot from the damping time, and within what sampling and lag allow.
- *Slow motion* of an axisymmetric satellite under a law: closed averaged equations
  (`torquer.theory.slow.evolution`), the average of any law, maps, equilibria, the full motion.
- *Stability* of linear periodic systems: monodromy matrices, charts; of a rotation along the
  Sun's line under S-dot.
- *Three axes by coils alone*: averaged, exact and sampled stability of an attitude that a law
  holds, gain design with margins and pointing error, periodic regulator
  (`torquer.theory.three_axis`).
- *Magnetometer, coils and a pitch wheel*: frozen and exact models of the magneto-gyroscopic
  system, its error and its gains (`torquer.theory.magneto_gyro`).
- *Small-parameter method*: forced periodic motion.
- *Momentum* that wheels take up while a satellite keeps its attitude.
- *Formulas*: a law's averaged equations, derived symbolically, in LaTeX.

Beyond the range of a theory a function raises ValueError, or the result's `notes` state what is
doubtful.
"""

from typing import TYPE_CHECKING

from torquer.base.lazy import lazily

if TYPE_CHECKING:
    from torquer.theory.averaged.answer import (
        LawGains as LawGains,
        LawMotion as LawMotion,
        law_gains as law_gains,
        law_motion as law_motion,
    )
    from torquer.theory.averaged.latex import law_latex as law_latex
    from torquer.theory.averaged.requests import LawRequest as LawRequest
    from torquer.theory.magneto_gyro.accuracy import (
        follow_revolution as follow_revolution,
        noise_error as noise_error,
        steady_motion as steady_motion,
    )
    from torquer.theory.magneto_gyro.along_orbit import (
        FieldAlong as FieldAlong,
        field_along as field_along,
        model_error as model_error,
    )
    from torquer.theory.magneto_gyro.capture import (
        Stage1Design as Stage1Design,
        design_stage_1 as design_stage_1,
    )
    from torquer.theory.magneto_gyro.comparison import (
        CaptureGains as CaptureGains,
        dipole_response as dipole_response,
        frozen_covariance as frozen_covariance,
        frozen_error as frozen_error,
        locus as locus,
        stage_1_degrees as stage_1_degrees,
        stage_2_degrees as stage_2_degrees,
    )
    from torquer.theory.magneto_gyro.craft import (
        GyroCraft as GyroCraft,
        greatest_tip_off as greatest_tip_off,
    )
    from torquer.theory.magneto_gyro.day import (
        DayLoop as DayLoop,
        degree_map as degree_map,
        degree_over_a_day as degree_over_a_day,
        stable_range as stable_range,
    )
    from torquer.theory.magneto_gyro.frozen import (
        frozen_1 as frozen_1,
        frozen_1_inputs as frozen_1_inputs,
        frozen_2 as frozen_2,
        frozen_2_inputs as frozen_2_inputs,
    )
    from torquer.theory.magneto_gyro.models import (
        GyroModels as GyroModels,
        gyro_models as gyro_models,
    )
    from torquer.theory.magneto_gyro.requests import GyroModelsRequest as GyroModelsRequest
    from torquer.theory.magneto_gyro.stage_1 import STAGE_1 as STAGE_1
    from torquer.theory.magneto_gyro.stage_2 import stage_2_loop as stage_2_loop
    from torquer.theory.magneto_gyro.stage_2_gains import (
        Stage2Design as Stage2Design,
        Stage2Weights as Stage2Weights,
        design_stage_2 as design_stage_2,
        stage_2_gains as stage_2_gains,
    )
    from torquer.theory.magneto_gyro.times import (
        Hysteresis as Hysteresis,
        TimeToPoint as TimeToPoint,
        time_to_point as time_to_point,
    )
    from torquer.theory.magneto_gyro.wheel_choice import (
        BetterWheel as BetterWheel,
        better_wheel as better_wheel,
        over_stiffness as over_stiffness,
    )
    from torquer.theory.periodic.floquet import (
        Transitions as Transitions,
        chart as chart,
        degree_of_stability as degree_of_stability,
        exponents as exponents,
        monodromy as monodromy,
        multipliers as multipliers,
        transitions as transitions,
    )
    from torquer.theory.periodic.periodic_systems import (
        PeriodicSystem as PeriodicSystem,
        periodic_system as periodic_system,
    )
    from torquer.theory.periodic.poincare import (
        Resonance as Resonance,
        Response as Response,
        departure as departure,
        forced_response as forced_response,
        periodic_motion as periodic_motion,
        remainder as remainder,
        small_parameter as small_parameter,
    )
    from torquer.theory.slow.averaging import (
        averaged_motion as averaged_motion,
        averaged_rates as averaged_rates,
        converged_nodes as converged_nodes,
    )
    from torquer.theory.slow.comparison import (
        AveragingComparison as AveragingComparison,
        compare as compare,
        resonances as resonances,
    )
    from torquer.theory.slow.detumbling import (
        Tumbling as Tumbling,
        braking_torque_n_m as braking_torque_n_m,
        detumbling_time_s as detumbling_time_s,
        knee_gain as knee_gain,
        turning_gain as turning_gain,
    )
    from torquer.theory.slow.equilibria import (
        Equilibrium as Equilibrium,
        evolution_rates as evolution_rates,
        find_equilibria as find_equilibria,
        law_rates as law_rates,
        tends_to as tends_to,
    )
    from torquer.theory.slow.evolution import EVOLUTIONS as EVOLUTIONS
    from torquer.theory.slow.evolution.model import (
        Case as Case,
        Evolution as Evolution,
        Slow as Slow,
    )
    from torquer.theory.slow.full_motion import (
        Fast as Fast,
        by_euler as by_euler,
        full_state as full_state,
        osculating as osculating,
        slow_variables as slow_variables,
    )
    from torquer.theory.slow.gain_and_time import (
        design_table as design_table,
        gain_at as gain_at,
        gain_for as gain_for,
        slow_time as slow_time,
        times_over_directions as times_over_directions,
    )
    from torquer.theory.slow.gains import (
        Sampling as Sampling,
        bdot_gain as bdot_gain,
        bdot_greatest_gain as bdot_greatest_gain,
        damped_share as damped_share,
        damping_efficiency as damping_efficiency,
        driven_rate_rad_s as driven_rate_rad_s,
        sampling_limit_rad_s as sampling_limit_rad_s,
        saturated_damping_time_s as saturated_damping_time_s,
    )
    from torquer.theory.slow.orbit_field import OrbitField as OrbitField
    from torquer.theory.slow.second_moments import (
        averaged_moments as averaged_moments,
        closed_moments as closed_moments,
        direct_dipole_moments as direct_dipole_moments,
        tilted_dipole_moments as tilted_dipole_moments,
    )
    from torquer.theory.slow.slow_loop import cycle_map as cycle_map, greatest_step as greatest_step
    from torquer.theory.slow.slow_motion import (
        evolve as evolve,
        evolve_law as evolve_law,
        map_evolution as map_evolution,
        map_law as map_law,
    )
    from torquer.theory.slow.slow_result import SlowMotion as SlowMotion, drifts as drifts
    from torquer.theory.slow.spinner import Spinner as Spinner
    from torquer.theory.slow.sun_spin import (
        AxisEquilibrium as AxisEquilibrium,
        Decay as Decay,
        axis_equilibria as axis_equilibria,
        mean_decay as mean_decay,
        mean_matrix as mean_matrix,
        nearly_axisymmetric_rates as nearly_axisymmetric_rates,
        stable_axes as stable_axes,
        sun_spin_system as sun_spin_system,
    )
    from torquer.theory.slow.wheel_accumulation import (
        Growth as Growth,
        Held as Held,
        air_torque as air_torque,
        cyclic_bounds as cyclic_bounds,
        held_torque as held_torque,
        momentum_growth as momentum_growth,
        momentum_under as momentum_under,
        orbital_axes as orbital_axes,
        saturation_time as saturation_time,
    )
    from torquer.theory.symbolic import (
        as_latex as as_latex,
        averaged_equations as averaged_equations,
    )
    from torquer.theory.three_axis.averaged import (
        averaged_degree as averaged_degree,
        channel_exponents as channel_exponents,
        channel_factors as channel_factors,
        mean_damping as mean_damping,
        mean_projection as mean_projection,
        plateau_edge as plateau_edge,
    )
    from torquer.theory.three_axis.feedback import (
        best_feedback as best_feedback,
        feedback_law as feedback_law,
        lqr_law as lqr_law,
    )
    from torquer.theory.three_axis.floquet import (
        exact_stability as exact_stability,
        stability_chart as stability_chart,
    )
    from torquer.theory.three_axis.gain_search import (
        DesignTask as DesignTask,
        ThreeAxisDesign as ThreeAxisDesign,
        assess as assess,
        coarser as coarser,
        design_gains as design_gains,
    )
    from torquer.theory.three_axis.hold import AttitudeHold as AttitudeHold
    from torquer.theory.three_axis.margins import (
        Margins as Margins,
        best_factors as best_factors,
        degrees_with_margin as degrees_with_margin,
        find_margins as find_margins,
        mixed_family as mixed_family,
    )
    from torquer.theory.three_axis.periodic_lqr import (
        PeriodicLqr as PeriodicLqr,
        Weights as Weights,
        periodic_lqr as periodic_lqr,
    )
    from torquer.theory.three_axis.response import (
        Noise as Noise,
        Offsets as Offsets,
        PointingError as PointingError,
        pointing_error as pointing_error,
    )
    from torquer.theory.three_axis.sampled import (
        Cycle as Cycle,
        SampledHold as SampledHold,
        sampled_family as sampled_family,
    )
    from torquer.theory.three_axis.trim import TrimDesign as TrimDesign, design_trim as design_trim
    from torquer.theory.validity import Limit as Limit, within as within

__getattr__, __dir__, __all__ = lazily(__name__, __file__)
