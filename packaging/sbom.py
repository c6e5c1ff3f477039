#!/usr/bin/env python3
"""Prints the contents of a package's programs as SPDX 2.3 (JSON): the programs with their hashes, and the linked Debian packages.

usage: sbom.py NAME VERSION SECONDS_SINCE_1970 FOLDER
       sbom.py --verify FILE FOLDER    compares the programs below FOLDER with the hashes in FILE

FOLDER contains the files as they will be installed. Licences come from the table in docs/licences.md. The hash of a Debian
package comes from the lists of apt; it is left out if the lists do not have the package in this version.
"""
# SPDX-License-Identifier: Apache-2.0
import datetime
import hashlib
import json
import pathlib
import re
import subprocess
import sys
import uuid

SOURCE = pathlib.Path(__file__).resolve().parent.parent
# Header-only libraries leave no trace in a program, so this table lists them for each program.
COMPILED_IN = {
    "baudgate": ["libasio-dev", "libcli11-dev", "nlohmann-json3-dev"],
    "baudgate-dds": ["libasio-dev", "libcli11-dev", "nlohmann-json3-dev"],
}


def run(*words):
    return subprocess.run(words, check=False, capture_output=True, text=True).stdout


def programs(folder):
    for path in sorted(pathlib.Path(folder).rglob("*")):
        if path.is_file() and not path.is_symlink() and path.open("rb").read(4) == b"\x7fELF":
            yield path


def checksums(content):
    """SPDX 2.3 requires SHA-1 for files."""
    return [{"algorithm": name.upper(), "checksumValue": hashlib.new(name, content).hexdigest()} for name in ("sha1", "sha256")]


def files(folder):
    for number, path in enumerate(programs(folder), 1):
        yield {
            "SPDXID": f"SPDXRef-File-{number}",
            "fileName": f"./{path.relative_to(folder)}",
            "fileTypes": ["BINARY"],
            "checksums": checksums(path.read_bytes()),
            "licenseConcluded": "Apache-2.0",
            "copyrightText": "2026 The baudgate authors",
        }


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
    paths = [str(path) for path in programs(folder)]
    for path in paths:
        libraries |= set(re.findall(r"(?:=> |^\s+)(/\S+) \(", run(loader(paths), "--list", path), re.MULTILINE))
    return owners(libraries)


def licences():
    """Returns a map from Debian source package to SPDX expression."""
    rows = re.findall(r"^\| `([^`]+)` \|[^|]*\| `([^`]+)` \|", (SOURCE / "docs/licences.md").read_text(), re.MULTILINE)
    return dict(rows)


def hashes_in_lists(names):
    """Returns a map from (package, version, architecture) to the SHA-256 of the .deb file, by the lists of apt."""
    hashes = {}
    for stanza in run("apt-cache", "show", *sorted(names)).split("\n\n"):
        fields = dict(re.findall(r"^(Package|Version|Architecture|SHA256): (\S+)$", stanza, re.MULTILINE))
        if len(fields) == 4:
            hashes.setdefault((fields["Package"], fields["Version"], fields["Architecture"]), fields["SHA256"])
    return hashes


def reference(locator):
    return [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl", "referenceLocator": locator}]


def package(name, known, hashes):
    form = "${Package}\t${Version}\t${source:Package}\t${source:Version}\t${Architecture}"
    binary, version, source, source_version, architecture = run("dpkg-query", "-W", "-f", form, name).split("\t")
    purl = f"pkg:deb/debian/{binary}@{version.replace('+', '%2B')}?arch={architecture}"
    sha256 = hashes.get((binary, version, architecture))
    return {
        "SPDXID": "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]", "-", binary),
        "name": binary,
        "versionInfo": version,
        "sourceInfo": f"built from the Debian source package {source} {source_version}",
        "supplier": "Organization: Debian",
        "downloadLocation": "NOASSERTION",
        "filesAnalyzed": False,
        **({"checksums": [{"algorithm": "SHA256", "checksumValue": sha256}]} if sha256 else {}),
        "licenseConcluded": known.get(source, "NOASSERTION"),
        "licenseDeclared": "NOASSERTION",
        "copyrightText": "NOASSERTION",
        "externalRefs": reference(purl),
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
        "externalRefs": reference(f"pkg:deb/baudgate/{name}@{version.replace('+', '%2B')}"),
    }
    installed = list(files(folder))
    kinds = {each: "DYNAMIC_LINK" for each in linked(folder)} | {each: "STATIC_LINK" for each in COMPILED_IN[name]}
    hashes = hashes_in_lists(kinds)
    others = {each: package(each, known, hashes) for each in sorted(kinds)}
    # A package contains a file in SPDX only if all its files are listed, so the document describes the programs.
    relations = [("SPDXRef-DOCUMENT", "DESCRIBES", each["SPDXID"]) for each in [ours, *installed]]
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
        "files": installed,
        "relationships": [
            {"spdxElementId": of, "relationshipType": kind, "relatedSpdxElement": to} for of, kind, to in relations
        ],
    }


def verify(path, folder):
    """Returns a sentence for each program that is missing, differs, or is not listed."""
    listed = {each["fileName"]: each["checksums"] for each in json.loads(pathlib.Path(path).read_text())["files"]}
    found = {each["fileName"]: each["checksums"] for each in files(folder)}
    return [f"{name}: its hash differs" for name in sorted(listed.keys() & found.keys()) if listed[name] != found[name]] + \
        [f"{name}: not there" for name in sorted(listed.keys() - found.keys())] + \
        [f"{name}: not listed" for name in sorted(found.keys() - listed.keys())] + ([] if listed else [f"{path}: lists no program"])


if __name__ == "__main__":
    if sys.argv[1:2] == ["--verify"] and len(sys.argv) == 4:
        sys.exit("\n".join(verify(*sys.argv[2:])) or 0)
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    json.dump(document(*sys.argv[1:]), sys.stdout, indent=1)
    print()
