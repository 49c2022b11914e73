"""Permanent magnets and hysteresis rods: the published curve, its energy, runs, mistakes."""

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from slow_cases import slow_after

from torquer.analysis.budget import budget_along_run
from torquer.base.conventions import MU_0_H_M
from torquer.compile import engine
from torquer.environment.local import LocalEnvironment
from torquer.scenario.load import ScenarioError, scenario_from_data
from torquer.simulation.lanes.group import Lanes, Pieces, why_not_in_lanes
from torquer.simulation.results.file import load, save
from torquer.simulation.setup.run import prepare
from torquer.simulation.setup.simulate import resume, simulate
from torquer.spacecraft.disturbance.acting import magnets_in
from torquer.spacecraft.disturbance.magnets import (
    HysteresisRods,
    MagnetKeys,
    first_memory,
    magnet_torque,
    remember_field,
    with_rods,
)

ROD = {"axis": [1, 0, 0], "count": 2, "length_m": 0.095, "diameter_m": 1e-3,
       "coercive_a_m": 12.0, "remanence_t": 0.004, "saturation_t": 0.025}  # fmt: skip
VOLUME = 2 * math.pi / 4.0 * 1e-6 * 0.095
ZERO = (0.0, 0.0, 0.0)
compiled = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")


def packed(*rods, dipole=ZERO):
    return MagnetKeys(permanent_magnet_a_m2=dipole, hysteresis_rods=rods).pack_magnets(1)


def field_of(h_a_m, axis=(1.0, 0.0, 0.0)):
    """B [T] of a field along an axis."""
    return tuple((MU_0_H_M * h_a_m * np.array(axis)).tolist())


def fluxes(rod, path_a_m):
    """Flux [T] of a rod from the first field of a path on, and its lags."""
    magnets = packed(rod)
    (row,) = magnets.rods
    memory, out = first_memory(magnets, field_of(path_a_m[0])), []
    for h in path_a_m:
        remember_field(magnets, memory, field_of(h))
        out.append((float(row["dipole_a_m2"])
                    * math.atan(row["steepness_m_a"] * (h - row["coercive_a_m"] * memory[0]["lag"]))
                    * MU_0_H_M / VOLUME, float(memory[0]["lag"])))  # fmt: skip
    return np.array(out).T


# ------------------------------------------------------------------ the curve


def test_greatest_loop_is_that_of_the_limiting_curves():
    """From saturation down: remanence at H = 0, no flux at -Hc; area 4 Hc Bs."""
    way = np.concatenate((np.linspace(0.0, 1e5, 4001), np.linspace(1e5, -1e5, 400_001),
                          np.linspace(-1e5, 1e5, 400_001)))  # fmt: skip
    b, _ = fluxes(ROD, way)
    down, up = slice(4001, 404_002), slice(404_002, None)
    assert np.interp(0.0, -way[down], b[down]) == pytest.approx(ROD["remanence_t"], rel=1e-6)
    assert np.interp(12.0, -way[down], b[down]) == pytest.approx(0.0, abs=1e-8)
    area = np.trapezoid(way[up], b[up]) + np.trapezoid(way[down], b[down])
    # the limiting curves close as 1/H: what is beyond 1e5 A/m is 2 % of nothing
    assert area == pytest.approx(4.0 * 12.0 * 0.025, rel=2e-3)


