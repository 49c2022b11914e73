"""A command called and answered: a user's mistake gives one line in the words of all messages."""

import re
import sys
from contextlib import suppress

from cyclopts import CycloptsError
from cyclopts.exceptions import (
    CoercionError,
    MissingArgumentError,
    UnknownOptionError,
    UnusedCliTokensError,
)

from torquer.base.language import ENGLISH, language
from torquer.base.limits import RequestError
from torquer.base.strict_json import json_text
from torquer.base.units import conversion, did_you_mean
from torquer.cli.app import app
from torquer.cli.options import option
from torquer.cli.output import drop_output, finish_output, forget_made_folders, print_error


def answer(arguments: list[str] | None = None) -> int | None:
    """Run a command; return its exit code: 2 on a user error, none or 0 on success."""
    code = 0
    speak()
    given = sys.argv[1:] if arguments is None else arguments
    if given[:1] == ["help"]:  # as of git and others: `help run` for `run --help`
        arguments = [*given[1:], "--help"]
    try:
        code = app(arguments, exit_on_error=False, print_error=False, result_action="return_value")
        finish_output()
    except BrokenPipeError:  # the reader, such as `head`, has closed the pipe
        drop_output()
    except (CycloptsError, ValueError, OSError, MemoryError) as error:
        text = in_words(error)
        print_error(text)
        if "--json" in given:
            with suppress(OSError):  # for programs that read standard output
                print(json_text({"errors": [line for line in text.split("\n") if line]}))
        drop_output()
        code = 2
    finally:
        forget_made_folders(is_refused=code == 2)
    return code


def speak() -> None:
    """Show help in the language of the user."""
    app.help_formatter = None
    if language() != ENGLISH:
        from torquer.cli.translated_help import TranslatedHelp

        app.help_formatter = TranslatedHelp()


def in_words(error: Exception) -> str:
    """What a command says of an error."""
    if isinstance(error, UnusedCliTokensError):
        tokens = " ".join(error.unused_tokens or ())
        return f"arguments: must be no more than the command takes; received also {tokens}"
    if isinstance(error, UnknownOptionError):
        name = error.token.keyword or error.token.value
        known = [each for part in error.argument_collection if part.parse for each in part.names]
        bare, given = [each.lstrip("-") for each in known], name.lstrip("-").partition("=")[0]
        hint = did_you_mean(given, bare, dashes="--") or "; --help lists them"
        return f"{name}: must be a known option{hint}"
    if isinstance(error, RequestError):
        return error.spelled(option)
    if isinstance(error, CoercionError) and error.msg and not _is_named(error):
        name = error.argument.name.lstrip("-").upper() if error.argument else "argument"
        return f"{name}: {error}"
    if isinstance(error, MissingArgumentError):
        return _with_units(str(error))
    return str(error) or repr(error)


def _is_named(error: CoercionError) -> bool:
    """Whether the message of an error names the option."""
    return error.token is not None and error.token.keyword is not None


def _with_units(text: str) -> str:
    """A text that asks for an option, with the conversion if the one given has another unit."""
    asked = re.search(r" Did you mean --(\S+) instead of --(\S+)\?$", text)
    if asked is None:
        return text
    how = conversion(asked[2], asked[1])
    if how is None:
        return text[: asked.start()]
    return f"{text} {how}".rstrip()
