"""Pages in headless Chromium that are watched: they must ask nobody but their server."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from urllib.parse import urlsplit

import pytest

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser"))), None)
#: No sandbox, for tests that run as root; 3D without a graphics card; nothing asked of others.
FLAGS = (
    *("--no-sandbox", "--enable-unsafe-swiftshader", "--disable-quic"),
    *("--no-first-run", "--disable-background-networking", "--disable-component-update"),
    "--disable-sync",
)


@contextmanager
def browser_context(width: int, height: int, patience_ms: float) -> Iterator:
    """A browser's context; what is expected of its pages is waited for so long."""
    from playwright import sync_api

    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=[*FLAGS])
        context = browser.new_context(viewport={"width": width, "height": height})
        context.set_default_timeout(patience_ms)
        sync_api.expect.set_options(timeout=patience_ms)
        yield context
        browser.close()


@contextmanager
def watched_page(context, *refusals: str) -> Iterator:
    """A new page; at the end it must have asked nobody but its server, without errors.

    `refusals`: parts of errors that Chromium reports of refusals, which the page shows.
    """
    page, strangers, errors = context.new_page(), [], []

    def requested(request):
        parts = urlsplit(request.url)
        if parts.scheme not in ("data", "blob") and parts.hostname != "127.0.0.1":
            strangers.append(request.url)

    def said(message):
        if message.type == "error" and not any(part in message.text for part in refusals):
            errors.append(message.text)

    page.on("request", requested)
    page.on("console", said)
    page.on("pageerror", lambda error: errors.append(str(error)))
    yield page
    page.close()
    assert (strangers, errors) == ([], []), (strangers, errors)


def serious_findings(page) -> list[tuple[str, str]]:
    """What axe finds wrong on a page for those who cannot see it or use no mouse: rule, element."""
    axe = pytest.importorskip("axe_core_python.base")
    page.evaluate(axe.AXE_SCRIPT)
    found = page.evaluate("axe.run(document, { resultTypes: ['violations'] })")["violations"]
    return [
        (one["id"], node["html"][:200])
        for one in found
        if one["impact"] in ("serious", "critical")
        for node in one["nodes"]
    ]