@pytest.mark.parametrize(("power", "least_slope"), ((2.0, 0.0), (2.0, 0.2), (4.75, 0.0885)))
def test_curve_obeys_the_published_equation(power, least_slope):
    """dB/dH = B' (q + (1 - q) ((H - H_L)/(2 Hc))^p) of the flux itself, by SciPy, along turns."""
    hc, br, bs = (ROD[key] for key in ("coercive_a_m", "remanence_t", "saturation_t"))
    k = math.tan(0.5 * math.pi * br / bs) / hc

    def slope(h, b, sign):
        limiting = 2.0 / math.pi * k * bs * math.cos(0.5 * math.pi * b[0] / bs) ** 2
        from_curve = sign * (h - math.tan(0.5 * math.pi * b[0] / bs) / k) + hc
        part = max(from_curve / (2.0 * hc), 0.0) ** power
        return [limiting * (least_slope + (1.0 - least_slope) * part)]

    turns, b = [0.0, 25.0, -18.0, 7.0, 3.0, 30.0, -30.0], [0.0]
    for h0, h1 in pairwise(turns):
        done = solve_ivp(slope, (h0, h1), [b[-1]], args=(np.sign(h1 - h0),),
                         method="DOP853", rtol=1e-11, atol=1e-15)  # fmt: skip
        b.append(done.y[0, -1])
    found, _ = fluxes(ROD | {"power": power, "least_slope": least_slope}, turns)
    # without a closed form, 8 substeps of RK4 for a leg of up to 60 A/m
    assert found == pytest.approx(np.array(b), abs=1e-12 if power == 2.0 else 3e-5)


def test_flux_does_not_depend_on_how_a_way_is_divided():
    """Rate independent: a way in one leg and in a thousand."""
    once, _ = fluxes(ROD, [3.0, 40.0, -20.0])
    legs = np.concatenate((np.linspace(3.0, 40.0, 1000), np.linspace(40.0, -20.0, 1000)))
    often, _ = fluxes(ROD, legs)
    assert often[-1] == pytest.approx(once[-1], rel=1e-12)


def test_lag_stays_within_the_limiting_curves():
    rng = np.random.default_rng(1)
    for rod in (ROD, ROD | {"power": 1.3, "least_slope": 0.9}, ROD | {"power": 10.0}):
        _, lags = fluxes(rod, np.cumsum(rng.normal(0.0, 30.0, 3000)))
        assert np.abs(lags).max() <= 1.0 and np.ptp(lags) > 1.0


def test_rods_begin_demagnetised():
    """First memory is that of a rod whose field grew from zero, along the first curve."""
    assert fluxes(ROD, [0.0])[0][0] == 0.0
    grown, _ = fluxes(ROD, [0.0, 21.0])
    assert fluxes(ROD, [21.0])[0][0] == pytest.approx(grown[-1], rel=1e-14)
    assert grown[-1] > 0.0


# ------------------------------------------------------------------ torque and energy


def torques_while_turning(magnets, b_t, angles):
    """Torque along axis 3 of a body that turns about it in a field across; fluxes are recorded."""
    memory, out = first_memory(magnets, (b_t, 0.0, 0.0)), []
    for angle in angles:
        b = (b_t * math.cos(angle), -b_t * math.sin(angle), 0.0)
        remember_field(magnets, memory, b)
        here = LocalEnvironment(b, ZERO, (), (), (0.0,))
        out.append(magnet_torque(with_rods(magnets, memory), here, ZERO)[2])
    return np.array(out)


@pytest.mark.parametrize("least_slope", (0.0, 0.3))
def test_work_of_a_turn_is_the_area_of_the_loop(least_slope):
    """What a turning body loses: the volume times the integral of H dB over the closed loop."""
    rod, b_t = ROD | {"least_slope": least_slope}, 3e-5
    angles = np.linspace(0.0, 24.0 * math.pi, 120_001)
    torque = torques_while_turning(packed(rod), b_t, angles)
    last = angles >= 22.0 * math.pi - 1e-9
    work = np.trapezoid(torque[last], angles[last])
    path = b_t / MU_0_H_M * np.cos(angles)
    b, _ = fluxes(rod, path)
    area = np.trapezoid(path[last], b[last])
    assert b[-1] == pytest.approx(b[last][0], rel=1e-9)  # the loop is closed
    assert work == pytest.approx(-VOLUME * area, rel=1e-6) and area > 0.0


