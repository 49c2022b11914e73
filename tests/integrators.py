"""Changes of a scenario that make it one of another integrator."""

INTEGRATORS = ("auto", "rk4", "splitting")


def by(integrator: str) -> dict:
    """Keys for `make`: adaptive steps leave the step out."""
    steps = {"simulation.step_s": None} if integrator == "auto" else {}
    return {"simulation.integrator": integrator} | steps
