"""Scenarios that commands load: whose Python files may be executed, whose models can be used."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from torquer.cli.options import CodeOptions
from torquer.cli.output import make_writable
from torquer.computer.blocks.user import UserLaw
from torquer.scenario.load import check_orbit_environment, load_scenario
from torquer.scenario.spec import Scenario

if TYPE_CHECKING:
    from torquer.campaign.spec import Campaign


def load_checked(path: Path, code: CodeOptions) -> Scenario:
    """The scenario of a file; ValueError if it names Python files that may not be executed."""
    scenario = load_scenario(path)
    check_code(scenario, path, code)
    return scenario


def load_usable(path: Path, code: CodeOptions, out: Path | None) -> Scenario:
    """The scenario of a file, checked for flight, with a folder for its pictures if one is given.

    ValueError for code that may not be executed, for unusable models, and for a folder that cannot
    be written.
    """
    scenario = load_checked(path, code)
    check_orbit_environment(scenario)
    if out is not None:
        make_writable(out)
    return scenario


def find_code(scenario: Scenario, campaign: Campaign | None = None) -> dict[str, Path]:
    """Python files that a run of the scenario, or any member of a campaign, executes, by key."""
    control = scenario.control
    laws = {control.key_of(name): law for name, law in control.named().laws.items()}
    named = {
        f"control.{key}.file": Path(law.file)
        for key, law in laws.items()
        if isinstance(law, UserLaw)
    }
    if campaign is None:
        return named
    from torquer.campaign.load import code_named

    return named | dict(code_named(campaign))


def check_code(
    scenario: Scenario, path: Path, code: CodeOptions, campaign: Campaign | None = None
) -> None:
    """ValueError for a law's file if none is allowed, or none in its place."""
    folder = path.resolve().parent
    for key, file in find_code(scenario, campaign).items():
        if code.no_user_code:
            raise ValueError(f"{key}: must not be given with --no-user-code; received {file}")
        if not (code.code_from_anywhere or file.resolve().is_relative_to(folder)):
            raise ValueError(
                f"{key}: must lie in the scenario's folder, or be allowed by "
                f"--code-from-anywhere; received {file}"
            )


def check_computer(computer: Path | None, code: CodeOptions) -> None:
    """ValueError for an exported computer, which is executed, where no code is allowed."""
    if computer is not None and code.no_user_code:
        raise ValueError(
            f"--computer: must not be given with --no-user-code; received {computer}, whose C code "
            "is executed"
        )