def test_torque_does_not_depend_on_the_choice_of_body_axes():
    turn, b = Rotation.from_rotvec([0.3, -1.1, 0.7]), np.array([2e-5, -1e-5, 3e-5])
    fields = [b, 0.7 * b, Rotation.from_rotvec([0.4, 0.1, -0.2]).apply(b)]
    found = []
    for each in (Rotation.identity(), turn):
        rods = [ROD | {"axis": each.apply(axis).tolist()} for axis in ([1, 0, 0], [0, 0.6, 0.8])]
        magnets = packed(*rods, dipole=tuple(each.apply([0.1, 0.2, -0.3]).tolist()))
        memory = first_memory(magnets, each.apply(fields[0]))
        for field in fields:
            b_body = tuple(each.apply(field).tolist())
            remember_field(magnets, memory, b_body)
        here = LocalEnvironment(b_body, ZERO, (), (), (0.0,))
        torque = magnet_torque(with_rods(magnets, memory), here, ZERO)
        found.append(each.inv().apply(torque))
    assert found[1] == pytest.approx(found[0], rel=1e-12)
    assert np.dot(found[0], fields[-1]) == pytest.approx(0.0, abs=1e-20)


# ------------------------------------------------------------------ runs

CRAFT = {"body": {"inertia_kg_m2": [0.00551, 0.02552, 0.02565]}}
RODS = [ROD | {"axis": [0, 1, 0]}, ROD | {"axis": [0, 0, 1]}]
MAGNETS = {"permanent_magnet_a_m2": [0.3, 0, 0], "hysteresis_rods": RODS}


def flight(duration_s=5400.0, craft=None, **keys):
    """A satellite with a magnet and rods, without control."""
    return scenario_from_data({
        "start": "2010-06-01T00:00:00Z",
        "orbit": {"kind": "circular", "altitude_km": 600.0, "inclination_deg": 55.0},
        "environment": {"field": {"kind": "tilted_dipole"}},
        "spacecraft": CRAFT | (MAGNETS if craft is None else craft),
        "initial": {"rate_deg_s": [10.0, 5.0, 5.0], "euler_deg": [20, -30, 50]},
        "control": {"law": {"kind": "off"}, "sample_s": 10.0},
        "simulation": {"duration_s": duration_s, "record_s": 30.0},
    } | keys)  # fmt: skip


def energies(result):
    """Energy of the rotation [J] at the records."""
    omega = result["omega_body"].values
    return 0.5 * np.sum(omega * omega * np.array(CRAFT["body"]["inertia_kg_m2"]), axis=1)


@compiled
def test_a_permanent_magnet_turns_the_body_as_a_residual_dipole_does():
    dipole = [0.3, -0.1, 0.05]
    own = simulate(flight(craft={"permanent_magnet_a_m2": dipole}))
    other = simulate(flight(craft={}, disturbance={"residual_dipole": {"constant_a_m2": dipole}}))
    assert np.array_equal(own["omega_body"].values, other["omega_body"].values)


@compiled
def test_motion_is_that_of_a_naive_twin():
    """The flux of each rod as a state of its own, dB/dt by the published equation, by SciPy."""
    scenario = flight(600.0, craft={"hysteresis_rods": RODS, "hysteresis_step_s": 0.25},
                      environment={"field": {"kind": "tilted_dipole"},
                                   "gravity_gradient": False},
                      simulation={"duration_s": 600.0, "record_s": 10.0})  # fmt: skip
    result, inertia = simulate(scenario), np.array(CRAFT["body"]["inertia_kg_m2"])
    environment = scenario.orbit_environment()
    t = np.linspace(0.0, 600.0, 601)
    from scipy.interpolate import CubicSpline

    field = CubicSpline(t, environment.field(t, *environment.state(t)))
    hc, br, bs = (ROD[key] for key in ("coercive_a_m", "remanence_t", "saturation_t"))
    k = math.tan(0.5 * math.pi * br / bs) / hc

    def rates(t, y):
        q, omega, b = y[:4], y[4:7], y[7:]
        turn = Rotation.from_quat(q)
        here = turn.inv().apply(field(t))
        there = turn.inv().apply(field(t, 1)) - np.cross(omega, here)
        h, h_rate = here[1:] / MU_0_H_M, there[1:] / MU_0_H_M
        limiting = 2.0 / math.pi * k * bs * np.cos(0.5 * math.pi * b / bs) ** 2
        part = (np.sign(h_rate) * (h - np.tan(0.5 * math.pi * b / bs) / k) + hc) / (2.0 * hc)
        m = np.array([0.0, *(VOLUME * b / MU_0_H_M)])
        torque = np.cross(m, here) - np.cross(omega, inertia * omega)
        v, w = q[:3], q[3]
        q_rate = 0.5 * np.array([*(w * omega + np.cross(v, omega)), -v @ omega])
        return np.concatenate((q_rate, torque / inertia, limiting * part**2 * h_rate))

    first = result["q_body_to_inertial"].values[0]
    # the first flux: along the first curve from zero, as test_rods_begin_demagnetised has it
    h0 = Rotation.from_quat(first).inv().apply(field(0.0))[1:] / MU_0_H_M
    b0 = [fluxes(ROD, [h])[0][0] for h in h0]
    start = np.concatenate((first, result["omega_body"].values[0], b0))
    twin = solve_ivp(rates, (0.0, 600.0), start, t_eval=result["time"].values,
                     rtol=1e-8, atol=1e-11, max_step=0.25)  # fmt: skip
    lost, theirs = energies(result), 0.5 * np.sum(twin.y[4:7].T ** 2 * inertia, axis=1)
    changes = np.abs(theirs - theirs[0]).max()
    assert np.abs(lost - theirs).max() < 2e-3 * changes
    assert np.abs(result["omega_body"].values - twin.y[4:7].T).max() < 1e-5


