"""YAML as data with the line of every key; refuses alias bombs, deep nesting and repeated keys."""

from __future__ import annotations

import errno
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import yaml

from vdyn_cli.quantities.errors import Finding, InputError, did_you_mean
from vdyn_cli.quantities.input_file import read_regular, unreadable

Location = tuple[str | int, ...]

MAX_BYTES = 1_000_000
_SYNTAX = "check indentation, colons, brackets and quotes there and in the line above"
_SUFFIXES = (".yaml", ".yml")
MAX_DEPTH = 30
_WRITTEN = "vdyn/"  # begins the format of every JSON document of vdyn
_FROM_LOG = "'vdyn init STEP LOG -o TEST.yaml' writes a description"
MAX_NODES = 50_000


@dataclass(frozen=True)
class YamlSource:
    """A YAML file's data, the place of each value (``coast.yaml:12``), and the files included in it.

    ``digests`` are the sha256 of each file.
    """

    path: Path
    data: Any
    lines: Mapping[Location, str]
    included: tuple[Path, ...] = ()
    digests: Mapping[Path, str] = field(default_factory=dict)

    def where(self, location: Location) -> str:
        """The place (file and line) of a value; if the file does not have it, of the nearest part around it."""
        for end in range(len(location), -1, -1):
            place = self.lines.get(location[:end])
            if place:
                return place
        return self.path.name

    def without(self, key: str, left_out: Collection[int]) -> YamlSource:
        """The source without some entries of a list; the places of the others are kept under their new index."""
        kept = [i for i in range(len(self.data[key])) if i not in left_out]
        new = {old: i for i, old in enumerate(kept)}
        lines = {
            (key, new[int(at[1])], *at[2:]) if at[:1] == (key,) and len(at) > 1 else at: place
            for at, place in self.lines.items()
            if at[:1] != (key,) or len(at) < 2 or at[1] in new
        }
        return replace(self, data={**self.data, key: [self.data[key][i] for i in kept]}, lines=lines)


def load_yaml(path: Path) -> YamlSource:
    """Read one YAML document.

    Raises
    ------
    InputError : the file is missing, too large, not UTF-8, not YAML, nested too deeply, expands to too many values, has
        a repeated key, or is of another kind, such as a log or a result.
    """
    named_so = path.suffix.lower() in _SUFFIXES or not _is_file(path)
    try:
        source = _loaded(path)
    except InputError:
        if named_so:
            raise
    else:
        _refuse_result(source)
        if named_so or isinstance(source.data, dict):
            return source
    what = "is not a description of a test, which is a YAML file"
    raise InputError(Finding(str(path), what, remedy=f"for a log, {_FROM_LOG}")) from None


def _refuse_result(source: YamlSource) -> None:
    """Refuse a JSON document that vdyn wrote, in one finding instead of one for each of its keys."""
    data = source.data if isinstance(source.data, dict) else {}
    if str(data.get("format", "")).startswith(_WRITTEN):
        what = f"is a result of vdyn {data.get('step', '')}".rstrip() + ", not a description of a test"
        remedy = "name the YAML file of the test; a step reads the result of another one with '--known RESULT.json'"
        raise InputError(Finding(str(source.path), what, remedy=remedy))


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # a name that is too long
        return False


def _loaded(path: Path) -> YamlSource:
    text, digest = _read_text(path)
    try:
        _refuse_bombs(text, path)
        loader = yaml.SafeLoader(text)
        try:
            node = loader.get_single_node()
            if node is None:
                raise InputError(Finding(str(path), "is empty", remedy=_FROM_LOG))
            walker = _Walker(path, loader)
            data = walker.value(node, ())
        finally:
            loader.dispose()
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        what = f"is not valid YAML: {error.problem or error.context}"
        sign = next((s for s in "%@`" if f"'{s}' that cannot start" in what), "")
        quotes = f"write quotes around a text that begins with {sign}, such as unit: '{sign}'" if sign else ""
        tab = "indent with blanks instead of tabs" if "'\\t'" in what else ""
        remedy = quotes or tab or _SYNTAX
        raise InputError(Finding(_line(path, mark), what, remedy=remedy)) from None
    except (yaml.YAMLError, ValueError, RecursionError, OverflowError) as error:
        what = f"is not valid YAML: {str(error).splitlines()[0][:100]}"
        raise InputError(Finding(path.name, what, remedy=_SYNTAX)) from None
    if walker.findings:
        raise InputError(*walker.findings)
    return YamlSource(path, data, walker.lines, digests={path: digest})


