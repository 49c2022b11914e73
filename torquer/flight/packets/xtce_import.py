"""Telemetry described in XTCE (1.1 to 1.3) as a dictionary.

Packets are the containers that a comparison tells by an id: by the APID of the primary header of a
space packet, or by `msg_id` of the frames that `xtce` writes. A container holds what it inherits,
then its own entries, without gaps; a gap stated in bits becomes padding. What a dictionary cannot
hold is refused by one line that names the element; nothing is guessed.
"""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from torquer.base.explain import ScenarioError
from torquer.base.text_files import limited_text
from torquer.flight.packets.dictionary import Dictionary, DictionaryError, Field, Packet
from torquer.flight.packets.fields import LONGEST_NAME
from torquer.flight.packets.framing import PRIMARY_HEADER, SPACE_PACKETS, framing_of
from torquer.flight.packets.xtce import PAD, TIME
from torquer.flight.packets.xtce_types import children, clean_text, must, read_type, tag_of

_APID = next(place for place in PRIMARY_HEADER.places if place.name == SPACE_PACKETS.id_field)
#: More containers within each other, and entries of one, than any packet needs.
_DEEPEST, _MOST_ENTRIES = 32, 4000
_PRIMARY_BITS = 8 * PRIMARY_HEADER.size


class Imported(NamedTuple):
    """A dictionary that was read; `link`: by which its packets come; `notes`: what was left out."""

    dictionary: Dictionary
    link: str
    notes: tuple[str, ...]


class _Entry(NamedTuple):
    """A parameter in a container: its name there, its type, its description, bits, as a field."""

    name: str
    type: str
    description: str
    bits: int
    keys: dict


class _Content(NamedTuple):
    """What a container holds with all that it inherits; `asked`: compared values, by parameter."""

    entries: list[_Entry]
    asked: dict[str, str]


def read_xtce(path: Path | str, packets: Sequence[str] = ()) -> Imported:
    """The dictionary of an XTCE file; `packets`: only these containers, by their names there.

    `DictionaryError` with one line for what is no XTCE, or what a dictionary cannot hold.

        read_xtce("mission.xml").dictionary.down["housekeeping"].names
    """
    path = Path(path)
    try:
        return _Reader(_parse(path)).read(packets)
    except OSError as error:
        raise DictionaryError(
            f"FILE: must be readable; received {path} ({error.strerror})"
        ) from None
    except ValueError as error:
        raise DictionaryError(f"{path.name}: {error}") from None


def _parse(path: Path) -> ElementTree.Element:
    """The root of an XML file; one that declares types or entities of its own is not read."""
    try:
        text = limited_text(path)
    except ValueError as error:  # too long, or not UTF-8
        raise ValueError(f"must be XML that can be read; received: {error}") from None
    if re.search(r"<!(?!--|\[CDATA\[)", text):
        raise ValueError("must be XML without declarations of types and entities; received <!...>")
    try:
        return ElementTree.fromstring(text.strip())
    except ElementTree.ParseError as error:
        raise ValueError(f"must be XML that can be read; received an error: {error}") from None


