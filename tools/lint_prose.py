#!/usr/bin/env python3
"""What strangers read first can be read once: short sentences and few lines. No document names a file that isn't there.

usage: tools/lint_prose.py [--self-test]
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
MOST_WORDS = 25
# File: the most lines it may have (None: any number).
READ_FIRST = {"README.md": 60, "CONTRIBUTING.md": None, "docs/first_scene.md": None}


def sentences(text: str) -> list[str]:
    """Sentences of the prose in Markdown: without code, tables and pictures; each item of a list is a block."""
    text = re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
    text = re.sub(r"!\[[^\]]*\]\([^)]*\)", "", text)
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)
    text = re.sub(r"`[^`]*`", "code", text)
    blocks: list[str] = [""]
    for line in text.splitlines():
        if not line.strip() or line.startswith(("    ", "|")):
            blocks.append("")
            continue
        if re.match(r"\s*([-*]|\d+\.|#+)\s", line):
            blocks.append("")
            line = re.sub(r"^\s*([-*]|\d+\.|#+)\s+", "", line)
        blocks[-1] += " " + line.strip()
    found = []
    for block in blocks:
        found += [s.strip() for s in re.split(r"(?<=[.!?])\s+", block) if s.strip()]
    return found


def missing_files(text: str, folder: pathlib.Path) -> list[str]:
    """Relative links, and names in code that look like a file of the repository, that lead nowhere."""
    names = re.findall(r"\]\(([^)#:\s]+)\)", text)
    wrong = [n for n in names if not (folder / n).exists()]
    for name in re.findall(r"`((?:include|src|tools|docs|scenes|rigs|tests|bench|examples|cmake)/[\w./-]+)`", text):
        if not (ROOT / name).exists():
            wrong.append(name)
    return wrong


def check(name: str, most_lines: int | None) -> list[str]:
    path = ROOT / name
    text = path.read_text()
    found = [f"{name}: {len(s.split())} words in one sentence, at most {MOST_WORDS}: {s}"
             for s in sentences(text) if len(s.split()) > MOST_WORDS]
    lines = len(text.splitlines())
    if most_lines is not None and lines > most_lines:
        found.append(f"{name}: {lines} lines, at most {most_lines}")
    return found


def self_test() -> None:
    """A long sentence, also over two lines and with a link, and a dead link are found; code and tables are no prose."""
    long = "word " * 14 + "[a\nlink](x.md) " + "word " * 12 + "end."
    assert [len(s.split()) for s in sentences("Short. " + long)] == [1, 29]
    assert sentences("    code " + "x " * 40 + "\n\n| table " + "x " * 40 + "|\n```\n" + "x " * 40 + "\n```\n") == []
    assert missing_files("[x](nowhere.md) [y](https://a.b) `tools/none.py` `tools/lint_prose.py`", ROOT) == [
        "nowhere.md", "tools/none.py"]


def main() -> int:
    self_test()
    if sys.argv[1:] == ["--self-test"]:
        return 0
    found = [line for name, most in READ_FIRST.items() for line in check(name, most)]
    documents = [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")]
    found += [f"{path.relative_to(ROOT)}: names '{name}', which is not there"
              for path in documents for name in missing_files(path.read_text(), path.parent)]
    print("\n".join(found) if found else f"prose: {len(READ_FIRST)} documents can be read once, {len(documents)} name "
          "only files that are there")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
