"""The package itself: types, documentation, and the command that comes with it."""

import doctest
import importlib.util
import inspect
import pathlib
import re
import shutil
import subprocess
import sys
import warnings

import pytest

import handeye
import handeye.servo

FOLDER = pathlib.Path(__file__).parent.parent


def test_the_types_are_those_of_the_code():
    pytest.importorskip("mypy")
    run = subprocess.run([sys.executable, "-m", "mypy.stubtest", "handeye"], capture_output=True, text=True)
    assert run.returncode == 0, run.stdout + run.stderr


def test_everything_is_documented():
    for module in (handeye, handeye.servo):
        for name in set(module.__all__) - {"__version__", "servo"}:
            thing = getattr(module, name)
            assert inspect.getdoc(thing), f"{name} has no docstring"
            members = vars(thing).items() if inspect.isclass(thing) else ()
            for member, value in members:
                if not member.startswith("_") and not isinstance(value, (str, int, float)):
                    assert inspect.getdoc(value), f"{name}.{member} has no docstring"


def test_the_example_of_the_package_runs():
    assert doctest.testmod(handeye).failed == 0


def run_blocks(readme, count, swap=("", "")):
    """Runs the Python code of a text from its first block to its last, and returns the names that it leaves."""
    blocks = re.findall(r"```python\n(.*?)```", readme.read_text().replace(*swap), re.DOTALL)
    assert len(blocks) == count
    names = {}
    for block in blocks:
        exec(compile(block, str(readme), "exec"), names)
    return names


def test_the_code_of_the_readme_runs(tmp_path, monkeypatch, capsys, ur5, motions):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["calibrate_bag.py"])
    # The robot of the bag is one with cameras, which can be simulated.
    spec = importlib.util.spec_from_file_location("calibrate_bag", FOLDER / "examples" / "calibrate_bag.py")
    example = importlib.util.module_from_spec(spec)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what is said of a bag: how joints were interpolated
        spec.loader.exec_module(example)
        example.write_bag(tmp_path / "robot.mcap", ur5, motions)
        names = run_blocks(FOLDER / "README.md", 5, ('"ur3e"', '"ur5"'))
    assert all((tmp_path / name).exists() for name in ("report.html", "arm.html", "arm.toml"))
    assert names["tick"].stop.name == "converged"
    assert abs(names["found"].x - [1.2, 0.7, 0.9]).max() < 1e-6
    assert "px rms" in capsys.readouterr().out


def test_the_code_of_the_projects_readme_runs(tmp_path, monkeypatch, motions, fresh):
    monkeypatch.chdir(tmp_path)
    motions.save("motions.jsonl")
    fresh.save("fresh.jsonl")
    names = run_blocks(FOLDER.parent / "README.md", 1)
    assert names["learned"].converged and (tmp_path / "report.html").exists()


def test_the_command_comes_along():
    script = shutil.which("handeye", path=str(pathlib.Path(sys.executable).parent))
    for command in ([script], [sys.executable, "-m", "handeye"]):
        run = subprocess.run([*command, "--version"], check=True, capture_output=True, text=True)
        assert run.stdout == f"handeye {handeye.__version__}\n"
        wrong = subprocess.run([*command, "calibrate"], capture_output=True, text=True)
        assert wrong.returncode == 2 and "REC" in wrong.stderr