class _Reader:
    """Reads one system; `notes`: what is left out."""

    def __init__(self, root: ElementTree.Element):
        if tag_of(root) != "SpaceSystem":
            raise must("XTCE", "begin with SpaceSystem", tag_of(root))
        for nested in children(root, "SpaceSystem"):
            raise must(f"SpaceSystem {nested.get('name')}", "hold no systems of its own", "one")
        self._name = clean_text(root.get("name") or "satellite")
        self.notes = ["CommandMetaData: commands are left out"] if children(
            root, "CommandMetaData") else []  # fmt: skip
        self._types = _by_name(root, "ParameterTypeSet")
        self._parameters = _by_name(root, "ParameterSet")
        self._containers = _by_name(root, "ContainerSet")
        self._fields: dict[str, dict] = {}
        self._contents: dict[str, _Content] = {}

    def read(self, packets: Sequence[str]) -> Imported:
        """All packets, or some by their names."""
        for name in packets:
            if name not in self._containers:
                raise must("packet", f"be one of {', '.join(self._containers)}", name)
        found: dict[str, Packet] = {}
        links: set[str] = set()
        for name in packets or self._leaves():
            packet, link = self._packet(name)
            packet = packet.model_copy(update={"name": _unique(packet.name, found)})
            found[packet.name] = packet
            links.add(link)
        if len(links) != 1:
            what = f"{len(links)} kinds" if links else "none"
            raise must("ContainerSet", "have packets with headers of one kind", what)
        try:
            dictionary = Dictionary(name=self._name, down=found)
            dictionary.check_alarms()
        except ScenarioError as error:
            raise ValueError(str(error).split("\n")[0]) from None
        return Imported(dictionary, links.pop(), tuple(dict.fromkeys(self.notes)))

    def _leaves(self) -> Iterator[str]:
        """Containers that are packets: not abstract, and with an id unless others inherit them."""
        bases = {_base(each) for each in self._containers.values()}
        for name, container in self._containers.items():
            is_told = children(container, "BaseContainer", "RestrictionCriteria")
            if container.get("abstract") != "true" and (is_told or name not in bases):
                yield name

    def _packet(self, name: str) -> tuple[Packet, str]:
        """A packet, and the link by which it comes."""
        place = f"SequenceContainer {name}"
        content = self._content(name, ())
        header, link, id_name = _header(place, content)
        for asked in content.asked:
            if asked not in [entry.name for entry in content.entries[:header]]:
                raise must(place, "be told by comparisons of its header", asked)
        text = content.asked[id_name]
        try:
            number = int(text, 16 if text.lower().startswith("0x") else 10)
        except ValueError:
            raise must(place, "be told by a whole number", repr(text)) from None
        if number not in (ids := framing_of(link).ids):
            raise must(place, f"be told by an id of {ids[0]} to {ids[-1]}", number)
        container = self._containers[name]
        keys = {"id": number, "description": _description(container, name)}
        for each in children(container, "AncillaryDataSet", "AncillaryData"):
            if each.get("name") == TIME:
                keys["time_ms"] = each.text or ""
        try:
            fields = _fields(content.entries[header:], f"{name}__")
            return Packet(name=_word(name), fields=tuple(fields), **keys), link
        except ScenarioError as error:
            raise ValueError(f"{place}: {error}".split("\n")[0]) from None

    def _content(self, name: str, within: tuple[str, ...]) -> _Content:
        """What a container holds; `within`: containers that lead to it."""
        place = f"SequenceContainer {name}"
        if name in within:
            raise must(place, "not be part of itself", " in ".join((name, *within[::-1])))
        if len(within) > _DEEPEST:
            raise must(place, f"be within at most {_DEEPEST} containers", len(within))
        if name not in self._contents:  # containers within containers twice, and so on
            self._contents[name] = self._read_content(place, name, within)
        return self._contents[name]

    def _read_content(self, place: str, name: str, within: tuple[str, ...]) -> _Content:
        container = self._containers.get(name)
        if container is None or tag_of(container) != "SequenceContainer":
            raise must(place, "be a SequenceContainer of the file", "none")
        if children(container, "BinaryEncoding"):
            raise must(place, "have no BinaryEncoding", "one")
        found = _Content([], {})
        for base in children(container, "BaseContainer"):
            inherited = self._content(_reference(base, "containerRef"), (*within, name))
            found.entries.extend(inherited.entries)
            found.asked.update(inherited.asked | _comparisons(place, base))
        for entry in (each for part in children(container, "EntryList") for each in part):
            found.entries.extend(self._entries(place, entry, (*within, name)))
            if len(found.entries) > _MOST_ENTRIES:
                raise must(place, f"have at most {_MOST_ENTRIES} entries", "more")
        return found

    def _entries(self, place: str, entry: ElementTree.Element, within: tuple) -> Iterator[_Entry]:
        """The parameters that an entry stands for, padding before them."""
        for child in entry:
            if tag_of(child) != "LocationInContainerInBits":
                raise must(place, "have entries without conditions and repetitions", tag_of(child))
            yield from _gap(place, child)
        if tag_of(entry) == "ContainerRefEntry":
            yield from self._content(_reference(entry, "containerRef"), within).entries
        elif tag_of(entry) == "ParameterRefEntry":
            yield self._entry(place, _reference(entry, "parameterRef"))
        else:
            raise must(place, "have parameters and containers for entries", tag_of(entry))

    def _entry(self, place: str, name: str) -> _Entry:
        parameter = self._parameters.get(name)
        if parameter is None:
            raise must(place, "refer to parameters of the file", name)
        kind = _reference(parameter, "parameterTypeRef")
        if kind not in self._types:
            raise must(f"Parameter {name}", "have a type of the file", kind)
        if kind not in self._fields:
            self._fields[kind] = read_type(self._types[kind], self.notes)
        keys = self._fields[kind]
        width = 8 * keys["count"] if keys["type"] == "bytes" else int(keys["type"][1:])
        return _Entry(name, kind, _description(parameter, ""), width, keys)


def _by_name(root: ElementTree.Element, kind: str) -> dict[str, ElementTree.Element]:
    """What a set of telemetry holds."""
    parts = children(root, "TelemetryMetaData", kind)
    return {each.get("name", ""): each for part in parts for each in part}


def _base(container: ElementTree.Element) -> str:
    """The container that another one inherits, "" if none."""
    return next((_reference(b, "containerRef") for b in children(container, "BaseContainer")), "")


def _reference(element: ElementTree.Element, key: str) -> str:
    """The name that is referred to: there is one system only."""
    return (element.get(key) or "").rpartition("/")[2]


def _description(element: ElementTree.Element, otherwise: str) -> str:
    long = " ".join(each.text or "" for each in children(element, "LongDescription"))
    return clean_text(element.get("shortDescription") or long) or clean_text(otherwise)


