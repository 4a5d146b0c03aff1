"""Every docstring says what it must, and its example runs."""

import doctest
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import penetrode as pn
import penetrode.dask

HERE = Path(__file__).parent.parent


def public():
    """Name and object of everything public, methods among them."""
    for name in pn.__all__:
        thing = getattr(pn, name)
        if name.startswith("__"):
            continue
        yield name, thing
        if inspect.isclass(thing):
            for inner, method in vars(thing).items():
                if not inner.startswith("_") and callable(getattr(thing, inner)):
                    yield f"{name}.{inner}", getattr(thing, inner)
    for name in ("batch", "sweep", "monte_carlo", "Done"):
        yield f"dask.{name}", getattr(penetrode.dask, name)


@pytest.mark.parametrize(("name", "thing"), list(public()))
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_a_docstring_and_its_example(name, thing):
    text = inspect.getdoc(thing)
    assert text and text[0].isupper() and text.splitlines()[0].endswith((".", ":", "?", "(")), name
    is_function = callable(thing) and not inspect.isclass(thing)
    if is_function and inspect.signature(thing).parameters.keys() - {"self", "cls", "ax", "axes"} and name != "Stage.force":
        assert "Parameters\n----------" in text and "Returns\n-------" in text and "Raises\n------" in text, name
    found = doctest.DocTestParser().get_doctest(text, {}, name, None, None)
    runner = doctest.DocTestRunner(verbose=False, optionflags=doctest.ELLIPSIS)
    said = []
    runner.run(found, out=said.append)
    assert runner.summarize(verbose=False).failed == 0, "".join(said)


def test_the_package_has_an_example():
    assert doctest.testmod(pn).failed == 0 and doctest.testmod(pn).attempted > 0


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_the_lines_of_the_readme_run(capsys):
    texts = [(HERE / place).read_text("utf-8") for place in ("README.md", "../README.md")]
    block, same = (text.split("```python\n", 1)[1].split("```", 1)[0] for text in texts)
    assert block == same
    pytest.importorskip("scipy")
    exec(block, {})
    said = capsys.readouterr().out
    assert "V_c        177.949686" in said and "exit-missed" in said


@pytest.mark.parametrize("words", [["mypy.stubtest", "penetrode._penetrode"], ["mypy", "--strict", "-p", "penetrode"]])
def test_types(words, tmp_path):
    pytest.importorskip("mypy")
    config = tmp_path / "mypy.ini"
    config.write_text("[mypy]\n" + "".join(f"[mypy-{name}.*]\nignore_missing_imports = True\n" for name in (
        "dask", "distributed", "matplotlib", "pyarrow", "scipy")))
    option = ["--mypy-config-file" if "stubtest" in words[0] else "--config-file", str(config)]
    done = subprocess.run([sys.executable, "-m", *words, *option], capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr


def test_importing_is_quick_and_needs_no_numpy():
    """50 ms on an idle machine; under load only what is imported can be told."""
    code = "import sys, penetrode; print([name for name in ('numpy', 'pyarrow', 'dask', 'scipy') if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
