#!/usr/bin/env python3
"""What a program file says of how it was built, and of what.

usage: hardening.py PROGRAM [--sbom make_sbom.py] [--commands compile_commands.json] [--project FOLDER]

Full RELRO: a segment GNU_RELRO, and all symbols bound before main() (BIND_NOW). Stack protectors and _FORTIFY_SOURCE leave calls of the
C library's checks; stack clash protection leaves probes ("or $0x0,(%rsp)") in functions with large frames. Position independent, no
executable stack. --commands: every source of src/tactus is compiled with these checks. --project: actions of workflows are named by the hash of their
commit, and SECURITY.md says where to report.
"""
import json
import pathlib
import re
import subprocess
import sys


def output(*command: str) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def sources_in(file: pathlib.Path) -> int:
    """One, or as many as a group of sources includes."""
    return file.read_text().count("#include") if file.name.endswith("_cxx.cxx") else 1


def main() -> int:
    program = sys.argv[1]
    header, segments = output("readelf", "-hW", program), output("readelf", "-lW", program)
    dynamic, symbols = output("readelf", "-dW", program), output("readelf", "-W", "--dyn-syms", program)
    checked = sorted(set(re.findall(r"\b__(\w+)_chk\b", symbols)))
    wrong = []

    def expect(ok: bool, what: str):
        print(("ok    " if ok else "WRONG ") + what)
        if not ok:
            wrong.append(what)

    expect("DYN (" in header, "position independent")
    expect("GNU_RELRO" in segments and re.search(r"BIND_NOW|FLAGS.*\bNOW\b", dynamic) is not None, "full RELRO, bound at once")
    stack = re.search(r"GNU_STACK.*", segments)
    expect(stack is not None and "RWE" not in stack.group(0), "no executable stack")
    expect("__stack_chk_fail" in symbols, "stack protectors")
    expect(len(checked) >= 3, f"_FORTIFY_SOURCE: {', '.join(checked) or 'no checks'}")
    probes = subprocess.run(f"objdump -d --no-show-raw-insn '{program}' | grep -cE 'or[ql]? +\\$0x0,(0x[0-9a-f]+)?\\(%rsp\\)'",
                            shell=True, capture_output=True, text=True, check=False).stdout.strip()
    expect(int(probes or 0) > 0, f"stack clash protection: {probes} probes")
    if "--sbom" in sys.argv:
        sbom = json.loads(output(sys.executable, sys.argv[sys.argv.index("--sbom") + 1], program))
        ids = [p["SPDXID"] for p in sbom["packages"]]
        related = {r["relatedSpdxElement"] for r in sbom["relationships"]}
        libraries = {p["name"] for p in sbom["packages"]}
        expect(sbom["spdxVersion"] == "SPDX-2.3" and len(ids) == len(set(ids)) and related == set(ids), f"SPDX: {len(ids)} parts")
        expect(any(n.startswith("libtbb") for n in libraries) and any(n.startswith("libc6") for n in libraries),
               "SPDX: libtbb and libc6 are among them")
    if "--commands" in sys.argv:
        commands = [c for c in json.loads(pathlib.Path(sys.argv[sys.argv.index("--commands") + 1]).read_text())
                    if "/src/tactus/" in c["file"] and c["file"].endswith((".cpp", "_cxx.cxx"))]  # the latter: groups of sources
        sources = sum(sources_in(pathlib.Path(c["file"])) for c in commands)
        for flag in ("-fstack-protector-strong", "-fstack-clash-protection", "-D_FORTIFY_SOURCE=3", "-ffile-prefix-map="):
            without = sorted({pathlib.Path(c["file"]).name for c in commands if flag not in c["command"]})
            expect(sources > 300 and not without, f"{flag}: {sources} sources" + (f", but not {without[:5]}" if without else ""))
    if "--project" in sys.argv:
        project = pathlib.Path(sys.argv[sys.argv.index("--project") + 1])
        uses = [u for w in (project / ".github" / "workflows").glob("*.yml") for u in re.findall(r"uses:\s*(\S+)", w.read_text())]
        loose = [u for u in uses if not u.startswith("./") and not re.search(r"@[0-9a-f]{40}$", u)]
        expect(len(uses) > 0 and not loose, f"{len(uses)} actions by hash" + (f", but not {loose}" if loose else ""))
        security = (project / "SECURITY.md").read_text()
        expect("report" in security.lower(), "SECURITY.md")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
