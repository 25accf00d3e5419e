#!/usr/bin/env python3
"""Counts what makes the code hard to enter: private words for things that the field has a term for, sentences that have to be
read twice, and what is too large. Prints a table; exits 1 when a count is above its limit.

usage: tools/words.py [--where WORD] [--sentences FOLDER] [--self-test]
  tools/words.py --where room                  each line in which it stands
  tools/words.py --sentences src/tactus/rig    comments with 'what' for a noun, or that begin 'Of', and how many
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
SOURCES = (".h", ".cpp", ".cu", ".cuh")
# The field's term: what the project says for it, in code, keys, messages and documents; and where a word has another meaning:
# owners of memory, ghost nodes and files; pieces of triangles, walls and loops, and VTK's; the empty room that cameras see, the room of a headset, and room
# for a particle; patches of a surface and the patch test; a cut that is told apart; kicks and drifts of leapfrog.
TERMS = {
    "collider": (r"owners?|Owner\w*|owner_\w+|\w+_owners?",
                 r"compute/|multi_device/|reconstruct/|tissue/|geom/|rig/|fluid/(split|liquid_)|frame/|world/checkpoint|sim/body/body_(cut|archive)"),
    "component": (r"pieces?|piece_\w+|\w+_pieces?|k?Piece\w*",
                  r"compute/|tissue/|geom/|rig/|track/|fluid/|cli/info|io/vtk_file|mesh_part_kernels|contact/(walls/|obstacles)|"
                  r"world/settle|sim/(body/|cut_score|scene_liquid)|docs/(concepts/(cut_bodies|liquid)|tissue_verification)"),
    "capacity": (r"rooms?|room_\w+|\w+_rooms?", r"rig/|media/|view/|cli/|fluid/|xr/|docs/|io/scene_file"),
    "virtual element": (r"patch(es)?|patch_\w+|\w+_patch(es)?|Patch\w*",
                        r"contact/|reconstruct/|run/|docs/(concepts/contact|tissue_verification|new_material)"),
    "velocity, position correction": (r"kicks?|kick_\w+|\w+_kicks?|Kick\w*", r"tissue/|frame/"),
    "report": (r"tell_\w+|told_\w*|Tell\w*", None),
    "side_stream": (r"beside_", r"track/"),
    "quality level": (r"savings?|saving_\w+|savings_\w+|Saving\w*|hurry|haste", None),
    "predicted": (r"extrapolated|extrapolated_\w+", None),
    "volume ledger": (r"books|books_\w*", None),
    "deficit, priority, suppress": (r"owe_\w+|wish(es)?|wish_\w+|beaten", None),
    "kappa_v, alpha, v_star": (r"kd|inverse_D\w*", r"tissue/"),
    "inverse effective mass": (r"give_1_kg\w*", None),
    "displacement": (r"ways?_m|way_\w+_m", None),
    "invalidate, age": (r"let_go|linger(s|ing)?|lingering_\w+", None),
    "diverged, frozen": (r"is_stopped\w*", None),
    "step parameters": (r"Pace|Moment", None),
    "reference node": (r"leaders?|leader_\w+|Leader\w*", r"track/"),
}
LIMITS = {"'what' for a noun": 60, "sentences that begin 'Of'": 0, "lines of cli/run_command.cpp": 150,
          "dynamic_cast to a source": 0, "folders of more than 40 files": 0, "kernel files of more than 25 kernels": 0,
          "sources of more than 500 lines": 0, "public headers": 25}
# What a kernel of one's own needs (examples/own_kernel): installed beside the public headers.
KERNEL_KIT = ("base/error.h", "base/hd.h", "base/math.h", "base/timing.h", "base/vec.h", "compute/", "multi_device/device_set.h")


def files_below(*folders: str) -> list[pathlib.Path]:
    kinds = (*SOURCES, ".md", ".yaml")
    return [f for folder in folders for f in sorted((ROOT / folder).rglob("*")) if f.suffix in kinds]


def comments_of(text: str) -> str:
    """The text of // and /* */ comments; those of lines that follow one another are one text."""
    found = re.findall(r"(?:[ \t]*///?<?[^\n]*\n)+|//[^\n]*|/\*.*?\*/", text, flags=re.DOTALL)
    return "\n\n".join(re.sub(r"^\s*(?:///?<?|/\*\*?|\*(?!/))|\*/", "", c, flags=re.MULTILINE) for c in found)


def sentences_of(comments: str) -> list[str]:
    blocks = re.split(r"\n\s*\n|@(?:param|returns|throws)\b", comments)
    return [s.strip() for b in blocks for s in re.split(r"(?<=[.!?:;])\s+", " ".join(b.split())) if s.strip()]


