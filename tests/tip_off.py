"""Forty tip-offs of a small satellite, in lanes: a quarter of an hour each."""

from torquer.campaign.load import campaign_from_data

SCENARIO = """
name = "tip_off"
start = 2012-03-04T10:31:47Z
orbit = { kind = "circular", altitude_km = 550, inclination_deg = 60 }
environment.field.kind = "averaged"
spacecraft.body.inertia_kg_m2 = [1.0, 1.3, 1.7]
spacecraft.coils.limit_a_m2 = 3.0
initial.rate_deg_s = [1.0, -0.6, 0.8]
control = { law = { kind = "bdot_rate", gain_a_m2_s_per_t = 1e5 }, sample_s = 1.0 }
simulation = { duration_s = 900, record_s = 20, step_s = 1.0 }
"""
TABLE = {
    "runs": 40,
    "seed": 5,
    "vary": {
        "initial.attitude": "uniform",
        "initial.rate_deg_s": {"direction": "uniform", "magnitude": {"uniform": [0.5, 5.0]}},
    },
    "success": {"final_rate_deg_s": {"below": 2.0}},
}


def campaign(scenario, **changes):
    """The campaign of a scenario, with some keys changed."""
    return campaign_from_data({**TABLE, **changes}, scenario)
