"""Work of `torquer theory magneto-gyro`: rows of text and law, polynomials, pictures."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from torquer.analysis.gyro_satellite import craft_of, noise_intensity
from torquer.base.strict_json import json_text
from torquer.cli.commands.theory import GyroModelOptions
from torquer.cli.loading import load_checked
from torquer.cli.options import CodeOptions
from torquer.cli.output import make_writable, writing_to
from torquer.computer.laws.magneto_gyro.law import MagnetoGyro
from torquer.computer.laws.magneto_gyro.stage_2 import Stage2Gains
from torquer.report.common.figure import saved
from torquer.report.theory import magneto_gyro_models as draw
from torquer.scenario.spec import Scenario
from torquer.theory.magneto_gyro import comparison
from torquer.theory.magneto_gyro.accuracy import covariances, revolution_of
from torquer.theory.magneto_gyro.along_orbit import FieldAlong, field_along
from torquer.theory.magneto_gyro.craft import GyroCraft
from torquer.theory.magneto_gyro.frozen import frozen_2
from torquer.theory.magneto_gyro.stage_2 import stage_2_loop

_ABOUT = {12: "stage 1, order 12", 15: "stage 2, order 15"}
_HEAD = (
    "MGS, models with constant coefficients. tau = nu0 t, a prime is d/dtau; axes t', w, s' turn",
    "with the field (cos tau, b, -sin tau). eps: torque over J nu0^2, d: error of the magnetometer",
    "over A. Stage 2: d_i of angles, n_i of rates; X_i, Y_i, Z_i for i = 1, 2 are estimates less",
    "true values.",
)
#: Gains in a chart, factors of the gains in root loci, values of h.
_GRID = 41
_FACTORS = np.geomspace(0.1, 10.0, 81)
_STIFFNESS = np.linspace(-1.0, 10.0, 111)


@dataclass(frozen=True)
class _Case:
    """A scenario's satellite, the field along its orbit, the law's gains and noise of readings."""

    craft: GyroCraft
    along: FieldAlong
    first: comparison.CaptureGains
    gains: Stage2Gains
    form: str
    intensity: float


def show(path: Path | None, how: GyroModelOptions, code: CodeOptions) -> int:
    """Print the models; draw them if a folder is given."""
    if how.out is not None and path is None:
        raise ValueError("--out: must be given with SCENARIO, whose numbers are drawn")
    symbolic = _symbolic()
    case = None if path is None else _case(load_checked(path, code))
    if how.out is not None:
        make_writable(how.out)
    orders = (12, 15) if how.order is None else (how.order,)
    data: dict[str, Any] = {str(order): symbolic.data_of(order) for order in orders}
    if case is not None:
        for order in orders:
            data[str(order)]["numbers"] = _numbers(case, order)
    if case is not None and how.out is not None:
        with writing_to(how.out):
            data["pictures"] = [
                str(saved(figure, how.out / f"{name}.png"))
                for order in orders
                for name, figure in (_first if order == 12 else _second)(case).items()
            ]
    print(json_text(data) if how.json else "\n".join(_lines(data, orders)))
    return 0


def _symbolic():
    """What needs sympy."""
    try:
        from torquer.cli.commands import theory_gyro_rows
    except ImportError:
        raise ValueError(
            "magneto-gyro: needs sympy: pip install 'torquer[symbolic]'; received an installation "
            "without it"
        ) from None
    return theory_gyro_rows


def _case(scenario: Scenario) -> _Case:
    laws = scenario.control.named().laws.values()
    law = next((each for each in laws if isinstance(each, MagnetoGyro)), None)
    if law is None:
        kinds = ", ".join(each.kind for each in laws) or "none"
        raise ValueError(f"control.law: must be magneto_gyro; received {kinds}")
    craft, _ = craft_of(scenario)
    along = field_along(scenario.orbit_environment(), scenario.believed_environment())
    frequency = law.filter_rate_rad_s / craft.orbital_rate_rad_s
    first = comparison.CaptureGains(
        law.capture_angle_gain, law.capture_rate_gain, frequency, law.filter_damping
    )
    intensity = noise_intensity(scenario, craft, along.strength_t)
    return _Case(craft, along, first, law.gains, law.form, intensity)


def _frozen(case: _Case, order: int, factor: float = 1.0) -> np.ndarray:
    """The frozen model of an order, with gains of angles and rates times a factor."""
    (h, i), b, first = case.craft.gyrostat, case.along.normal, case.first
    if order == 15:
        gains = comparison.with_factor(case.gains, factor)
        return frozen_2(gains, stiffness=h, pitch_inertia=i, b=b)
    k, n = (factor * x for x in first[:2])
    return comparison.stage_1_frozen(case.craft, first._replace(angle_gain=k, rate_gain=n), b)


def _degrees(case: _Case, order: int, crafts=None) -> comparison.Degrees:
    """Degrees of satellites, of the case's own if left out."""
    crafts, b = [case.craft] if crafts is None else crafts, case.along.normal
    if order == 15:
        return comparison.stage_2_degrees(crafts, lambda _: case.gains, normal=b, form=case.form)
    h = np.array([craft.stiffness for craft in crafts])
    return comparison.stage_1_degrees(case.craft, case.first, h, b)