@compiled
def test_a_shorter_interval_of_memory_changes_the_decay_by_little():
    def decay(step_s):
        e = energies(simulate(flight(40_000.0, MAGNETS | {"hysteresis_step_s": step_s})))
        return e[0] - e[-100:].mean()

    usual, half, quarter = decay(1.0), decay(0.5), decay(0.25)
    assert abs(half / usual - 1.0) < 0.01 and abs(quarter / half - 1.0) < 0.01
    assert usual > 0.1 * energies(simulate(flight(60.0)))[0]


@compiled
@pytest.mark.parametrize("simulation", (
    {"integrator": "rk4", "step_s": 0.5}, {"integrator": "splitting", "step_s": 0.5}))  # fmt: skip
def test_integrators_agree(simulation):
    usual = simulate(flight(1800.0))
    other = simulate(flight(1800.0, simulation={"duration_s": 1800.0, "record_s": 30.0,
                                                **simulation}))  # fmt: skip
    apart = np.abs(usual["omega_body"].values - other["omega_body"].values).max()
    changed = np.ptp(usual["omega_body"].values)
    assert apart < 2e-3 * changed


@compiled
def test_a_run_goes_on_bit_for_bit(tmp_path):
    """The rods' memory is in the checkpoint."""
    scenario = flight(1800.0, disturbance={"unmodelled": {"constant_n_m": 1e-8, "hold_s": 100.0}})
    whole, part = simulate(scenario), simulate(scenario, until_s=730.0)
    save(part, tmp_path / "part.nc")
    again = resume(load(tmp_path / "part.nc"))
    for name in ("q_body_to_inertial", "omega_body", "checkpoint"):
        assert np.array_equal(whole[name].values, again[name].values, equal_nan=True), name
    forgotten = prepare(scenario).state
    assert len(forgotten.rods) == 2 and np.all(forgotten.rods["field_a_m"] != 0.0)


@compiled
@pytest.mark.parametrize("coils", slow_after(1, [{"coils": {"limit_a_m2": 0.2}}, {}]))
def test_members_side_by_side_fly_as_alone(coils):
    """From other attitudes: what the rods remember at the start is each member's own.

    Coils that rest change nothing, but the loop over lanes has been compiled for others.
    """
    steps = {"duration_s": 900.0, "record_s": 30.0, "step_s": 0.5}
    scenario = flight(900.0, MAGNETS | coils, simulation=steps)
    turned = [scenario.replace("initial.euler_deg", [8.0 * k, -40, 5.0 * k]) for k in range(20)]
    run = prepare(scenario)
    assert why_not_in_lanes(run) == ""
    moved = np.array([each.motion_at_start() for each in turned])
    lanes = Lanes(run, Pieces(run))
    flown = lanes.fly(lanes.numbers_of(moved), np.arange(20))
    assert not flown.failed.any()
    for row in (0, 7, 16, 19):
        own = prepare(turned[row], piece=run.piece)
        assert not np.array_equal(own.state.rods, run.state.rods)
        assert own.advance_to(own.steps) == 0
        rows = own.rows().rows
        kept = np.column_stack([rows[name] for name in rows.dtype.names[1:8]])
        assert np.array_equal(flown.motion[: len(kept), :, row], kept)


