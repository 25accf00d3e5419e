"""Each snippet of docs/python.md and docs/python_coming_from.md runs as it stands there."""
import os
import pathlib
import re

import pytest

SOURCE = pathlib.Path(os.environ["TACTUS_SOURCE_DIR"]).resolve()
TEXTS = {name: (SOURCE / "docs" / name).read_text() for name in ("python.md", "python_coming_from.md")}
# A snippet's name is the heading before it.
SNIPPETS = [(text[:m.start()].rsplit("\n## ", 1)[1].splitlines()[0], m[1]) for text in TEXTS.values()
            for m in re.finditer(r"^```python\n(.*?)^```", text, re.DOTALL | re.MULTILINE)]


def test_there_are_snippets():
    assert len(SNIPPETS) == sum(text.count("```python") for text in TEXTS.values()) >= 12


@pytest.mark.parametrize("text", [pytest.param(text, id=name) for name, text in SNIPPETS])
def test_a_snippet_runs(text, tmp_path, monkeypatch):
    (tmp_path / "scenes").symlink_to(SOURCE / "scenes")
    monkeypatch.chdir(tmp_path)
    exec(compile(text, "snippet", "exec"), {"__name__": "snippet"})