def _numbers(case: _Case, order: int) -> dict:
    matrix, degrees = _frozen(case, order), _degrees(case, order)
    roots = sorted(np.linalg.eigvals(matrix).tolist(), key=lambda z: (-z.real, z.imag))
    return {
        "stiffness": case.craft.stiffness,
        "pitch_inertia": case.craft.pitch_inertia,
        "normal": case.along.normal,
        "polynomial": np.poly(matrix).real.tolist(),
        "roots": [[z.real, z.imag] for z in roots],
        "frozen_degree": float(degrees.frozen[0]),
        "degree": float(degrees.exact[0]),
    }


# ------------------------------------------------------------ text


def _lines(data: dict, orders) -> list[str]:
    lines = list(_HEAD)
    for order in orders:
        part = data[str(order)]
        lines += ["", _ABOUT[order]]
        for row in part["rows"]:
            marks = "".join(f" [{number}]" for number in row["corrected"])
            same = f"the same{', corrected' + marks if marks else ''}"
            if row["difference"] != "0":
                same = f"DIFFERS: text less law is {row['difference']}"
            lines += [f"  text  {row['text']}", f"  law   {row['law']}", f"        {same}"]
        lines += [f"  {name} = {value}" for name, value in part["inputs"].items()]
        for number, each in enumerate(part["definitions"], 1):
            lines.append(f"  [{number}] text: {each['text']}; must be: {each['law']}")
        lines.append("  characteristic polynomial for b = 0: product of")
        lines += [f"    {', '.join(x['states'])}: {x['polynomial']}" for x in part["factors"]]
        lines += [f"  {line}" for line in part.get("constant_dipole", ())]
        lines += _number_lines(part["numbers"]) if "numbers" in part else []
    return lines + data.get("pictures", [])


def _number_lines(numbers: dict) -> list[str]:
    roots = [complex(*z) for z in numbers["roots"] if z[1] >= 0.0]
    shown = (f"{z.real:.4g}" + (f" +- {z.imag:.4g} i" if z.imag else "") for z in roots)
    return [
        f"  h = {numbers['stiffness']:.4g}, lambda = {numbers['pitch_inertia']:.4g}, b = "
        f"{numbers['normal']:.4g}",
        "  polynomial, from the highest power: "
        + " ".join(f"{x:.5g}" for x in numbers["polynomial"]),
        f"  roots: {', '.join(shown)}",
        f"  degree of stability per 1/nu0: frozen {numbers['frozen_degree']:.4f}, exact "
        f"{numbers['degree']:.4f}",
    ]


# ------------------------------------------------------------ pictures


def _first(case: _Case) -> dict:
    """Pictures of stage 1."""
    gains = np.geomspace(0.3, 300.0, _GRID)
    k, n = np.meshgrid(gains, gains)
    points = case.first._replace(angle_gain=k, rate_gain=n)
    degrees = comparison.stage_1_degrees(case.craft, points, normal=case.along.normal)
    here, h = case.first[:2], case.craft.stiffness
    title = f"Stage 1: degree of stability per 1/ν₀, h = {h:.3g}"
    return {
        "stage_1_gains": draw.region(title, gains, gains, degrees, here),
        "stage_1_h": _over_h(case, 12, "Stage 1: degree of stability over h"),
        "stage_1_roots": _roots(case, 12, "Stage 1: roots of the frozen model"),
    }


def _second(case: _Case) -> dict:
    """Pictures of stage 2."""
    found = {
        "stage_2_h": _over_h(case, 15, "Stage 2: degree of stability over h, the gains kept"),
        "stage_2_roots": _roots(case, 15, "Stage 2: roots of the frozen model"),
        "stage_2_dipole": _dipole(case),
    }
    if case.intensity > 0.0 and min(*_degrees(case, 15)) > 0.0:
        found["stage_2_noise"] = _noise(case)
    return found


def _over_h(case: _Case, order: int, title: str):
    crafts = [case.craft.with_wheel(case.craft.wheel_at(h)) for h in _STIFFNESS]
    curves = [("", _degrees(case, order, crafts))]
    marks = ((0.0, "0"), (2.0, "2"), (case.craft.stiffness, "here"))
    return draw.over(title, _STIFFNESS, "stiffness h", curves, marks)


def _roots(case: _Case, order: int, title: str):
    followed = comparison.locus([_frozen(case, order, factor) for factor in _FACTORS])
    return draw.roots(title, _FACTORS, followed, "gains of angles and rates times")


def _dipole(case: _Case):
    frequencies = np.geomspace(0.01, 10.0, 400)
    craft, b = case.craft.gyrostat, case.along.normal
    bare = case.gains._replace(e1=0.0, e2=0.0, e3=0.0)
    panels = [
        (words, *(comparison.dipole_response(gains, craft, frequencies, torque, b)
                  for gains in (case.gains, bare)))
        for words, torque in comparison.torque_of_dipole(frequencies, b).items()
    ]  # fmt: skip
    return draw.dipole_response("Stage 2: angles per dipole", frequencies, panels)


def _noise(case: _Case):
    noise = [0.0] * 3 + [case.intensity] * 3
    craft, b = case.craft, case.along.normal
    loop = stage_2_loop(craft.satellite(), craft.gyrostat, case.gains, normal=b, form=case.form)
    exact = np.sqrt(np.einsum("nii->ni", covariances(revolution_of(loop), noise))[:, :3])
    tau = np.linspace(0.0, 2.0 * np.pi, len(exact), endpoint=False)
    frozen = comparison.frozen_covariance(case.gains, craft.gyrostat, noise, b)
    shown = comparison.frozen_error(frozen, tau)
    title = "Stage 2: error under the noise of the magnetometer"
    return draw.errors(title, tau, np.degrees(shown), np.degrees(exact))
