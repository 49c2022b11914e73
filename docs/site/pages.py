"""What the site has beyond the Markdown files of the repository.

Made into docs/made/, which git ignores: a page for each public package or module with its
docstrings, and the pictures of the gallery. The contents are appended to README.md as it is read.
"""

import ast
import re
import shutil
from pathlib import Path
from textwrap import indent

import generate
from PIL import Image

from torquer.scenario.words import trade_words

ROOT = Path(__file__).parents[2]
MADE = "docs/made"
_INDEX = (ROOT / "docs/tutorials/README.md").read_text(encoding="utf-8")
TUTORIALS = [f"docs/tutorials/{name}" for name in re.findall(r"\(([a-z-]+)\.md\)", _INDEX)]
THUMBNAIL = (320, 240)
#: Captions of the sidebar, and the pages below each; with `*` all that match.
CONTENTS = {
    "Start": (
        "docs/installation",
        "docs/features",
        "docs/which-tool",
        "docs/satellites",
        "docs/all-pages",
        f"{MADE}/gallery",
    ),
    "Tutorials": ("docs/tutorials/README", *TUTORIALS, "docs/faults/*"),
    "Reference": (
        "docs/command-list",
        "docs/commands",
        "docs/results-and-files",
        "docs/running-code",
        "docs/board",
        "docs/scenario",
        "docs/wheel-design",
        "docs/telemetry-mapping",
        "docs/variables",
        "docs/api",
        "docs/packets",
        "docs/requirements",
        "docs/functions",
        "docs/words",
    ),
    "Theory": ("docs/theory/*",),
    "Sources": (
        "docs/sources",
        "docs/equations",
        "docs/errata",
        "docs/gallery/README",
        "docs/studies",
        "docs/peers",
        "docs/data",
    ),
    "По-русски": (
        "README.ru",
        "docs/installation.ru",
        "docs/features.ru",
        "docs/satellites.ru",
        "docs/command-list.ru",
        "docs/results-and-files.ru",
        "docs/running-code.ru",
        "docs/all-pages.ru",
        "docs/tutorials/README.ru",
        *(f"{name}.ru" for name in TUTORIALS[:3]),
        "docs/glossary",
    ),
    "Project": ("ARCHITECTURE", "CONTRIBUTING", "CHANGELOG", "design/*"),
}
#: Pages below another one.
BELOW = {"docs/api": f"{MADE}/torquer*", "docs/gallery/README": "docs/gallery/[A-Zd]*[!E]"}


def make() -> None:
    """Write the pages that are made; a page that did not change keeps its time."""
    made = ROOT / MADE
    made.mkdir(exist_ok=True)
    for place in (*generate.PACKAGES, *generate.MODULES):
        _write(made / f"{place}.md", names_page(place))
    _write(made / "gallery.md", pictures_page())


def _write(path: Path, text: str) -> None:
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


# --------------------------------------------------------------------------- public names


def names_of(place: str) -> list[str]:
    """Public names of a package or a documented module."""
    return (
        generate.public_names(place) if place in generate.PACKAGES else generate.functions_of(place)
    )


def names_page(place: str) -> str:
    """Every public name of a package or module with its signature and docstring."""
    about = ast.get_docstring(generate.tree_of(place)) or ""
    parts = [described(place, name) for name in names_of(place)]
    module = f"```{{py:currentmodule}} {place}\n```"
    return "\n\n".join([f"# {place}", module, markdown(about), *parts]) + "\n"


def described(place: str, name: str) -> str:
    """A name as a directive of Sphinx: the search and the index then know it."""
    home = generate.home_of(place, name)
    nodes = generate.tree_of(home).body
    kinds = ast.ClassDef | ast.FunctionDef
    node = next((n for n in nodes if isinstance(n, kinds) and n.name == name), None)
    lines = [f"Home: `{home}`."] if home != place else []
    if node is None:
        return directive("data", name, [generate.line_of(place, name), *lines])
    text = markdown(ast.get_docstring(node) or "")
    if isinstance(node, ast.FunctionDef):
        return directive("function", f"{name}{signature(node)}", [text, *lines])
    return directive("class", name, [text, *lines, *map(member, members(node))])


def signature(node: ast.FunctionDef) -> str:
    """Arguments and result, in Python's own words."""
    arguments = ast.unparse(node.args).removeprefix("self, ").removeprefix("self")
    return f"({arguments})" + (f" -> {ast.unparse(node.returns)}" if node.returns else "")


