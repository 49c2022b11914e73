"""Fields of all kinds for property-based tests, put together so that they make a packet."""

from hypothesis import strategies as st

from torquer.flight.packets.dictionary import Field
from torquer.flight.packets.number_types import TYPES

_NUMBERS = [name for name in TYPES if name not in ("bytes", "pad")]
_finite = st.floats(-1e6, 1e6, allow_subnormal=False).filter(lambda x: abs(x) > 1e-9)


@st.composite
def meanings(draw, kind):
    """What a raw number means: scale and offset, a polynomial, labels, names of bits, or none."""
    choices = ["none"]
    if kind.is_whole:
        choices += ["scale", "polynomial", "labels"] + ["bits"] * (kind.letter == "u")
    choice = draw(st.sampled_from(choices))
    if choice == "scale":
        limits = draw(st.none() | st.just((-1.5, 3.25)))
        return {"scale": draw(_finite), "offset": draw(st.just(0.0) | _finite), "limits": limits}
    if choice == "polynomial":
        return {"polynomial": tuple(draw(st.lists(_finite, min_size=3, max_size=5)))}
    if choice == "labels":
        ends = max(kind.low, -(2**62)), min(kind.high, 2**62)
        numbers = draw(st.sets(st.integers(*ends), min_size=1, max_size=4))
        return {"labels": {number: f"state {number}" for number in sorted(numbers)}}
    if choice == "bits":
        return {"bits": tuple(f"part {k}" for k in range(draw(st.integers(1, kind.bits))))}
    return {"limits": draw(st.none() | st.just((-1.0, 7.5)) | st.just((0.0, 9.0)))}


@st.composite
def any_fields(draw, orders=("little", "big"), whole_bytes=("none",), most=6):
    """Fields of any types; padding joins what must begin, or end, at a whole byte.

    `whole_bytes`: byte orders in which numbers are of whole bytes.
    """
    found, at, order = [], 0, "little"

    def pad():
        nonlocal at
        if at % 8:
            found.append(Field(name="", type="pad", count=-at % 8, byte_order=order,
                               description="padding"))  # fmt: skip
            at += -at % 8

    for number in range(draw(st.integers(1, most))):
        wanted = draw(st.sampled_from(orders))
        kinds = [k for k in _NUMBERS if wanted not in whole_bytes or TYPES[k].bits % 8 == 0]
        name = draw(st.sampled_from([*kinds, "bytes"]))
        if wanted != order or name == "bytes" or wanted in whole_bytes:
            pad()
        if name == "bytes":
            wanted = "little"
        keys = {} if name == "bytes" else {"byte_order": wanted, **draw(meanings(TYPES[name]))}
        if TYPES[name].letter == "i" and draw(st.booleans()):
            keys["unknown"] = "none"
        count = draw(st.integers(1, 4))
        field = Field(name=f"f{number}", type=name, count=count, description=f"the {number}th",
                      **keys)  # fmt: skip
        found.append(field)
        at, order = at + field.bit_size, wanted
    pad()
    return found
