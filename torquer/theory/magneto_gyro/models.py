"""The models with constant coefficients, text against law, with the numbers of a scenario."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from torquer.base.rows import Row, as_data, as_html
from torquer.computer.laws.magneto_gyro.law import MagnetoGyro
from torquer.computer.laws.magneto_gyro.stage_2 import Stage2Gains
from torquer.scenario.spec import Scenario
from torquer.theory.magneto_gyro import comparison
from torquer.theory.magneto_gyro.along_orbit import FieldAlong, field_along
from torquer.theory.magneto_gyro.craft import GyroCraft
from torquer.theory.magneto_gyro.frozen import frozen_2
from torquer.theory.magneto_gyro.requests import GyroModelsRequest
from torquer.theory.magneto_gyro.satellite import make_craft, noise_intensity

_ABOUT = {12: "stage 1, order 12", 15: "stage 2, order 15"}
_HEAD = (
    "MGS, models with constant coefficients. tau = nu0 t, a prime is d/dtau; axes t', w, s' turn",
    "with the field (cos tau, b, -sin tau). eps: torque over J nu0^2, d: error of the magnetometer",
    "over A. Stage 2: d_i of angles, n_i of rates; X_i, Y_i, Z_i for i = 1, 2 are estimates less",
    "true values.",
)


@dataclass(frozen=True)
class GyroModelCase:
    """A scenario's satellite, the field along its orbit, the law's gains and noise of readings."""

    craft: GyroCraft
    along: FieldAlong
    first: comparison.CaptureGains
    gains: Stage2Gains
    form: str
    intensity: float

    def frozen(self, order: int, factor: float = 1.0) -> np.ndarray:
        """The frozen model of an order, with gains of angles and rates times a factor."""
        (h, i), b, first = self.craft.gyrostat, self.along.normal, self.first
        if order == 15:
            gains = comparison.with_factor(self.gains, factor)
            return frozen_2(gains, stiffness=h, pitch_inertia=i, b=b)
        k, n = (factor * x for x in first[:2])
        first = first._replace(angle_gain=k, rate_gain=n)
        return comparison.stage_1_frozen(self.craft, first, b)

    def degrees(self, order: int, crafts=None) -> comparison.Degrees:
        """Degrees of satellites, of the case's own if left out."""
        crafts, b = [self.craft] if crafts is None else crafts, self.along.normal
        if order == 15:
            form = self.form
            return comparison.stage_2_degrees(crafts, lambda _: self.gains, normal=b, form=form)
        h = np.array([craft.stiffness for craft in crafts])
        return comparison.stage_1_degrees(self.craft, self.first, h, b)

    def rows(self, order: int) -> list[Row]:
        """Numbers of a model: parameters, polynomial, roots, degrees per 1/nu0."""
        matrix, degrees = self.frozen(order), self.degrees(order)
        roots = sorted(np.linalg.eigvals(matrix).tolist(), key=lambda z: (-z.real, z.imag))
        polynomial = np.poly(matrix).real.tolist()
        frozen, exact = float(degrees.frozen[0]), float(degrees.exact[0])
        parameters = (
            ("stiffness", "h", self.craft.stiffness),
            ("pitch_inertia", "lambda", self.craft.pitch_inertia),
            ("normal", "b", self.along.normal),
        )
        return [
            *(Row(key, label, x, "", f"{x:.4g}") for key, label, x in parameters),
            Row("polynomial", "polynomial, from the highest power", polynomial, "",
                " ".join(f"{x:.5g}" for x in polynomial)),
            Row("roots", "roots", [[z.real, z.imag] for z in roots], "", _roots_text(roots)),
            Row("frozen_degree", "frozen", frozen, "nu0", f"{frozen:.4f}"),
            Row("degree", "exact", exact, "nu0", f"{exact:.4f}"),
        ]  # fmt: skip


def _roots_text(roots: list[complex]) -> str:
    upper = (z for z in roots if z.imag >= 0.0)
    return ", ".join(f"{z.real:.4g}" + (f" +- {z.imag:.4g} i" if z.imag else "") for z in upper)