def _line(path: Path, mark: Any) -> str:
    return f"{path.name}:{mark.line + 1}" if mark else path.name


def _read_text(path: Path) -> tuple[str, str]:
    """The text of a file, and the sha256 of its bytes."""
    try:
        data = read_regular(path, MAX_BYTES)
        return data.decode("utf-8-sig"), sha256(data).hexdigest()
    except FileNotFoundError:
        raise InputError(Finding(str(path), "does not exist", remedy=_neighbors(path))) from None
    except IsADirectoryError:
        inside = [f"'{p}'" for p in sorted(path.iterdir()) if p.suffix in _SUFFIXES][:3]
        remedy = f"name a description in it, such as {' or '.join(inside)}" if inside else "name a description (.yaml)"
        raise InputError(Finding(str(path), "is a folder", remedy=remedy)) from None
    except OSError as error:
        if error.errno == errno.EFBIG:
            what = "is too large for a test description"
            raise InputError(Finding(str(path), what, str(error.strerror), "name a description, not a log")) from None
        raise unreadable(path, error) from None
    except UnicodeDecodeError:
        raise InputError(Finding(str(path), "is not UTF-8 text", remedy="save the file as UTF-8")) from None


def _neighbors(path: Path) -> str:
    try:
        names = [p.name for p in path.parent.iterdir()]
    except OSError:
        return f"there is no folder {path.parent}"
    return did_you_mean(path.name, names, "check the path")


def _refuse_bombs(text: str, path: Path) -> None:
    """Check depth and size on the stream of events, which needs no recursion, before any object is built."""
    depth = 0
    for nodes, event in enumerate(yaml.parse(text, Loader=yaml.SafeLoader)):
        if isinstance(event, (yaml.MappingStartEvent, yaml.SequenceStartEvent)):
            depth += 1
        elif isinstance(event, (yaml.MappingEndEvent, yaml.SequenceEndEvent)):
            depth -= 1
        if depth > MAX_DEPTH or nodes > MAX_NODES:
            what = "is nested too deeply" if depth > MAX_DEPTH else "has too many values"
            what = f"{what} for a test description"
            raise InputError(Finding(_line(path, event.start_mark), what, remedy="name a description, not a result"))


class _Walker:
    """Builds plain data from the node graph, and counts the values to which aliases expand."""

    def __init__(self, path: Path, loader: yaml.SafeLoader) -> None:
        self.path, self.loader = path, loader
        self.lines: dict[Location, str] = {}
        self.findings: list[Finding] = []
        self.nodes = 0

    def place(self, node: yaml.Node) -> str:
        return _line(self.path, node.start_mark)

    def value(self, node: yaml.Node, location: Location) -> Any:
        self.nodes += 1
        if self.nodes > MAX_NODES or len(location) > MAX_DEPTH:
            what = "expands to too many values (aliases of aliases)"
            raise InputError(Finding(self.place(node), what, remedy="write the values in place of the aliases"))
        self.lines[location] = self.place(node)
        if node.tag.rsplit(":", 1)[0] != "tag:yaml.org,2002":
            what = "is a YAML tag, which descriptions do not support"
            raise InputError(Finding(self.place(node), what, node.tag, "write a plain value"))
        if isinstance(node, yaml.MappingNode):
            return self.mapping(node, location)
        if isinstance(node, yaml.SequenceNode):
            return [self.value(child, (*location, i)) for i, child in enumerate(node.value)]
        if ":" in node.value and node.tag.endswith((":int", ":float")):
            return node.value  # 10:08 is a time of day, not YAML 1.1's number 608
        return self.loader.construct_object(node)

    def mapping(self, node: yaml.MappingNode, location: Location) -> dict[str, Any]:
        self._refuse_repeats(node)
        self.loader.flatten_mapping(node)  # merge keys (<<) come first, the mapping's own replace them
        result: dict[str, Any] = {}
        for key_node, child in node.value:
            if not isinstance(key_node, yaml.ScalarNode):
                self.findings.append(
                    Finding(self.place(key_node), "is not a plain text key", remedy="write 'key: value'")
                )
                continue
            key = str(key_node.value)
            result[key] = self.value(child, (*location, key))
            self.lines[(*location, key)] = self.place(key_node)
        return result

    def _refuse_repeats(self, node: yaml.MappingNode) -> None:
        first: dict[str, yaml.Node] = {}
        for key_node, _ in node.value:
            key = str(key_node.value)
            if key in first:
                got = f"first at {self.place(first[key])}"
                self.findings.append(Finding(self.place(key_node), f"key '{key}' is given twice", got, "remove one"))
            first.setdefault(key, key_node)
