"""Scenarios and processes for the tests of reliability."""

SCENARIO = """
start = 2012-03-04T10:31:47Z
orbit = {{ kind = "circular", altitude_km = 550, inclination_deg = 60 }}
environment.field.kind = "averaged"
spacecraft.body.inertia_kg_m2 = [1.0, 1.3, 1.7]
spacecraft.coils.limit_a_m2 = 3.0
spacecraft.magnetometer.noise_nt = 50.0
initial.rate_deg_s = [1.0, -0.6, 0.8]
control = {{ law = {law}, sample_s = 2.0 }}
simulation = {{ duration_s = {duration_s}, record_s = {record_s} }}
"""
CAMPAIGN = """
[campaign]
runs = {runs}
[campaign.vary]
initial.rate_deg_s = {{ direction = "uniform", magnitude = {{ uniform = [0.5, 4.0] }} }}
"""
LAWS = """
import torquer


@torquer.law(memory={"calls": 0.0})
def compiled(inputs, parameters, memory):
    memory.calls += 1.0
    b = inputs.b_body_t
    return (1e4 * b[0], 1e-6 * memory.calls, -1e4 * b[2])


def plain(inputs, parameters, memory):
    memory[0] += 1.0
    b = inputs.b_body_t
    return (1e4 * b[0], 1e-6 * memory[0], -1e4 * b[2])
"""
KINDS = {
    "built-in": '{ kind = "bdot", gain_a_m2_s_per_t = 1e6 }',
    "compiled": '{ kind = "user", file = "laws.py", function = "compiled" }',
    "plain": '{ kind = "user", file = "laws.py", function = "plain" }',
}


def done(process, timeout_s=120.0):
    """(Exit code, standard output, standard error) when it has ended; no traceback in either."""
    out, err = process.communicate(timeout=timeout_s)
    assert "Traceback" not in err, err
    return process.returncode, out, err