@dataclass(frozen=True)
class GyroModels:
    """The models by order: symbols as text, and rows of numbers if a scenario gives them."""

    symbols: dict[int, dict]
    numbers: dict[int, list[Row]]
    case: GyroModelCase | None = None

    def data(self) -> dict:
        """Plain data: rows of text and law, factors of the polynomials, numbers; by order."""
        numbers = {order: {"numbers": as_data(rows)} for order, rows in self.numbers.items()}
        return {str(k): part | numbers.get(k, {}) for k, part in self.symbols.items()}

    def lines(self) -> list[str]:
        """Text: the rows of each model, then its numbers."""
        lines = list(_HEAD)
        for order, part in self.symbols.items():
            lines += ["", _ABOUT[order], *_symbol_lines(part)]
            lines += _number_lines(self.numbers[order]) if order in self.numbers else []
        return lines

    def _repr_html_(self) -> str:
        """In notebooks: numbers in a row for each model, rows of text and law below them."""
        models = [[Row("", "model", text=_ABOUT[k]), *rows] for k, rows in self.numbers.items()]
        return as_html(models or [[Row("", "models", text=_HEAD[0])]], self.lines()[4:])


def gyro_models(
    scenario: Scenario | None = None, asked: GyroModelsRequest | None = None
) -> GyroModels:
    """Models of the magneto-gyroscopic system with constant coefficients, text against law.

        from torquer.theory import GyroModelsRequest, gyro_models
        gyro_models(torquer.load_scenario("magneto_gyro.toml"), GyroModelsRequest(order=15))

    With a scenario, whose law is magneto_gyro: its numbers, and the degree of the exact model in
    the field of a dipole. Needs sympy. `ValueError` for a scenario with another law.
    """
    order = None if asked is None else asked.order
    orders = (12, 15) if order is None else (order,)
    model_data = _symbolic_models()
    case = None if scenario is None else _case(scenario)
    symbols = {each: model_data(each) for each in orders}
    numbers = {} if case is None else {each: case.rows(each) for each in orders}
    return GyroModels(symbols, numbers, case)


def _symbolic_models() -> Callable[[int], dict]:
    """What needs sympy."""
    try:
        from torquer.theory.magneto_gyro.model_rows import model_data
    except ImportError:
        raise ValueError(
            "magneto-gyro: needs sympy: pip install 'torquer[symbolic]'; received an installation "
            "without it"
        ) from None
    return model_data


def _case(scenario: Scenario) -> GyroModelCase:
    laws = scenario.control.named().laws.values()
    law = next((each for each in laws if isinstance(each, MagnetoGyro)), None)
    if law is None:
        kinds = ", ".join(each.kind for each in laws) or "none"
        raise ValueError(f"control.law: must be magneto_gyro; received {kinds}")
    craft, _ = make_craft(scenario)
    along = field_along(scenario.orbit_environment(), scenario.believed_environment())
    frequency = law.filter_rate_rad_s / craft.orbital_rate_rad_s
    first = comparison.CaptureGains(
        law.capture_angle_gain, law.capture_rate_gain, frequency, law.filter_damping
    )
    intensity = noise_intensity(scenario, craft, along.strength_t)
    return GyroModelCase(craft, along, first, law.gains, law.form, intensity)


def _symbol_lines(part: dict) -> list[str]:
    lines = []
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
    return lines + [f"  {line}" for line in part.get("constant_dipole", ())]


def _number_lines(rows: list[Row]) -> list[str]:
    *parameters, polynomial, roots, frozen, exact = rows
    return [
        "  " + ", ".join(f"{row.label} = {row.text}" for row in parameters),
        *(f"  {row.label}: {row.text}" for row in (polynomial, roots)),
        "  degree of stability per 1/nu0: "
        + ", ".join(f"{row.label} {row.text}" for row in (frozen, exact)),
    ]
