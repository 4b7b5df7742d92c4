"""Equal findings of several logs are reported once."""

from __future__ import annotations

import pytest

from vdyn_cli.quantities.errors import Finding, in_file_order, merge_alike, merge_logs, merge_similar


def test_findings_that_differ_in_numbers_alone_are_reported_once() -> None:
    uneven = [Finding(f"slip_{i}.csv, column 'Time'", f"uneven clock: {80 + i} % of steps", "", "r") for i in range(5)]
    other = Finding("slip_1.csv, column 'Fx'", "clipped", "", "r")
    told = merge_similar([*uneven, other])
    assert [f.where for f in told] == ["slip_0.csv and 4 more, column 'Time'", "slip_1.csv, column 'Fx'"]
    assert told[0].what == "uneven clock: 80 to 84 % of steps"
    equal = [Finding(f"slip_{i}.csv", "speed 73 km/h") for i in (0, 1, 1)]
    assert [f.where for f in merge_similar(equal)] == ["slip_0.csv and 1 more"]


@pytest.mark.parametrize(
    ("whats", "where", "what"),
    [
        (("delay -0.19 s +- 0.1 s", "delay +0.12 s +- 0.1 s"), "a_1.csv and 1 more", "delay -0.19 to +0.12 s +- 0.1 s"),
        (("2 s late on a_1.csv", "3 s late on a_2.csv"), "a_1.csv, similarly 1 more", "2 to 3 s late on a_1.csv"),
        (("12 s to 15 s cut", "31 s to 38 s cut"), "a_1.csv, similarly 1 more", "12 s to 15 s cut"),
    ],
)
def test_numbers_that_differ_are_stated_as_a_range(whats: tuple[str, str], where: str, what: str) -> None:
    (told,) = merge_similar([Finding(f"a_{i}.csv", each) for i, each in enumerate(whats, 1)])
    assert (told.where, told.what) == (where, what)


def test_a_wrong_column_of_many_logs_is_reported_once_with_their_names() -> None:
    logs = [f"run_{i}.csv" for i in range(8)]
    what, remedy = "channel 'speed': no such column in ", "did you mean 'V'?"
    wrong = [Finding("t.yaml:7", what + name, "'v'", remedy) for name in logs]
    other = Finding("t.yaml:6", "channel 'time': no such column in run_1.csv", "'t'")
    told = merge_logs([*wrong, other], logs)
    assert [f.what for f in told] == [
        "channel 'speed': no such column in run_0.csv, run_1.csv, run_2.csv and 5 more logs",
        "channel 'time': no such column in run_1.csv",
    ]
    assert told[0].remedy == remedy


def test_a_log_whose_name_is_part_of_another_is_itself() -> None:
    logs = ["a.csv", "day/a.csv", "a.csv.gz"]
    wrong = [Finding("t.yaml:7", f"channel 'speed': no such column in {name}") for name in logs]
    (told,) = merge_logs(wrong, logs)
    assert told.what.endswith("in a.csv, day/a.csv, a.csv.gz")


def test_findings_of_a_description_are_reported_by_line() -> None:
    found = [Finding("t.yaml:12", "a"), Finding("run.csv:3", "b"), Finding("t.yaml:4", "c"), Finding("t.yaml", "d")]
    assert [f.what for f in in_file_order(found, "t.yaml")] == ["c", "a", "b", "d"]


def test_similar_errors_of_many_logs_are_shown_as_one() -> None:
    found = [Finding(f"{k}.csv", f"speed is {k} times as large", "", "check units") for k in range(4)]
    assert [f.where for f in merge_alike(found)] == ["0.csv and 3 more"]
    assert merge_alike(found[:3]) == tuple(found[:3])
