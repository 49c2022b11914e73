"""A subclass of the user's own is refused wherever it is given: as data it would be its base."""

import pytest

from torquer.base.explain import ScenarioError
from torquer.base.spec import Spec, as_data, check_spec
from torquer.environment.along_orbit import Environment
from torquer.environment.field import FIELDS
from torquer.environment.orbit import Circular
from torquer.scenario.load import scenario_from_text
from torquer.scenario.spec import Scenario
from torquer.spacecraft.actuators.coils import Coils

TEXT = """
start = 2025-07-01T00:00:00Z
orbit = { kind = "circular", altitude_km = 550, inclination_deg = 97.6 }
spacecraft.body.inertia_kg_m2 = [0.03, 0.03, 0.01]
spacecraft.coils.limit_a_m2 = 0.2
initial.rate_deg_s = [8, -5, 3]
control = { law = { kind = "off" }, sample_s = 1.0 }
simulation = { duration_s = 60, record_s = 5.0 }
"""


class OwnOrbit(Circular):
    """An ephemeris of the user's own."""


class OwnField(FIELDS["igrf14"]):
    """A field of the user's own."""


class OwnCoils(Coils):
    """Coils of the user's own."""


GIVEN = {
    "orbit": (OwnOrbit(altitude_km=550.0, inclination_deg=97.6), "Circular"),
    "environment.field": (OwnField(), "Igrf14"),
    "spacecraft.coils": (OwnCoils(limit_a_m2=0.2), "Coils"),
}


@pytest.mark.parametrize("key", GIVEN)
def test_replace_refuses_it(key):
    value, base = GIVEN[key]
    with pytest.raises(ScenarioError) as error:
        scenario_from_text(TEXT).replace(key, value)
    assert str(error.value) == (
        f"{key}: must be of a class of the package, or of kind 'user' where there is one; received "
        f"{type(value).__name__}, a subclass of {base}, as which it would be flown"
    )


@pytest.mark.parametrize("key", GIVEN)
def test_it_is_refused_within_a_table_that_is_replaced(key):
    value, _ = GIVEN[key]
    table, _, last = key.rpartition(".")
    scenario = scenario_from_text(TEXT)
    if table:
        with pytest.raises(ScenarioError, match="a subclass of"):
            getattr(scenario, table).model_copy(update={last: value})
    with pytest.raises(ValueError, match="a subclass of"):
        scenario.model_copy(update={"orbit": GIVEN["orbit"][0]})


def test_constructors_refuse_it():
    scenario = scenario_from_text(TEXT)
    parts = {name: getattr(scenario, name) for name in scenario.model_fields_set}
    assert Scenario(**parts) == scenario
    with pytest.raises(ValueError, match="OwnOrbit, a subclass of Circular"):
        Scenario(**{**parts, "orbit": GIVEN["orbit"][0]})
    with pytest.raises(ValueError, match="OwnField, a subclass of Igrf14"):
        Environment(field=OwnField())
    with pytest.raises(ValueError, match="OwnField, a subclass of Igrf14"):
        check_spec(OwnField())
    assert as_data(FIELDS["igrf14"]())["kind"] == "igrf14"


def test_a_spec_that_derives_from_none_of_the_package_is_no_concern():
    class Other(Spec):
        number: float

    assert check_spec(Other(number=1.0)) == Other(number=1.0)
