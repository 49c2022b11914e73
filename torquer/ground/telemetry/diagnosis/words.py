"""A diagnosis in sentences: what is wrong, and what the data cannot tell."""

from __future__ import annotations

from torquer.ground.telemetry.calibration import MOST_SHIFT_S
from torquer.ground.telemetry.diagnosis.causes import CAUSES, TIMING
from torquer.ground.telemetry.diagnosis.rows import WORTH_SAYING, Usable
from torquer.ground.telemetry.diagnosis.verdict import LISTED, Diagnosis, Ranked
from torquer.ground.telemetry.reading.read import Finding

_LATE = {"clock": "the clock", "track": "the elements", "lag": "a filter or mean of the sensor"}


def row_findings(usable: Usable) -> list[Finding]:
    """Frozen and saturated rows, where there are enough to be worth saying."""
    found = []
    for key, rows, what in (
        ("frozen", usable.frozen, "stand still for far longer than is usual"),
        ("saturated", usable.saturated, "are at the end of the sensor's range"),
    ):
        count = int(rows.sum())
        if count > WORTH_SAYING * len(rows):
            part = 100.0 * count / len(rows)
            text = f"{count} rows of b_measured ({part:.0f} %) {what}: left out"
            found.append(Finding(key, count, text))
    return found


def mistake(found: Diagnosis, ratio: float) -> Finding | None:
    """What is wrong with the telemetry as it is stated; None if nothing is, or it can be fitted."""
    if found.verdict == "nothing fits":
        return Finding("nothing fits", found.rows, _nothing_fits(found, ratio))
    if found.verdict == "too short" and "stated" not in found.rivals:
        return Finding("cannot tell", found.rows, _cannot_tell(found))
    named = found.named
    if named is None or _is_fitted(named):
        return None
    stated, rest = found.of("stated"), _others(found, named)
    text = (
        f"{CAUSES[named.cause].say(named.value)}: {named.residual_nt:.0f} nT so, "
        f"{stated.residual_nt:.0f} nT as stated, {named.nats:.0f} nats more probable"
    )
    if rest:
        text += f"; next {rest[0].text}, {named.nats - rest[0].nats:.0f} nats below"
    return Finding(CAUSES[named.cause].say(named.value), found.rows, text)


def notes(found: Diagnosis) -> list[Finding]:
    """What a user must know of a diagnosis that is no mistake."""
    made = []
    named = found.named
    if named is not None and _is_fitted(named):
        made.append(Finding("the field is late" if _shift(named) < 0.0 else "the field is early",
                            found.rows, _timing(found, named)))  # fmt: skip
    places = [found.of(each) for each in found.rivals if CAUSES[each].is_place]
    also = [each for each in places if each is not named and abs(_shift(each)) > MOST_SHIFT_S]
    if "stated" in found.rivals and also:
        text = "; ".join(each.text for each in also)
        made.append(Finding("not excluded", 0, f"too short or too still to exclude: {text}"))
    return made


def _is_fitted(named: Ranked) -> bool:
    """Whether it is a shift in time, which the calibration fits."""
    return named.cause in TIMING and abs(_shift(named)) <= MOST_SHIFT_S


def _shift(named: Ranked) -> float:
    """Seconds by which the field is ahead of the stamps; infinite for what is no shift."""
    if named.cause == "lag":
        kind, over_s = named.value
        return -over_s if kind == "filters" else -0.5 * over_s
    return float(named.value) if named.cause in TIMING else float("inf")


def _timing(found: Diagnosis, named: Ranked) -> str:
    if found.rivals == ("lag",):
        return (
            f"{CAUSES['lag'].say(named.value)}: its noise is filtered as the field is, which that "
            "of a late clock would not be; the shift below is this lag"
        )
    who = " or ".join(_LATE[each] for each in TIMING if each in found.rivals)
    return (
        f"the field fits {abs(_shift(named)):.3g} s {'before' if _shift(named) < 0.0 else 'after'} "
        f"the stamps, {named.nats:.0f} nats more probable than as stated: {who}; |B| does not say "
        "which, the shift below holds them together. A filter also shrinks the field of a "
        "satellite that turns: the scale below would then be wrong"
    )


def _others(found: Diagnosis, named: Ranked) -> list[Ranked]:
    apart = TIMING if named.cause in TIMING else (named.cause,)
    return [each for each in found.ranking if each.cause not in apart]


def _ranked(found: Diagnosis) -> str:
    """The best causes, of which those that are no better than the stated explain nothing."""
    told = [each for each in found.ranking if each.nats > 0.0][: LISTED - 1]
    return "; ".join(each.text for each in (*told, found.of("stated")))


def _nothing_fits(found: Diagnosis, ratio: float) -> str:
    text = (
        "nothing fits: elements, satellite, date or columns? A free, smooth field leaves "
        f"{found.floor_nt:.0f} nT, the causes tried: {_ranked(found)}; |B| is {ratio:.3g} times "
        "that of the model"
    )
    plane = found.plane
    if plane is not None and plane.fits:
        text += (
            f"; the same orbit with its node at {plane.node_deg:+.0f} deg and another phase fits "
            f"to {plane.residual_nt:.0f} nT: the elements are too old, or of another satellite"
        )
    return text


def _cannot_tell(found: Diagnosis) -> str:
    if not found.rivals:
        return f"too short to tell what is wrong: {_ranked(found)}"
    rivals = "; ".join(each.text for each in found.ranking if each.cause in found.rivals)
    stated = found.of("stated").residual_nt
    return f"not as stated ({stated:.0f} nT), too short to tell which of: {rivals}"
