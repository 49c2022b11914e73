"""The whole loop compiles for CUDA: PTX of sm_90, made without a device.

`numba-cuda` recompiles the kernels that the loop calls. What it cannot take is replaced by name in
the rebuilt functions, and stands in `replacements`: nothing else of the loop is CUDA's own.
"""

import ast
import inspect
import math
import textwrap
from types import FunctionType, ModuleType, SimpleNamespace

import numba
import numpy as np
import pytest

from torquer.base import noise
from torquer.compile import engine
from torquer.computer import computer
from torquer.computer.blocks import adapter
from torquer.computer.estimation import RateFromField
from torquer.simulation.loop import computers, record, step
from torquer.simulation.propagate import fixed_steps, interval
from torquer.simulation.setup.run import prepare

pytest.importorskip("numba_cuda", reason="needs the extra 'cuda'")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not engine.COMPILED, reason="compiles by Numba"),
]

from numba import cuda  # noqa: E402  (of numba-cuda, which has been found)
from numba.cuda import compiler, dispatcher, libdevice  # noqa: E402

SM_90 = (9, 0)
BDOT = {"kind": "bdot", "gain_a_m2_s_per_t": 1e6}
#: All sensors with their errors, coils with lag, a measurement window.
PLANT = {
    "spacecraft.coils": {"limit_a_m2": 3.2, "saturation": "clip", "lag_s": 0.5},
    "spacecraft.magnetometer": {"noise_nt": 50.0, "resolution_nt": 8.0, "sample_s": 1.0,
                                "delay_s": 0.5},
    "spacecraft.gyro": {"noise_deg_s": 0.01, "bias_drift_deg_s_sqrt_s": 0.001},
    "spacecraft.sun_sensors": {"axes": [[1, 0, 0]], "half_field_deg": 60.0, "noise_deg": 0.5},
    "spacecraft.attitude_sensor": {"noise_deg": 0.1},
    "simulation.step_s": 0.5,
}  # fmt: skip
MODES = {
    "control.law": None,
    "control.laws": {"strong": BDOT, "weak": BDOT | {"gain_a_m2_s_per_t": 1e5}},
    "control.estimator": {"kind": "rate_from_field"},
    "control.modes.regions": {
        "damping": {
            "states": {
                "fast": {
                    "laws": ["strong"],
                    "transitions": [
                        {"to": "slow", "when": {"signal": "rate_deg_s", "below": 0.5}, "for_s": 60}
                    ],
                },
                "slow": {
                    "laws": ["weak"],
                    "transitions": [{"to": "fast", "when": {"signal": "rate_deg_s", "above": 1.0}}],
                },
            }
        },
        "actuators": {
            "states": {
                "on": {
                    "transitions": [
                        {"to": "off", "when": {"signal": "sunlit_fraction", "below": 0.5}}
                    ]
                },
                "off": {
                    "coils": "off",
                    "transitions": [
                        {"to": "on", "when": {"signal": "sunlit_fraction", "above": 0.5}}
                    ],
                },
            }
        },
    },
}
WHEELS = {
    "spacecraft.wheels": {
        "layout": {"kind": "regular_pyramid", "count": 4, "gamma_deg": 54.7},
        "momentum_limit_n_m_s": 1.0,
        "torque_limit_n_m": 0.02,
        "coulomb_friction_n_m": 5e-4,
        "stiction_n_m": 1e-3,
        "speed_noise_rpm": 1.0,
    }
}


@cuda.jit(device=True)
def unchanged(value):
    """In place of `without_reference_counts`: on a device nothing is counted."""
    return value


@cuda.jit(device=True)
def sign(x):
    """In place of `np.sign`: CUDA's table of ufuncs has neither it nor `np.floor`."""
    return math.copysign(1.0, x) if x != 0.0 else x


@cuda.jit(device=True)
def floor(x):
    """In place of `np.floor`."""
    return libdevice.floor(x)


@cuda.jit(device=True)
def bits_of(number):
    """In place of the intrinsic of the same name."""
    return np.uint64(libdevice.double_as_longlong(number))


@cuda.jit(device=True)
def float_of(bits):
    """In place of the intrinsic of the same name."""
    return libdevice.longlong_as_double(np.int64(bits))


def module_of(name, **parts):
    """A module of these parts."""
    module = ModuleType(name)
    vars(module).update(parts)
    return module


def scalar_numpy():
    """NumPy for kernels on numbers, in place of `np`."""
    kept = {name: getattr(np, name) for name in ("nan", "inf", "pi", "uint64", "int64")}
    return module_of("np", floor=floor, sign=sign, **kept)


def device_function(function):
    """A plain function of the loop as one that `rebuilt` takes."""
    return SimpleNamespace(py_func=function)


class OneMember(ast.NodeTransformer):
    """Calls phases for the one member: CUDA's functions take no `*arguments`."""

    def visit_Call(self, node):
        self.generic_visit(node)
        name = getattr(node.func, "id", "")
        if name not in ("each", "must_stop", "first_member"):
            return node
        member = ast.Attribute(node.args[0], "member", ast.Load())
        if name == "first_member":
            return member
        skipped = 4 if name == "must_stop" else 2
        call = ast.Call(node.args[1], [member, *node.args[skipped:]], [])
        return ast.UnaryOp(ast.Not(), call) if name == "must_stop" else call


