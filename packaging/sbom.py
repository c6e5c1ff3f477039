#!/usr/bin/env python3
"""Prints the contents of a package's programs as SPDX 2.3 (JSON): the Debian packages that they are linked to.

usage: sbom.py NAME VERSION SECONDS_SINCE_1970 FOLDER

FOLDER contains the files as they will be installed. Licences come from the table in docs/licences.md.
"""
# SPDX-License-Identifier: Apache-2.0
import datetime
import json
import pathlib
import re
import subprocess
import sys
import uuid

SOURCE = pathlib.Path(__file__).resolve().parent.parent
# Header-only libraries leave no trace in a program, so this table lists them for each program.
COMPILED_IN = {
    "baudgate": ["libasio-dev", "libcli11-dev", "nlohmann-json3-dev", "libjs-dygraphs"],
    "baudgate-dds": ["libasio-dev", "libcli11-dev", "nlohmann-json3-dev"],
}


def run(*words):
    return subprocess.run(words, check=False, capture_output=True, text=True).stdout


def programs(folder):
    for path in sorted(pathlib.Path(folder).rglob("*")):
        if path.is_file() and not path.is_symlink() and path.open("rb").read(4) == b"\x7fELF":
            yield path


def owners(libraries):
    """Returns the Debian packages ("libc6:arm64") of the files; dpkg may know a file by any of its names."""
    names = set()
    for library in libraries:
        real = str(pathlib.Path(library).resolve())
        names |= {library, real, real.removeprefix("/usr"), "/usr" + library}
    return set(re.findall(r"^([a-z0-9+.-]+(?::\w+)?): /", run("dpkg-query", "-S", *sorted(names)), re.MULTILINE))


def loader(files):
    """Returns the dynamic loader of the programs' architecture, because ldd has only that of this machine."""
    return re.search(r"interpreter: (\S+)\]", run("readelf", "-lW", *files)).group(1)


def linked(folder):
    libraries = set()
    files = [str(path) for path in programs(folder)]
    for file in files:
        libraries |= set(re.findall(r"(?:=> |^\s+)(/\S+) \(", run(loader(files), "--list", file), re.MULTILINE))
    return owners(libraries)


def licences():
    """Returns a map from Debian source package to SPDX expression."""
    rows = re.findall(r"^\| `([^`]+)` \|[^|]*\| `([^`]+)` \|", (SOURCE / "docs/licences.md").read_text(), re.MULTILINE)
    return dict(rows)


def package(name, known):
    form = "${Package}\t${Version}\t${source:Package}\t${source:Version}\t${Architecture}"
    binary, version, source, source_version, architecture = run("dpkg-query", "-W", "-f", form, name).split("\t")
    purl = f"pkg:deb/debian/{binary}@{version.replace('+', '%2B')}?arch={architecture}"
    return {
        "SPDXID": "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]", "-", binary),
        "name": binary,
        "versionInfo": version,
        "sourceInfo": f"built from the Debian source package {source} {source_version}",
        "supplier": "Organization: Debian",
        "downloadLocation": "NOASSERTION",
        "filesAnalyzed": False,
        "licenseConcluded": known.get(source, "NOASSERTION"),
        "licenseDeclared": "NOASSERTION",
        "copyrightText": "NOASSERTION",
        "externalRefs": [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl", "referenceLocator": purl}],
    }


def document(name, version, seconds, folder):
    known = licences()
    ours = {
        "SPDXID": "SPDXRef-Package",
        "name": name,
        "versionInfo": version,
        "supplier": "Organization: The baudgate authors",
        "downloadLocation": "NOASSERTION",
        "filesAnalyzed": False,
        "licenseConcluded": "Apache-2.0",
        "licenseDeclared": "Apache-2.0",
        "copyrightText": "2026 The baudgate authors",
    }
    kinds = {each: "DYNAMIC_LINK" for each in linked(folder)} | {each: "STATIC_LINK" for each in COMPILED_IN[name]}
    others = {each: package(each, known) for each in sorted(kinds)}
    relations = [("SPDXRef-DOCUMENT", "DESCRIBES", ours["SPDXID"])]
    relations += [(ours["SPDXID"], kinds[each], made["SPDXID"]) for each, made in others.items()]
    return {
        "spdxVersion": "SPDX-2.3",
        "dataLicense": "CC0-1.0",
        "SPDXID": "SPDXRef-DOCUMENT",
        "name": f"{name}-{version}",
        "documentNamespace": f"urn:uuid:{uuid.uuid5(uuid.NAMESPACE_URL, f'{name}-{version}-{seconds}')}",
        "creationInfo": {
            "created": datetime.datetime.fromtimestamp(int(seconds), datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ"),
            "creators": ["Organization: The baudgate authors", "Tool: packaging/sbom.py"],
        },
        "packages": [ours, *others.values()],
        "relationships": [
            {"spdxElementId": of, "relationshipType": kind, "relatedSpdxElement": to} for of, kind, to in relations
        ],
    }


if __name__ == "__main__":
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    json.dump(document(*sys.argv[1:]), sys.stdout, indent=1)
    print()
