"""The page in a cell of a notebook: what anywidget shows, its messages over the kernel."""

from importlib.util import find_spec
from typing import TYPE_CHECKING

from ..page.standalone import notebook_module

if TYPE_CHECKING:
    from anywidget import AnyWidget

    from .server import PageServer

READY = "ready"
"""What a cell says once it can take frames."""


def widget_of(server: "PageServer") -> "AnyWidget | None":
    """Return a widget that shows the page of a server; None where anywidget is not installed."""
    if find_spec("anywidget") is None:
        return None
    import anywidget

    widget = anywidget.AnyWidget(_esm=notebook_module())

    def hear(frame: bytes) -> None:
        widget.send({}, buffers=[frame])

    def take(_: object, content: object, buffers: object) -> None:
        if content == READY:
            server.attach(hear)
        elif isinstance(content, str):
            server.take(content)

    widget.on_msg(take)
    return widget
