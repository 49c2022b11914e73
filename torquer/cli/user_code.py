"""What a scenario executes: Python files with users' laws, and where they may be."""

from pathlib import Path

from torquer.control.user import UserLaw
from torquer.scenario.spec import Scenario


def code_of(scenario: Scenario) -> dict[str, Path]:
    """Python files that a run of the scenario executes, by the key of the law in `control`."""
    control = scenario.control
    laws = {control.key_of(name): law for name, law in control.named().laws.items()}
    return {key: Path(law.file) for key, law in laws.items() if isinstance(law, UserLaw)}


def check_code(scenario: Scenario, path: Path, allowed: bool, from_anywhere: bool) -> None:
    """ValueError for a law's file if none is allowed, or none in its place."""
    folder = path.resolve().parent
    for key, file in code_of(scenario).items():
        if not allowed:
            raise ValueError(
                f"control.{key}.file: must not be given with --no-user-code; received {file}"
            )
        if not (from_anywhere or file.resolve().is_relative_to(folder)):
            raise ValueError(
                f"control.{key}.file: must lie in the scenario's folder, or be allowed by "
                f"--code-from-anywhere; received {file}"
            )
