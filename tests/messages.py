"""Messages of mistakes, so that one test can list all that are not as they should be."""


def message_of(call, *given) -> str:
    """The message with which a call rejects what it is given; "" if it accepts it."""
    try:
        call(*given)
    except ValueError as error:
        return str(error)
    return ""
