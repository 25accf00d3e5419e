#!/usr/bin/env python3
"""The parts of the program as SPDX 2.3 (JSON): libraries that it loads and headers that are compiled in, by Debian's package database.

usage: tools/make_sbom.py PROGRAM ... > tactus.spdx.json

The same programs on the same system give the same bytes but for `created`, which follows SOURCE_DATE_EPOCH where that is set.
"""
import datetime
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
# Header-only libraries leave no name in the program.
COMPILED_IN = ["libcli11-dev", "nlohmann-json3-dev", "libtinygltf-dev", "libtoml++-dev"]


def output(*command: str) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout


def packages_of(files: set[str]) -> set[str]:
    """Packages from before the merge of /lib and /usr/lib know their files by either name."""
    paths = {os.path.realpath(f) for f in files}
    lines = output("dpkg", "-S", *sorted(paths | {p.removeprefix("/usr") for p in paths})).splitlines()
    return {line.split(":")[0] for line in lines if ": /" in line}


def libraries(program: str) -> list[str]:
    return re.findall(r"=> (/\S+)", output("ldd", program))


def version() -> str:
    return re.search(r"project\(tactus VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text()).group(1)


def entry(name: str, number: str, supplier: str, purl: str | None = None, license_name: str = "NOASSERTION") -> dict:
    found = {
        "SPDXID": "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]", "-", name), "name": name, "versionInfo": number, "supplier": supplier,
        "downloadLocation": "NOASSERTION", "filesAnalyzed": False, "licenseConcluded": "NOASSERTION",
        "licenseDeclared": license_name, "copyrightText": "NOASSERTION"
    }
    if purl:
        found["externalRefs"] = [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl", "referenceLocator": purl}]
    return found


def document(programs: list[str]) -> dict:
    names = packages_of({library for program in programs for library in libraries(program)})
    fields = "${Package}\t${Version}\t${Architecture}\t${Maintainer}\n"
    installed = [line.split("\t") for line in output("dpkg-query", "-W", "-f", fields).splitlines()]
    by_name = {i[0]: i for i in installed}
    tactus = entry("tactus", version(), "Organization: the authors of Tactus")
    digest = hashlib.sha256(b"".join(pathlib.Path(p).read_bytes() for p in programs)).hexdigest()
    parts, relations = [], []
    for name in sorted(names) + COMPILED_IN:
        if name not in by_name:
            continue
        _, number, architecture, maintainer = by_name[name]
        purl = f"pkg:deb/debian/{name}@{number}?arch={architecture}".replace("+", "%2B")
        parts.append(entry(name, number, "Organization: " + maintainer.split(" <")[0], purl))
        kind = "STATIC_LINK" if name in COMPILED_IN else "DYNAMIC_LINK"
        relations.append({"spdxElementId": tactus["SPDXID"], "relationshipType": kind, "relatedSpdxElement": parts[-1]["SPDXID"]})
    # The page's renderer is in the program as it is; npm keeps no list of that.
    if any(b"Three.js Authors" in pathlib.Path(p).read_bytes() for p in programs):
        number = re.search(r"^three=(\S+)", (ROOT / "tools/install_deps.sh").read_text(), re.M).group(1)
        parts.append(entry("three", number, "Organization: Three.js Authors", f"pkg:npm/three@{number}", "MIT"))
        relations.append({"spdxElementId": tactus["SPDXID"], "relationshipType": "CONTAINS", "relatedSpdxElement": parts[-1]["SPDXID"]})
    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    created = datetime.datetime.fromtimestamp(int(epoch), datetime.timezone.utc) if epoch else datetime.datetime.now(datetime.timezone.utc)
    return {
        "spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT", "name": f"tactus-{version()}",
        "documentNamespace": f"https://spdx.org/spdxdocs/tactus-{version()}-{digest[:32]}",
        "creationInfo": {"created": created.strftime("%Y-%m-%dT%H:%M:%SZ"), "creators": ["Tool: tools/make_sbom.py"]},
        "packages": [tactus, *parts],
        "relationships": [{"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES",
                           "relatedSpdxElement": tactus["SPDXID"]}, *relations]
    }


def main() -> int:
    if len(sys.argv) < 2:
        print(__doc__)
        return 2
    print(json.dumps(document(sys.argv[1:]), indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