def test_satellites_without_magnets_have_nothing_of_them():
    scenario = flight(craft={})
    assert scenario.acting_torques() == () and scenario.unmodelled_torque() == ()
    disturbed = flight(craft={}, disturbance={"residual_dipole": {"constant_a_m2": [1, 0, 0]}})
    assert magnets_in(disturbed.acting_torques()) == ()
    assert magnets_in(flight().acting_torques()).hold_steps == 1
    slow = flight(craft={"permanent_magnet_a_m2": [0.3, 0, 0]})
    assert magnets_in(slow.acting_torques()).hold_steps > 10**9 and slow.grid_s == 10.0


@compiled
def test_budget_knows_magnets():
    """Along the run: the torque lies across the field, and is that of the magnet and the rods."""
    result = simulate(flight(600.0, simulation={"duration_s": 600.0, "record_s": 1.0}))
    torque = budget_along_run(result).disturbance["magnets"]
    turn = Rotation.from_quat(result["q_body_to_inertial"].values)
    b = turn.inv().apply(result["b_inertial"].values)
    of_magnet = np.cross([0.3, 0.0, 0.0], b)
    assert np.abs(np.sum(torque * b, axis=1)).max() < 1e-18
    rods = np.linalg.norm(torque - of_magnet, axis=1)
    greatest = 2.0 * VOLUME * 0.025 / MU_0_H_M * 5e-5
    assert 0.0 < rods.max() < greatest


# ------------------------------------------------------------------ mistakes


@pytest.mark.parametrize(
    ("changes", "message"),
    (
        ({"volume_m3": 1e-7}, "volume_m3: either it or length_m and diameter_m must be given; "
                              "received both"),
        ({"length_m": None, "diameter_m": None}, "volume_m3: either it or length_m and diameter_m "
                                                 "must be given; received neither"),
        ({"length_m": None}, "length_m: must be given with the other size of the rod"),
        ({"diameter_m": None}, "diameter_m: must be given with the other size of the rod"),
        ({"remanence_t": 0.03}, "remanence_t: must be below saturation_t, 0.025 T; received 0.03"),
        ({"least_slope": 1.0}, "less than 1"),
        ({"count": 0}, "greater than or equal to 1"),
        ({"axis": [0, 0, 0]}, "axis"),
    ),
)  # fmt: skip
def test_mistakes_of_a_rod_are_one_line(changes, message):
    with pytest.raises(ValueError, match=message):
        HysteresisRods(**ROD | changes)


def test_volume_may_be_given():
    given = {key: ROD[key] for key in ROD if key not in ("length_m", "diameter_m")}
    own = HysteresisRods(**given, volume_m3=VOLUME / 2.0)
    assert own.row() == pytest.approx(HysteresisRods(**ROD).row(), rel=1e-14)


@pytest.mark.parametrize(
    ("craft", "simulation", "message"),
    (
        ({"hysteresis_step_s": 1.0}, {},
         "hysteresis_step_s: must be left out without hysteresis_rods; received 1"),
        ({"hysteresis_rods": RODS, "hysteresis_step_s": 0.7}, {"step_s": 0.5},
         "spacecraft.hysteresis_step_s: must be"),
    ),
)  # fmt: skip
def test_mistakes_of_magnets_are_one_line(craft, simulation, message):
    times = {"duration_s": 600.0, "record_s": 30.0} | simulation
    with pytest.raises(ScenarioError, match=message) as raised:
        flight(craft=craft, simulation=times)
    assert len(str(raised.value).splitlines()) <= 2