def _comparisons(place: str, base: ElementTree.Element) -> dict[str, str]:
    """Values that parameters must have, by their names."""
    found = {}
    for criteria in children(base, "RestrictionCriteria"):
        listed = [*criteria, *(x for each in children(criteria, "ComparisonList") for x in each)]
        for each in (x for x in listed if tag_of(x) != "ComparisonList"):
            if tag_of(each) != "Comparison" or each.get("comparisonOperator", "==") != "==":
                received = each.get("comparisonOperator") or tag_of(each)
                raise must(place, "be told by Comparisons with ==", received)
            found[_reference(each, "parameterRef")] = each.get("value") or ""
    return found


def _gap(place: str, location: ElementTree.Element) -> Iterator[_Entry]:
    """Padding before an entry."""
    sizes = children(location, "FixedValue")
    text = (sizes[0].text or "").strip() if len(sizes) == 1 else "another"
    is_relative = location.get("referenceLocation", "previousEntry") == "previousEntry"
    if not is_relative or not text.isdecimal() or len(text) > 5:
        raise must(place, "place entries by fixed bits after the previousEntry", text)
    if bits := int(text):
        yield _Entry(f"{PAD}__", "", "padding", bits, {"type": f"u{bits}", "byte_order": "big"})


def _header(place: str, content: _Content) -> tuple[int, str, str]:
    """How many entries are the header, by which link they come, which of them has the id."""
    at, begins, ends = 0, {}, {}
    for number, entry in enumerate(content.entries):
        begins[entry.name], at = at, at + entry.bits
        ends[at] = number + 1
    bits = {entry.name: entry.bits for entry in content.entries}
    for name in content.asked:
        if (begins.get(name), bits.get(name)) == (_APID.bit, _APID.bits) and _PRIMARY_BITS in ends:
            return ends[_PRIMARY_BITS], "space_packets", name
    framing = framing_of("historical")
    own = [(place.name, place.bits) for place in framing.header.places]
    if [(each.name, each.bits) for each in content.entries[: len(own)]] == own and (
        framing.id_field in content.asked
    ):
        return len(own), "historical", framing.id_field
    raise must(
        place,
        "be told by a Comparison of the APID within the 48 bits of a primary header",
        ", ".join(content.asked) or "no Comparison",
    )


def _fields(entries: list[_Entry], prefix: str) -> Iterator[Field]:
    """Fields of entries: padding joined, numbers of a vector together."""
    taken: set[str] = set()
    groups: list[list[_Entry]] = []
    for entry in entries:
        named = entry._replace(name=entry.name.removeprefix(prefix))
        if groups and _belongs(named, groups[-1]):
            groups[-1].append(named)
        else:
            groups.append([named])
    for group in groups:
        yield from _joined(group, taken)


def _belongs(entry: _Entry, group: list[_Entry]) -> bool:
    """Whether an entry goes on with what those before it began."""
    if _is_padding(entry):
        same = entry.keys["byte_order"] == group[0].keys.get("byte_order")
        return _is_padding(group[0]) and same
    base, _, end = entry.name.rpartition("_")
    first, _, begin = group[0].name.rpartition("_")
    alike = (base, entry.type, entry.description) == (first, group[0].type, group[0].description)
    ends = "xyz" if begin == "x" else [str(k) for k in range(len(group) + 1)]
    follows = len(group) < len(ends) and end == ends[len(group)] and begin == ends[0]
    return alike and bool(base) and follows and entry.keys["type"] != "bytes"


def _is_padding(entry: _Entry) -> bool:
    return entry.name.startswith(f"{PAD}__")


def _joined(group: list[_Entry], taken: set[str]) -> Iterator[Field]:
    """One field of a group, or one for each of its entries where they make no vector."""
    first = group[0]
    if _is_padding(first):
        order = first.keys["byte_order"]
        bits = sum(entry.bits for entry in group)
        yield Field(name="", type="pad", count=bits, byte_order=order, description="padding")
        return
    is_xyz = first.name.endswith("_x")
    if len(group) > 1 and (len(group) == 3) == is_xyz:
        yield _field(first._replace(name=first.name.rpartition("_")[0]), taken, count=len(group))
        return
    for entry in group:
        yield _field(entry, taken)


def _field(entry: _Entry, taken: set[str], **keys) -> Field:
    """A field of an entry; a name that had to be changed is told by the description."""
    name = _unique(_word(entry.name), taken)
    taken.add(name)
    original = clean_text(entry.name)
    description = entry.description or original
    if name != original.lower() and original != description:
        description = f"{description} ({original})"
    return Field(**{"name": name, "description": description, **entry.keys, **keys})


def _word(text: str) -> str:
    """A name of XTCE as a dictionary has names: words of lower-case letters and digits."""
    split = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", text)
    words = re.sub(r"[^a-z0-9]+", "_", split.lower()).strip("_")
    words = words if words[:1].isalpha() else f"n_{words}".rstrip("_")
    return words[:LONGEST_NAME].rstrip("_")


def _unique(name: str, taken) -> str:
    """The name, or one with a number where it is taken."""
    number, made = 2, name
    while made in taken:
        end = f"_{number}"
        made, number = f"{name[: LONGEST_NAME - len(end)].rstrip('_')}{end}", number + 1
    return made
