"""Drift of conserved quantities: what is conserved when, and that a wrong motion shows."""

import numpy as np
import pytest

from torquer import simulate, summarise
from torquer.analysis.conserved import conserved_quantities, relative_drifts
from torquer.compile import engine

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

ADAPTIVE = {"simulation": {"duration_s": 3000.0, "record_s": 10.0}}
FREE = ADAPTIVE | {"environment.gravity_gradient": False}


@pytest.mark.parametrize(
    ("changes", "names"),
    [
        (FREE, {"momentum", "energy"}),
        (FREE | {"spacecraft.body.wheel_momentum_n_m_s": [0.0, 0.1, 0.0]}, {"momentum", "energy"}),
        (ADAPTIVE, {"jacobi_integral"}),
    ],
)
def test_what_is_conserved_drifts_by_rounding(make, changes, names):
    result = simulate(make(changes))
    drifts = relative_drifts(conserved_quantities(result))
    assert set(drifts) == names
    assert 0.0 < max(drifts.values()) < 1e-11
    shown = summarise(result)
    assert {f"{name}_drift": drift for name, drift in drifts.items()}.items() <= shown.items()


@pytest.mark.parametrize(
    "changes",
    [
        {"control.law": {"kind": "bdot", "gain_a_m2_s_per_t": 1e5}},
        {"spacecraft.coils.residual_dipole_a_m2": [0.0, 0.01, 0.0]},
        {"disturbance": {"constant_torque_n_m": [1e-9, 0.0, 0.0]}},
    ],
)
def test_nothing_is_conserved_under_other_torques(make, changes):
    assert conserved_quantities(simulate(make(FREE | changes))) == {}
    assert not any("drift" in key for key in summarise(simulate(make(FREE | changes))))


def test_coarse_steps_show_in_the_drift(make):
    """RK4's error of the energy oscillates with order 4 and grows with order 5."""
    fast = {"initial.rate_deg_s": [5.0, -3.0, 4.0], "environment.gravity_gradient": False}
    losses = [
        relative_drifts(conserved_quantities(simulate(make(fast | {"simulation.step_s": step_s}))))[
            "energy"
        ]
        for step_s in (1.0, 0.5)
    ]
    assert losses[0] > 1e-9
    assert 4.0 < np.log2(losses[0] / losses[1]) < 5.0
