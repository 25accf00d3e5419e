"""Each snippet of docs/python.md runs as it stands there."""
import os
import pathlib
import re

import pytest

SOURCE = pathlib.Path(os.environ["TACTUS_SOURCE_DIR"])
TEXT = (SOURCE / "docs/python.md").read_text()
# A snippet's name is the heading before it.
SNIPPETS = [(TEXT[:m.start()].rsplit("\n## ", 1)[1].splitlines()[0], m[1])
            for m in re.finditer(r"^```python\n(.*?)^```", TEXT, re.DOTALL | re.MULTILINE)]


def test_there_are_snippets():
    assert len(SNIPPETS) == TEXT.count("```python") >= 8


@pytest.mark.parametrize("text", [pytest.param(text, id=name) for name, text in SNIPPETS])
def test_a_snippet_runs(text, tmp_path, monkeypatch):
    (tmp_path / "scenes").symlink_to(SOURCE / "scenes")
    monkeypatch.chdir(tmp_path)
    exec(compile(text, "docs/python.md", "exec"), {"__name__": "snippet"})
