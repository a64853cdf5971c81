"""A real browser for tests: Chromium of the system, without a network."""

import shutil
from contextlib import contextmanager

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
ARGUMENTS = ["--no-sandbox", "--disable-gpu", "--disable-background-networking"]


@contextmanager
def pages(**settings):
    """Give a function that opens a file of this machine in a new page.

    Console messages, errors and requests for anything but the file are in the list `page.trouble`.
    """
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="playwright is not installed: pip install playwright"
    )
    program = next(filter(None, map(shutil.which, NAMES)), None)
    if program is None:
        pytest.skip("there is no Chromium on this machine: apt-get install chromium")
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=program, args=ARGUMENTS)
        context = browser.new_context(
            offline=True, viewport={"width": 1200, "height": 900}, **settings
        )

        def opened(path):
            page, address = context.new_page(), path.resolve().as_uri()
            page.trouble = []
            page.on("console", lambda message: page.trouble.append(message.text))
            page.on("pageerror", lambda error: page.trouble.append(str(error)))
            page.on(
                "request",
                lambda request: (
                    request.url.startswith((address, "data:", "blob:"))
                    or page.trouble.append(request.url)
                ),
            )
            page.goto(address)
            return page

        yield opened
        browser.close()
