"""Runs of a description that cannot be used although the others can: unreadable, or unlike the others."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from vdyn_cli.description.description_model import Description
from vdyn_cli.description.yaml_source import YamlSource
from vdyn_cli.io.column_names import MissingColumn
from vdyn_cli.project.reading.logger_columns import log_names
from vdyn_cli.project.reading.run_reading import called
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.log import Log


@dataclass(frozen=True)
class LeftOutRun:
    """A run that cannot be used: its index in the description, its name, the problems, and its log if it was read."""

    index: int
    name: str
    problems: tuple[Finding, ...]
    log: Log | None = None


class WrongRunsError(InputError):
    """The input is wrong in some of the runs, ``runs``, and only there."""

    def __init__(self, *findings: Finding, runs: tuple[LeftOutRun, ...] = ()) -> None:
        super().__init__(*findings)
        self.runs = runs


@dataclass(frozen=True)
class RunProblems:
    """Problems of the runs while they are read.

    Parameters
    ----------
    own : by index of the run, what is wrong in it alone. compared : what differs between runs, each at its place.
    """

    own: dict[int, list[Finding]] = field(default_factory=dict)
    compared: list[Finding] = field(default_factory=list)

    def of(self, index: int) -> list[Finding]:
        """The list to which problems of one run are added."""
        return self.own.setdefault(index, [])

    def name_columns_at_runs(self, count: int) -> None:
        """Let the remedy for a column that only some of ``count`` runs lack be a key of these runs.

        A run with other problems, such as a missing log, does not show whether it has the column.
        """
        lacking = {(i, f.channel) for i, own in self.own.items() for f in own if isinstance(f, MissingColumn)}
        number = Counter(channel for _, channel in lacking)
        others = [own for own in self.own.values() if own and not any(isinstance(f, MissingColumn) for f in own)]
        for own in self.own.values():
            for k, one in enumerate(own):
                if isinstance(one, MissingColumn) and number[one.channel] < count - len(others):
                    key = f"write its name at this run, 'columns: {{{one.channel}: NAME}}'"
                    own[k] = replace(one, remedy=f"{key}, since the other runs have {one.got}; {one.remedy}")

    def all(self) -> Iterator[Finding]:
        """Each problem once, of single runs first."""
        yield from dict.fromkeys(f for found in (*self.own.values(), self.compared) for f in found)

    def left_out(
        self, spec: Description, source: YamlSource, logs: Mapping[int, Log], indices: Sequence[int]
    ) -> tuple[LeftOutRun, ...]:
        """The runs that have all problems; none if a problem is not of one run, or no run is without any.

        Parameters
        ----------
        spec, source : the description, and its places. logs : that were read, by index of the run.
        indices : of the runs in the whole description.
        """
        found = {i: list(own) for i, own in self.own.items() if own}
        for one in self.compared:
            name = one.where.partition(", ")[0]
            i = next(
                (i for i, log in logs.items() if log.name == name or source.where(("runs", i)) == one.where),
                None,
            )
            if i is None:
                return ()
            found.setdefault(i, []).append(one)
        if len(found) == len(indices):
            return ()
        return tuple(
            LeftOutRun(indices[i], called(log_names(spec.runs[i])[0], spec.runs[i], spec), tuple(own), logs.get(i))
            for i, own in found.items()
        )
