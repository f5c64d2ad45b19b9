"""The choice `view=NAME`: whether a run is shown while it goes on, and where."""

from contextlib import AbstractContextManager, nullcontext
from typing import Protocol, runtime_checkable

from oio.core.settings import settings
from oio.log import Watcher


@runtime_checkable
class View(Protocol):
    """A frozen description of a viewer."""

    def open(self) -> AbstractContextManager[Watcher | None]:
        """Open the viewer, or what it reads, with the watcher to tell, or None if nobody looks. Raises BadInput if it cannot be."""
        ...


@settings
class NoView:
    """Nobody looks."""

    def open(self) -> AbstractContextManager[Watcher | None]:
        """There is nothing to open."""
        return nullcontext()