def members(node: ast.ClassDef):
    """Public fields and methods of a class with what is said of each."""
    following = [*node.body[1:], None]
    for each, after in zip(node.body, following, strict=True):
        if isinstance(each, ast.FunctionDef) and not each.name.startswith("_"):
            yield f"{each.name}{signature(each)}", ast.get_docstring(each) or ""
        if isinstance(each, ast.AnnAssign) and isinstance(each.target, ast.Name):
            value = getattr(getattr(after, "value", None), "value", "")
            said = value if isinstance(after, ast.Expr) and isinstance(value, str) else ""
            yield f"{each.target.id}: {ast.unparse(each.annotation)}", " ".join(said.split())


def member(of_class: tuple[str, str]) -> str:
    """A line for a field or a method."""
    text, said = of_class
    return f"- `{text}`" + (f": {said.splitlines()[0]}" if said else "")


def directive(kind: str, text: str, parts: list[str]) -> str:
    """A fence that Sphinx takes for a name of the package."""
    body = "\n\n".join(part for part in parts if part)
    body = re.sub(r"\n\n(?=- `)", "\n", body).replace("\n- `", "\n\n- `", 1)
    fence = "`" * 6
    return f"{fence}{{py:{kind}}} {text}\n\n{body}\n{fence}"


def markdown(docstring: str) -> str:
    """A docstring as Markdown: examples, and what is indented, are shown as they stand."""
    docstring = re.sub(
        r"^>>> .*(\n.+)*", lambda code: indent(code[0], "    "), docstring, flags=re.M
    )
    return re.sub(r"^(\S.*)\n(?=    \S)", r"\1\n\n", docstring, flags=re.M)


# --------------------------------------------------------------------------- the gallery


def pictures_page() -> str:
    """Small pictures of the gallery, each leading to its entry."""
    lines = ["# Gallery in pictures", "", "Published figures, recomputed: each leads to its entry."]
    (ROOT / MADE / "thumbnails").mkdir(exist_ok=True)
    for page in sorted((ROOT / "docs/gallery").glob("[A-Z]*.md")):
        text = page.read_text(encoding="utf-8")
        shown = []
        for name in dict.fromkeys(re.findall(r"!\[[^\]]*\]\(img/([^)]+)\.png\)", text)):
            small(
                ROOT / "docs/gallery/img" / f"{name}.png",
                ROOT / MADE / "thumbnails" / f"{name}.png",
            )
            shown.append(f"[![{name}](thumbnails/{name}.png)](../gallery/{page.name})")
        if shown:
            title = text.splitlines()[0].lstrip("# ")
            lines += ["", f"## {title}", "", *shown]
    return "\n".join(lines) + "\n"


def small(path: Path, to: Path) -> None:
    """A picture in a size of which many fit on a page."""
    if not to.exists() or to.stat().st_mtime < path.stat().st_mtime:
        with Image.open(path) as picture:
            picture.thumbnail(THUMBNAIL)
            picture.convert("RGB").save(to)


# --------------------------------------------------------------------------- as pages are read


def read(app, name: str, source: list[str]) -> None:
    """Changes that only the site needs."""
    text = source[0].replace("```mermaid", "```text")
    text += index_entries(name)
    if name == "docs/api":
        text = linked(text)
    if name in BELOW:
        text += tree("", (BELOW[name],))
    if name == "README":
        text += "".join(tree(caption, names) for caption, names in CONTENTS.items())
    source[0] = text


def index_entries(name: str) -> str:
    """Words of the trade that a page answers: the site's search finds it by them."""
    words = [word for row in trade_words() if f"docs/{row.page}" == name for word in row.words]
    return "".join(f"\n```{{index}} ! single: {word}\n```\n" for word in words)


def tree(caption: str, names) -> str:
    """Pages in the sidebar."""
    lines = ["```{toctree}", ":hidden:", ":glob:", f":caption: {caption}" if caption else ""]
    return "\n".join(["", *lines, "", *(f"/{name}" for name in names), "```", ""])


def linked(text: str) -> str:
    """The table of public names, with a link from each to its docstring."""
    place, lines = "", []
    for line in text.split("\n"):
        if line.startswith("## "):
            place = line[3:]
        lines.append(re.sub(r"^\| `(\w+)` \|", rf"| {{py:obj}}`\1 <{place}.\1>` |", line))
    return "\n".join(lines)


def finish(app, error) -> None:
    """The site's address leads to its first page."""
    if error is None and app.builder.format == "html":
        page = '<!doctype html><meta charset="utf-8"><title>torquer</title>'
        page += '<meta http-equiv="refresh" content="0; url=README.html">'
        page += '<a href="README.html">torquer</a>\n'
        Path(app.outdir, "index.html").write_text(page, encoding="utf-8")
    shutil.rmtree(Path(app.outdir, "_sources"), ignore_errors=True)
