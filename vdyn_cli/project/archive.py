"""The campaigns of an archive: every pipeline, and every test description that no pipeline lists."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from vdyn_cli.description.yaml_source import load_yaml
from vdyn_cli.project.checks.check import step_of
from vdyn_cli.project.pipeline import Task, load_plan
from vdyn_cli.quantities.errors import Finding, InputError

_DESCRIPTIONS = (".yaml", ".yml")


@dataclass(frozen=True)
class ArchivedCampaign:
    """One campaign: its name, its steps in order, and the problems of its description.

    Parameters
    ----------
    name : the description's path relative to the archive, without suffix.
    """

    name: str
    path: Path
    tasks: tuple[Task, ...] = ()
    problems: tuple[Finding, ...] = ()


def archived_campaigns(archives: Sequence[Path]) -> tuple[ArchivedCampaign, ...]:
    """The campaigns in folders (subfolders included) and of single descriptions, in order of their paths.

    YAML files in a folder that describe neither a test nor a pipeline, such as a vehicle's, are ignored; one that
    cannot be read is returned as a campaign with that problem.

    Raises
    ------
    InputError : an archive does not exist, contains no description, or is a file but not a description.
    """
    found: list[ArchivedCampaign] = []
    for archive in archives:
        if not archive.exists():
            raise InputError(Finding(str(archive), "does not exist", remedy="give folders, pipelines or tests"))
        if archive.is_file() and archive.suffix not in _DESCRIPTIONS:
            what = "is neither a folder nor a description of a test or a pipeline (.yaml)"
            raise InputError(Finding(str(archive), what, remedy="write one for a log with 'vdyn init STEP LOG...'"))
        files = [archive]
        if archive.is_dir():
            files = sorted(p for p in archive.rglob("*") if p.suffix in _DESCRIPTIONS and p.is_file())
        root = archive if archive.is_dir() else archive.parent
        more = list(_campaigns(files, root, strict=not archive.is_dir()))
        if not more:
            remedy = "write one with 'vdyn init STEP LOG...'"
            raise InputError(Finding(str(archive), "contains no description of a test or a pipeline", remedy=remedy))
        found += more
    return _distinct(found)


def _campaigns(files: Iterable[Path], root: Path, strict: bool) -> Iterable[ArchivedCampaign]:
    """The campaigns of some files; ``strict``: a file that is no description is reported, since the user named it."""
    listed: set[Path] = set()
    single: list[ArchivedCampaign] = []
    for path in files:
        name = path.relative_to(root).with_suffix("").as_posix()
        try:
            data = load_yaml(path).data
            keys = data if isinstance(data, dict) else {}
            if "pipeline" in keys:
                steps = keys.get("steps")
                listed |= {(path.parent / str(s)).resolve() for s in (steps if isinstance(steps, list) else ())}
                yield ArchivedCampaign(name, path, load_plan(path)[2])
            elif "test" in keys or strict:
                single.append(ArchivedCampaign(name, path, (Task(step_of(path).name, path, ()),)))
        except InputError as error:
            single.append(ArchivedCampaign(name, path, problems=error.findings))
    yield from (one for one in single if one.path.resolve() not in listed)


def _distinct(campaigns: Sequence[ArchivedCampaign]) -> tuple[ArchivedCampaign, ...]:
    """The campaigns, each once; a number is appended to a name that occurred before."""
    found: dict[str, ArchivedCampaign] = {}
    seen: set[Path] = set()
    for one in campaigns:
        if one.path.resolve() in seen:
            continue
        seen.add(one.path.resolve())
        name, again = one.name, 1
        while name in found:
            again += 1
            name = f"{one.name}_{again}"
        found[name] = ArchivedCampaign(name, one.path, one.tasks, one.problems)
    return tuple(found.values())
