"""Quick start: does this CubeSat stop tumbling, and how fast?"""

import torquer

scenario = torquer.scenario_from_text("""
start = 2025-07-01T00:00:00Z
orbit = { kind = "circular", altitude_km = 550, inclination_deg = 97.6 }
spacecraft.body.inertia_kg_m2 = [0.03, 0.03, 0.01]
spacecraft.coils.limit_a_m2 = 0.2
initial.rate_deg_s = [8, -5, 3]
control = { law = { kind = "bdot", gain_a_m2_s_per_t = 2e4 }, sample_s = 1.0 }
simulation = { revolutions = 3, record_s = 5.0 }
""")
result = torquer.simulate(scenario)  # an xarray.Dataset: units, frames, scenario attached
for label, value in torquer.summary_rows(torquer.summarise(result)):
    print(f"{label:34} {value}")
torquer.write_report(result, "runs/quickstart")  # report.html; plots=True: PNG files, too