def uses_what_for_a_noun(sentence: str) -> bool:
    """"What the run found", "tells what is near": not a question."""
    return bool(re.search(r"\bwhat\b", sentence, re.IGNORECASE)) and not sentence.endswith("?")


def lines_with(pattern: str, files: list[pathlib.Path], elsewhere: str | None = None) -> list[str]:
    """Lines in which a word stands, but for files of `elsewhere`, where it means something else."""
    files = [f for f in files if not (elsewhere and re.search(elsewhere, str(f.relative_to(ROOT))))]
    word = re.compile(rf"(?<![\w.-])(?:{pattern})(?![\w-])")
    return [f"{f.relative_to(ROOT)}:{n}: {line.strip()}" for f in files
            for n, line in enumerate(f.read_text().splitlines(), 1) if word.search(line)]


def sizes() -> dict[str, int]:
    sources = [f for f in files_below("include", "src", "tests", "bench") if f.suffix in SOURCES]
    texts = {f: f.read_text() for f in sources}
    kernels = [len(re.findall(r"^TACTUS_CUDA_KERNEL", t, flags=re.MULTILINE)) for f, t in texts.items() if f.suffix == ".cu"]
    folders = {f.parent for f in sources if "src" in f.parts}
    return {
        "lines of cli/run_command.cpp": len((ROOT / "src/tactus/cli/run_command.cpp").read_text().splitlines()),
        "dynamic_cast to a source": sum(len(re.findall(r"dynamic_cast<[^>]*Source", t)) for t in texts.values()),
        "folders of more than 40 files": sum(sum(f.suffix in SOURCES for f in d.iterdir()) > 40 for d in folders),
        "kernel files of more than 25 kernels": sum(k > 25 for k in kernels),
        "public headers": sum(not str(f.relative_to(ROOT / "include/tactus")).startswith(KERNEL_KIT) for f in files_below("include")),
        "sources of more than 500 lines": sum(len(t.splitlines()) > 500 for t in texts.values()),
    }


def begins_with_of(sentence: str) -> bool:
    return sentence.startswith("Of ")


def sentences_below(folder: str) -> list[tuple[pathlib.Path, str]]:
    return [(f, s) for f in files_below(folder) if f.suffix in SOURCES for s in sentences_of(comments_of(f.read_text()))]


def counts() -> dict[str, int]:
    comments = [s for folder in ("include", "src") for _, s in sentences_below(folder)]
    named = files_below("include", "src", "docs", "scenes")
    return {
        "'what' for a noun": sum(map(uses_what_for_a_noun, comments)),
        "sentences that begin 'Of'": sum(map(begins_with_of, comments)),
        **sizes(),
        **{f"for '{term}'": len(lines_with(pattern, named, elsewhere)) for term, (pattern, elsewhere) in TERMS.items()},
    }


def self_test() -> None:
    comments = comments_of("int a;  // Of the body.\n/// What it found\n/// over all. Is it what?\nint b;\n/* Of a\n * line */\n")
    found = sentences_of(comments)
    assert "Of the body." in found and "What it found over all." in found and "Of a line" in found, found
    assert uses_what_for_a_noun("What it found over all.") and not uses_what_for_a_noun("Is it what?")
    assert re.search(rf"(?<![\w.-])(?:{TERMS['capacity'][0]})(?![\w-])", "too little room for it")
    assert not re.search(rf"(?<![\w.-])(?:{TERMS['capacity'][0]})(?![\w-])", "mushroom")


def main() -> int:
    self_test()
    if sys.argv[1:] == ["--self-test"]:
        return 0
    if sys.argv[1:2] == ["--where"] and len(sys.argv) == 3:
        pattern, elsewhere = next((t for t in TERMS.values() if re.fullmatch(t[0], sys.argv[2])), (re.escape(sys.argv[2]), None))
        print("\n".join(lines_with(pattern, files_below("src", "docs", "scenes"), elsewhere)))
        return 0
    if sys.argv[1:2] == ["--sentences"] and len(sys.argv) == 3:
        wrong = [(f, s) for f, s in sentences_below(sys.argv[2]) if uses_what_for_a_noun(s) or begins_with_of(s)]
        for f, s in wrong:
            print(f"{f.relative_to(ROOT)}: {s}")
        print(len(wrong))
        return 0
    failed = False
    for name, count in counts().items():
        limit = LIMITS.get(name, 0)
        failed |= count > limit
        print(f"{name:42} {count:6}   at most {limit}{'  <-- above' if count > limit else ''}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
