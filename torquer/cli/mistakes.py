"""Mistakes on the command line in the words of all other messages."""

import difflib

from cyclopts.exceptions import UnknownOptionError, UnusedCliTokensError


def in_words(error: Exception) -> str:
    """What a command says of an error."""
    if isinstance(error, UnusedCliTokensError):
        tokens = " ".join(error.unused_tokens or ())
        return f"arguments: must be no more than the command takes; received also {tokens}"
    if isinstance(error, UnknownOptionError):
        name = error.token.keyword or error.token.value
        known = [each for part in error.argument_collection if part.parse for each in part.names]
        bare = {each.lstrip("-"): each for each in known}
        near = difflib.get_close_matches(name.lstrip("-").partition("=")[0], bare, 1)
        hint = f" (did you mean {bare[near[0]]}?)" if near else "; --help lists them"
        return f"{name}: must be a known option{hint}"
    return str(error) or repr(error)


def as_options(text: str, options: dict[str, str]) -> str:
    """A message about arguments of functions as one about options: `{"to": "--out"}`."""
    for key, name in options.items():
        if text.startswith(f"{key}: "):
            text = name + text.removeprefix(key)
    return text
