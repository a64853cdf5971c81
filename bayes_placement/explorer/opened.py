"""`bp.explore`: open the live page of a model and its measurement."""

import webbrowser
from collections.abc import Callable, Mapping
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from .._shared.arguments import arguments_checked
from .._shared.errors import InfeasibleError, InputError
from ..criticism.missing._candidates import check_experiment
from ..experiment.experiment import Experiment, Measurements
from ..page.standalone import notebook_module

if TYPE_CHECKING:
    from anywidget import AnyWidget

    from .live import LivePage
    from .page_frames import LongSave
    from .server import PageServer
    from .session import Session


class Given(NamedTuple):
    """What a page is about, besides model and measurement."""

    name: str = "model"
    """Name of the model."""
    head: str | None = None
    """Lines of Python that make experiment and measurement; None where the caller has them."""
    folder: Path | None = None
    """Folder of what is kept, or None."""
    fits: Path | None = None
    """Folder of fits, or None."""
    port: int = 0
    """Port, or 0 for a free one."""
    saves: Mapping[str, Callable[["LivePage"], Path]] = MappingProxyType({})
    """What can be saved at once, by its word: each is called with the page, returns the file."""
    report: "LongSave | None" = None
    """How a report is written; None where there is none."""


class Explorer:
    """A live page that is open.

    Parameters
    ----------
    server
        The server of the page.
    words
        What could not be taken up from the last time; mostly empty.

    Examples
    --------
    >>> page = bp.explore(experiment, measured, browser=False)
    >>> page.address.startswith("http://127.0.0.1:")
    True
    >>> page.close()
    """

    def __init__(self, server: "PageServer", words: str = ""):
        self._server, self.words = server, words

    @property
    def address(self) -> str:
        """Address of the page in a browser of this machine."""
        return self._server.address

    @property
    def session(self) -> "Session":
        """What was done on it: states with their models, and the script."""
        return self._server.page.session

    def wait(self) -> None:
        """Wait until it is closed, as a script does that ends then."""
        self._server.wait()

    def close(self) -> None:
        """End the page, its server and its workers; the state is kept."""
        self._server.close()

    def __repr__(self) -> str:
        """Say where it is."""
        return f"Explorer: {self.address}"

    def _repr_html_(self) -> str:
        """Link to where it is."""
        link = f'<a href="{self.address}" target="_blank" rel="noopener">{self.address}</a>'
        return f"<div>{link}</div>"

    def _repr_mimebundle_(self, **settings: Any) -> object:
        """Show the page in a cell where anywidget is installed; else its address is shown."""
        widget = widget_of(self._server)
        return None if widget is None else widget._repr_mimebundle_(**settings)


@arguments_checked
def explore(
    experiment: Experiment,
    measurement: Measurements,
    *,
    baseline: Measurements | None = None,
    store: str | Path | None = None,
    port: int = 0,
    browser: bool = True,
) -> Explorer:
    """Open a page on which the model is compared with what was measured, changed by hand, fitted.

    The page is served by this process to this machine alone. Effects are dropped on the structure
    and dragged along it; responses and the reduced chi-square follow while numbers are moved. Fits
    and searches run in processes of their own. Each step is a line of Python.

    Parameters
    ----------
    experiment
        The model, with its priors.
    measurement
        Measured FRFs, one measurement or one for each force level.
    baseline
        What was measured before, in an earlier state: see `improve`.
    store
        Folder in which the state of the page and fits are kept, so that a later call takes them up.
    port
        Port of the page on 127.0.0.1; 0 for a free one.
    browser
        Whether to open the page in the browser.

    Returns
    -------
    Explorer
        The page: its address, its session, and `close`.

    Raises
    ------
    InputError
        If data and experiment do not match, or there is no noise.
    InfeasibleError
        If modal parameters are observed, of which there are no curves.

    Examples
    --------
    >>> page = bp.explore(experiment, measured, browser=False)
    >>> page.session.states[0].title
    'as drawn'
    >>> page.close()
    """
    folder = None if store is None else Path(store)
    given = Given(folder=folder, fits=folder and folder / "fits", port=port)
    explorer = opened(experiment, measurement, baseline, given)
    if browser:
        webbrowser.open(explorer.address)
    return explorer


def opened(
    experiment: Experiment, measurement: Measurements, baseline: Measurements | None, given: Given
) -> Explorer:
    """Open a page, and take up what was done on it before."""
    # What takes long to import comes once the page stands.
    from .live import LivePage
    from .page_frames import Surroundings
    from .server import PageServer, Post
    from .session import FOLDER, HEAD, Session, kept_page

    check_experiment(experiment, "explore")
    if experiment.observe.is_modal:
        raise InfeasibleError(
            f"{experiment.observe!r} was given; FRFs are needed, since the page shows curves over "
            "frequency. Modal parameters are compared by bayes-placement improve."
        )
    if experiment.noise is None:
        raise InputError(
            "The experiment has noise=None; a noise is needed, since errors are shown in its "
            "deviations: noise=bp.noise.FromCoherence(), or noise.Gaussian(sigma)."
        )
    if baseline is not None:
        from ..criticism.missing._before_and_after import state_of

        state_of(experiment, baseline)  # refused now, rather than by the worker
    folder = given.folder
    session = Session(experiment, measurement, given.head or HEAD)
    place = None if folder is None else folder / FOLDER
    kept = kept_page(place, experiment, measurement, baseline)
    words = kept.take_up(session)
    around = Surroundings(given, baseline, kept)

    def make(send: Callable[[bytes], None], post: Post) -> LivePage:
        return LivePage(session, around, send, post)

    server = PageServer(make, kept.secret(), given.port)
    server.start()
    return Explorer(server, words)


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