def for_one_member(plain, names):
    """A plain function of these globals, which calls phases for the one member."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(plain)))
    function = tree.body[0]
    function.decorator_list = []
    made = compile(ast.fix_missing_locations(OneMember().visit(tree)), plain.__name__, "exec")
    exec(made, names)
    return names[function.name]


def rebuilt(function, instead, known):
    """A kernel and all kernels that it calls by name, with the replacements among its globals."""
    plain = function.py_func
    if plain not in known:
        names = dict(plain.__globals__)
        copy = for_one_member(plain, names)
        known[plain] = cuda.jit(copy, device=True)
        for name in set(copy.__code__.co_names) & names.keys():
            if name in instead:
                names[name] = instead[name]
            elif hasattr(names[name], "py_func") and not names[name].py_func.__closure__:
                names[name] = rebuilt(names[name], instead, known)
    return known[plain]


def called_directly(block):
    """A law or an estimator behind its adapter, in place of the call by address."""
    names = adapter.memory_names(block.memory)
    parts = {
        "_function": block.function,
        "_inputs": adapter._first_record,
        "_unify": block.kind.unify,
        "_named": adapter.record_maker(adapter.Shape(block.parameters)),
        "_cells": adapter._memory_view(names),
    }
    answer = cuda.jit(FunctionType(adapter._plain_adapter.__code__, parts), device=True)

    @cuda.jit(device=True)
    def call(address, records, parameters, memory):
        return answer(records, parameters, memory)

    return call


def replacements(run):
    """All that CUDA cannot take as it is, by the names that the kernels use."""
    law = next(iter(run.blocks.laws.values()))
    plain = {
        "record_at": unchanged,
        "whole": unchanged,
        "without_reference_counts": unchanged,
        "np": scalar_numpy(),
        "float_bits": bits_of,
        "bits_float": float_of,
    }
    plain["normal3"] = rebuilt(noise.normal3, plain, {})
    plain["noise"] = module_of("noise", normal3=plain["normal3"])
    known = {}
    by_rk4 = rebuilt(fixed_steps.by_rk4, plain, known)

    @cuda.jit(device=True)
    def steps_by(integrator, forces, cells, x, local, first, last, h):
        return by_rk4(forces, x, local, first, last, h)

    plain["steps_by"] = steps_by
    plain["advance"] = rebuilt(device_function(interval.advance), plain, known)
    plain["is_too_coarse"] = rebuilt(interval._rk4_is_too_coarse, plain, known)
    go_on = rebuilt(device_function(interval._propagate), plain, known)

    @cuda.jit(device=True)
    def call_propagate(function, problem, step, until, look):
        return go_on(problem, step, until, look)

    drive = rebuilt(device_function(step._drive_wheels), plain, known)

    @cuda.jit(device=True)
    def call_drive_wheels(function, loop, hold_steps, step):
        return drive(loop, hold_steps, step)

    switch_modes = rebuilt(computer.switch_modes, plain, known)

    @cuda.jit(device=True)
    def call_switch(address, table, state, known):
        return switch_modes(table, state, known[0])

    @cuda.jit(device=True)
    def call_host(address, number):
        pass

    plain |= {
        "call_propagate": call_propagate,
        "_call_drive_wheels": call_drive_wheels,
        "call_switch": call_switch,
        "call_host": call_host,
        "call_law": called_directly(law),
        "call_estimator": called_directly(RateFromField().estimator()),
    }
    for function in (
        computers.compute,
        computers.restart_computers,
        computers.estimate_for_outside,
        record.record_members,
    ):
        plain[function.__name__] = rebuilt(device_function(function), plain, known)
    return plain


@pytest.fixture
def no_device(monkeypatch):
    """Compile for a device that is not there."""
    device = SimpleNamespace(compute_capability=SM_90)
    for module in (compiler, dispatcher):
        monkeypatch.setattr(module, "get_current_device", lambda: device)


def ptx_of_loop(run):
    """PTX of a kernel that runs the loop of a prepared run."""
    loop = rebuilt(device_function(step._run_steps), replacements(run), {})
    ready = run._made_ready()
    # what has an address on the host is handed over itself
    arguments = ready.loop.record._replace(
        plan=run.plan._replace(computer=run.plan.computer._replace(host=0)),
        problem=ready.problem.record,
    )

    def one_run(arguments, last, ended):
        ended[0] = loop(arguments, last)

    types = tuple(map(numba.typeof, (arguments, run.steps, np.zeros(1, np.int64))))
    ptx, _ = cuda.compile(one_run, types, device=False, cc=SM_90, output="ptx", abi="numba")
    return ptx


@pytest.mark.parametrize("changes", [{}, MODES, WHEELS], ids=["bdot", "modes", "wheels"])
def test_the_loop_compiles_to_ptx_that_calls_nothing_outside(make, no_device, changes, tmp_path):
    """Neither an allocation nor a function of the host is left: all of it is in the PTX."""
    ptx = ptx_of_loop(prepare(make(PLANT | {"control.law": BDOT} | changes)))
    assert ".target sm_90" in ptx
    assert ".visible .entry" in ptx
    assert ".extern" not in ptx
