"""The reader of formats that store channels as arrays; a format adds how to recognize and open its files."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

from vdyn_cli.io.formats.counted_rows import CountedRows
from vdyn_cli.io.formats.stored_channels import StoredFile, read_stored, recorded
from vdyn_cli.io.reader import ChannelInfo, Column, ReadOptions, Recorded
from vdyn_cli.quantities.log import Log

HEAD = 512  # bytes at the beginning of a file that identify its format


@dataclass(frozen=True)
class StoredReader:
    """Reads the files of one format (see ``io.reader.Reader``).

    Parameters
    ----------
    begins : (first ``HEAD`` bytes, path) -> whether the file is of this format.
    opened : (path) -> context with the open file; raises InputError if a library is missing or the file is damaged.
    """

    begins: Callable[[bytes, Path], bool]
    opened: Callable[[Path], AbstractContextManager[StoredFile]]

    def matches(self, path: Path) -> bool:
        """Whether the file begins like one of this format; False for a file that cannot be opened."""
        try:
            with path.open("rb") as stream:
                head = stream.read(HEAD)
        except (OSError, ValueError):
            return False
        return self.begins(head, path)

    def channels(self, path: Path) -> tuple[ChannelInfo, ...]:
        """Every channel, clocks included.

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
        """The mapped channels, each on its own clock; see ``vdyn_cli.io.reader.Reader.read``.

        Raises
        ------
        InputError : with all problems of the file.
        """
        with self.opened(path) as file:
            counted = file if options.rate is None else CountedRows(file, options.rate)
            return read_stored(counted, mapping, options, name)
