"""YAML as data with line numbers; alias bombs, deep nesting and repeated keys are refused."""

from __future__ import annotations

import contextlib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vdyn_cli.description.yaml_source import MAX_BYTES, load_yaml
from vdyn_cli.quantities.errors import InputError

BOMB = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{chr(98 + i)}: &{chr(98 + i)} [{', '.join([f'*{chr(97 + i)}'] * 9)}]\n" for i in range(9)
)


def write(folder: Path, text: str | bytes) -> Path:
    path = folder / "test.yaml"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def test_every_value_has_its_line(tmp_path: Path) -> None:
    source = load_yaml(write(tmp_path, "test: coastdown\nruns:\n  - log: a.csv\n  - log: b.csv\n"))
    assert source.data == {"test": "coastdown", "runs": [{"log": "a.csv"}, {"log": "b.csv"}]}
    assert source.where(("runs", 1, "log")) == "test.yaml:4"
    assert source.where(("runs", 1, "direction")) == "test.yaml:4"
    assert source.where(("nowhere",)) == "test.yaml:1"


def test_anchors_and_merge_keys_work(tmp_path: Path) -> None:
    source = load_yaml(write(tmp_path, "base: &b {unit: s, sign: 1}\nother: {<<: *b, sign: -1}\n"))
    assert source.data["other"] == {"unit": "s", "sign": -1}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (BOMB, "too many values"),
        ("a: " + "[" * 200 + "]" * 200, "nested too deeply"),
        ("[" * 100_000, "nested too deeply|not valid YAML"),
        ("a: 1\nb: 2\na: 3\n", "key 'a' is given twice"),
        ("a: [1, 2\n", "not valid YAML"),
        ("unit: %\n", "write quotes around a text that begins with %, such as unit: '%'"),
        ("a: *missing\n", "not valid YAML"),
        ("? [1, 2]\n: 3\n", "is not a plain text key"),
        ("a: !!python/object/apply:os.system ['true']\n", "is a YAML tag"),
        ("a: &a [*a]\n", "not valid YAML|too many values"),
        ("--- 1\n--- 2\n", "not valid YAML"),
        (b"\xff\xfe\x00a", "not UTF-8|not valid YAML"),
        ("a: \x00", "not valid YAML"),
        ("a: 2001-99-99", "not valid YAML"),
    ],
)
def test_refused_in_words(tmp_path: Path, text: str | bytes, says: str) -> None:
    with pytest.raises(InputError, match=says):
        load_yaml(write(tmp_path, text))


def test_missing_file_names_its_neighbors(tmp_path: Path) -> None:
    (tmp_path / "coastdown.yaml").write_text("test: coastdown")
    with pytest.raises(InputError, match=r"did you mean coastdown\.yaml"):
        load_yaml(tmp_path / "coastdwn.yaml")
    with pytest.raises(InputError, match="there is no folder"):
        load_yaml(tmp_path / "no" / "coastdown.yaml")


def test_folder_and_giant_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is a folder"):
        load_yaml(tmp_path)
    with pytest.raises(InputError, match="too large"):
        load_yaml(write(tmp_path, "a" * (MAX_BYTES + 1)))


@given(st.binary(max_size=200))
def test_any_bytes_are_read_or_refused(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    path = tmp_path_factory.mktemp("yaml") / "test.yaml"
    path.write_bytes(data)
    with contextlib.suppress(InputError):
        load_yaml(path)
