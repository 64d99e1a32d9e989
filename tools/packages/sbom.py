# SPDX-License-Identifier: Apache-2.0
"""Lists the libraries whose code a package contains, with versions and licences (a software bill of materials), as SPDX 2.3 JSON.

https://spdx.github.io/spdx-spec/v2.3/

    tools/packages/sbom.py --version 0.2.0 --out sbom.spdx.json

writes that of the Debian package, which contains the code of headers and of static libraries.
"""

import argparse
import hashlib
import json
import re
import subprocess
from pathlib import Path
from typing import Dict, Iterable, List

NOTICE = Path(__file__).resolve().parents[2] / "NOTICE"


def _licences() -> Dict[str, str]:
    """Returns the licences in NOTICE's table, by source package of Debian."""
    rows = [re.split(" {2,}", line.strip()) for line in NOTICE.read_text().splitlines() if line.startswith("  ")]
    return {source: licence for _library, licence, _user, sources in rows for source in sources.split(", ")}


def _query(package: str) -> Dict[str, str]:
    fields = {"source": "${source:Package}", "version": "${source:Version}", "homepage": "${Homepage}"}
    text = subprocess.run(["dpkg-query", "--show", "--showformat", "\\t".join(fields.values()) + "\\n", package],
                          capture_output=True, text=True, check=True).stdout
    return dict(zip(fields, text.splitlines()[0].split("\t")))


def _package(identifier: str, name: str, version: str, licence: str, **more: object) -> Dict[str, object]:
    return {
        "SPDXID": f"SPDXRef-{identifier}",
        "name": name,
        "versionInfo": version,
        "downloadLocation": "NOASSERTION",
        "filesAnalyzed": False,
        "licenseConcluded": "NOASSERTION",
        "licenseDeclared": licence,
        "copyrightText": "NOASSERTION",
        **more,
    }


def _library(package: str, licences: Dict[str, str]) -> Dict[str, object]:
    fields = _query(package)
    source, version = fields["source"], fields["version"]
    licence = licences.get(source, "NOASSERTION")
    if licence == "public domain":  # has no SPDX identifier
        licence = "NOASSERTION"
    url = f"pkg:deb/debian/{source}@{version}"
    return _package(
        re.sub(r"[^A-Za-z0-9.-]", "-", package), package, version, licence,
        homepage=fields["homepage"] or "NOASSERTION", sourceInfo=f"built from Debian's source package {source} {version}",
        externalRefs=[{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl", "referenceLocator": url}])


def sbom(version: str, contained: Iterable[str]) -> bytes:
    """Returns the document of Curlew in this version with code of these Debian packages. It depends only on them."""
    licences = _licences()
    packages: List[Dict[str, object]] = [_package("curlew", "curlew", version, "Apache-2.0")]
    packages += [_library(package, licences) for package in contained]
    digest = hashlib.sha256(json.dumps(packages).encode()).hexdigest()[:32]
    document = {
        "spdxVersion": "SPDX-2.3",
        "dataLicense": "CC0-1.0",
        "SPDXID": "SPDXRef-DOCUMENT",
        "name": f"curlew-{version}",
        "documentNamespace": f"https://spdx.org/spdxdocs/curlew-{version}-{digest}",
        # A time of its own would make each document a different one.
        "creationInfo": {"created": "1980-01-01T00:00:00Z", "creators": [f"Tool: curlew-{version}"]},
        "packages": packages,
        "relationships": [
            {"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES", "relatedSpdxElement": packages[0]["SPDXID"]},
            *({"spdxElementId": packages[0]["SPDXID"], "relationshipType": "CONTAINS", "relatedSpdxElement": p["SPDXID"]}
              for p in packages[1:]),
        ],
    }
    return (json.dumps(document, indent=2) + "\n").encode()


def main() -> None:
    from bundle import contained

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--version", required=True)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    options.out.write_bytes(sbom(options.version, contained([])))


if __name__ == "__main__":
    main()
