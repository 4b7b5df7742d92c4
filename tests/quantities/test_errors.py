"""Equal findings of several logs are reported once."""

from __future__ import annotations

from vdyn_cli.quantities.errors import Finding, in_file_order, merge_alike, merge_logs, merge_similar


def test_findings_that_differ_in_numbers_alone_are_reported_once() -> None:
    uneven = [Finding(f"slip_{i}.csv, column 'Time'", f"uneven clock: {80 + i} % of steps", "", "r") for i in range(5)]
    other = Finding("slip_1.csv, column 'Fx'", "clipped", "", "r")
    told = merge_similar([*uneven, other])
    assert [f.where for f in told] == ["slip_0.csv, similarly 4 more, column 'Time'", "slip_1.csv, column 'Fx'"]
    equal = [Finding(f"slip_{i}.csv", "speed 73 km/h") for i in (0, 1, 1)]
    assert [f.where for f in merge_similar(equal)] == ["slip_0.csv and 1 more"]


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
    assert [f.where for f in merge_alike(found)] == ["0.csv, similarly 3 more"]
    assert merge_alike(found[:3]) == tuple(found[:3])
