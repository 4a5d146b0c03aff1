"""Why there is no answer."""

from __future__ import annotations


class Error(Exception):
    """What every exception of penetrode is.

    Attributes
    ----------
    message : str
        What is wrong, and where.
    help : str
        What to do about it; may be empty.
    place : tuple of (str, int, int) or None
        File, line and column (from 1), where the fault lies in a text.
    allowed : str
        What is allowed there; may be empty.
    """

    def __init__(
        self,
        message: str,
        help: str = "",
        place: tuple[str, int, int] | None = None,
        allowed: str = "",
    ) -> None:
        super().__init__(message, help, place, allowed)
        self.message = message
        self.help = help
        self.place = place
        self.allowed = allowed

    def __str__(self) -> str:
        # The text of a scene that is underlined holds its help already.
        if not self.help or self.help in self.message:
            return self.message.rstrip()
        return f"{self.message}\n help: {self.help}"


class SceneError(Error, ValueError):
    """A scene that cannot be used; the message underlines the text at fault."""


class TableError(Error, ValueError):
    """A table that cannot be used."""


class OptionError(Error, ValueError):
    """An option or an argument that is not allowed."""


class RunError(Error, RuntimeError):
    """A computation without an answer."""
