"""The reader of every format that stores its channels as arrays: a format adds how its files begin and are opened."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

from vdyn_cli.io.reader import ChannelInfo, Column, ReadOptions, Recorded
from vdyn_cli.io.stored_channels import StoredFile, read_stored, recorded
from vdyn_cli.quantities.log import Log

HEAD = 64  # bytes at the begin of a file that tell its format


@dataclass(frozen=True)
class StoredReader:
    """Reads the files of one format (see ``io.reader.Reader``).

    Parameters
    ----------
    begins : (first ``HEAD`` bytes, path) -> whether the file is of this format.
    opened : (path) -> its channels, while the file is open. Raises InputError where a library is missing or the file
        is damaged.
    """

    begins: Callable[[bytes, Path], bool]
    opened: Callable[[Path], AbstractContextManager[StoredFile]]

    def matches(self, path: Path) -> bool:
        """Whether the file begins as one of this format does; a file that cannot be opened does not."""
        try:
            with path.open("rb") as stream:
                head = stream.read(HEAD)
        except (OSError, ValueError):
            return False
        return self.begins(head, path)

    def channels(self, path: Path) -> tuple[ChannelInfo, ...]:
        """Every channel, and each clock among them.

        Raises
        ------
        InputError : a library is missing, or the file is damaged.
        """
        return tuple(found.info for found in self.recordings(path))

    def recordings(self, path: Path) -> Iterator[Recorded]:
        """Every channel with its samples."""
        with self.opened(path) as file:
            yield from recorded(file)

    def read(self, path: Path, mapping: Mapping[str, Column], options: ReadOptions, name: str) -> Log:
        """The mapped channels, each on its own clock.

        Raises
        ------
        InputError : with every problem of the file.
        """
        with self.opened(path) as file:
            return read_stored(file, mapping, options, name)
