"""The overview of the tables: every table has a program that can be started, and a row."""

from importlib.util import find_spec

from tests.bench.tables import TABLES, Made, page


def test_every_table_has_its_program_and_a_row() -> None:
    results = [Made(t, f"python -m tests.bench.{t.name}", 1.0, 0) for t in TABLES]
    assert all(find_spec(f"tests.bench.{t.name}") for t in TABLES)
    text = page(results, "abc1234")
    assert "of commit abc1234" in text
    assert all(f"[{t.name}.md]({t.name}.md)" in text for t in TABLES)


def test_a_table_that_could_not_be_made_says_so() -> None:
    assert "failed with exit code 3" in page([Made(TABLES[0], "hidden", 1.0, 3)], "abc1234")
