"""The help of commands in the language of the user: every text is looked up as it is shown."""

from cyclopts.help import DefaultFormatter, HelpPanel, InlineText
from rich.console import Console, ConsoleOptions
from rich.text import Text

from torquer.base.language import translated

#: What cyclopts itself writes: titles of panels, what stands in brackets behind an option.
TITLES = ("Commands", "Arguments", "Parameters")
MARKS = ("[required]", "[default: ", "[choices: ")
USAGE = ("Usage: ", "COMMAND", "[OPTIONS]", "[ARGS]", "[ARGS...]")


def paragraphs(text: str) -> list[str]:
    """The paragraphs of a help text, each as one line: these are translated."""
    return [" ".join(part.split()) for part in text.split("\n\n") if part.strip()]


def as_translated(text: str) -> str:
    """A help text, paragraph by paragraph."""
    return "\n\n".join(map(translated, paragraphs(text)))


class _Described(InlineText):
    """What an option is, with what stands in brackets behind it."""

    def append(self, text: Text) -> None:
        mark = next(filter(text.plain.startswith, MARKS), "")
        super().append(Text(translated(mark) + text.plain.removeprefix(mark), text.style))


def _described(shown: InlineText) -> InlineText:
    """A description of cyclopts; one that is empty stays so."""
    text = as_translated(getattr(shown.primary_renderable, "markup", ""))
    return _Described.from_format(text or None, "markdown", force_empty_end=shown.force_empty_end)


class TranslatedHelp(DefaultFormatter):
    """Help as cyclopts draws it, in the language of the user."""

    def __call__(self, console: Console, options: ConsoleOptions, panel: HelpPanel) -> None:
        entries = [each.copy(description=_described(each.description)) for each in panel.entries]
        title = translated(str(panel.title))
        super().__call__(console, options, panel.copy(title=title, entries=entries))

    def render_usage(self, console: Console, options: ConsoleOptions, usage: Text) -> None:
        words = (translated(each) if each in USAGE else each for each in str(usage).split())
        console.print(Text(translated("Usage: ") + " ".join(words) + "\n", "bold"))

    def render_description(
        self, console: Console, options: ConsoleOptions, description: InlineText
    ) -> None:
        super().render_description(console, options, _described(description))
