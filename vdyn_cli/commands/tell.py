"""How a command writes a line to the user: ``tell(text)``, with the keywords of ``print``."""

from collections.abc import Callable

Tell = Callable[..., None]
