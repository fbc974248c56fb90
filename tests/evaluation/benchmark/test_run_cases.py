"""Cases are measured in processes, and not again where an output folder has them."""

import json

import pytest
from builders.errors import refuses

from doo3d.errors import ConfigError
from doo3d.evaluation.benchmark.cases import Case
from doo3d.evaluation.benchmark.run import JOURNAL, run_cases


def itself():
    return None


def measured(case):
    return [case.record({"correct": True, "value": float(case.name)})]


CASES = [Case(str(k), "f", itself) for k in range(4)]


def test_several_processes_give_the_same_records_in_the_same_order():
    assert run_cases(measured, CASES, workers=2) == run_cases(measured, CASES)


def test_cases_of_an_output_folder_are_not_measured_again(tmp_path):
    asked = []

    def measure(case):
        asked.append(case.name)
        return measured(case)

    first = run_cases(measure, CASES[:3], journal=(tmp_path, {"mask": "given"}))
    with (tmp_path / JOURNAL).open("a") as file:
        file.write('{"case": ["f", "3"], "rec')  # the program was ended here
    asked.clear()
    rows = run_cases(measure, CASES, journal=(tmp_path, {"mask": "given"}))
    assert set(asked) == {"3"}
    assert rows[:3] == first
    assert rows[0].case is CASES[0]
    assert len((tmp_path / JOURNAL).read_text().splitlines()) == 5
    asked.clear()
    assert run_cases(measure, CASES, journal=(tmp_path, {"mask": "given"})) == rows
    assert asked == []


def test_results_of_other_settings_are_refused(tmp_path):
    run_cases(measured, CASES, journal=(tmp_path, {"mask": "given"}))
    with refuses("options-conflict", "another mask", kind=ConfigError):
        run_cases(measured, CASES, journal=(tmp_path, {"mask": "auto"}))


@pytest.mark.parametrize("text", ["no JSON\n", json.dumps({"mask": "given"}) + "\n{}\n"])
def test_a_damaged_journal_is_named(tmp_path, text):
    (tmp_path / JOURNAL).write_text(text)
    with refuses("results-damaged", JOURNAL):
        run_cases(measured, CASES, journal=(tmp_path, {"mask": "given"}))
