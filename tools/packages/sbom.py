# SPDX-License-Identifier: Apache-2.0
"""Lists the libraries that a package bundles, with versions and licences (a software bill of materials), as SPDX 2.3 JSON.

https://spdx.github.io/spdx-spec/v2.3/
"""

import hashlib
import json
import re
import subprocess
from pathlib import Path
from typing import Dict, Iterable, List

from bundle import owner

# SPDX identifiers of the licences, by source package of Debian. NOASSERTION stands for those that have none, such as
# public domain (xz-utils).
LICENCES = {
    "assimp": "BSD-3-Clause",
    "boost1.74": "BSL-1.0",
    "boost1.83": "BSL-1.0",
    "bzip2": "bzip2-1.0.6",
    "c-blosc": "BSD-3-Clause",
    "draco": "Apache-2.0",
    "embree": "Apache-2.0",
    "fmtlib": "MIT",
    "gcc-12": "GPL-3.0-or-later WITH GCC-exception-3.1",
    "gcc-14": "GPL-3.0-or-later WITH GCC-exception-3.1",
    "imath": "BSD-3-Clause",
    "libpng1.6": "libpng-2.0",
    "libzstd": "BSD-3-Clause",
    "log4cplus": "Apache-2.0 AND BSD-2-Clause",
    "lz4": "BSD-2-Clause",
    "minizip": "Zlib",
    "muparser": "BSD-2-Clause",
    "onetbb": "Apache-2.0",
    "openexr": "BSD-3-Clause",
    "openvdb": "MPL-2.0",
    "snappy": "BSD-3-Clause",
    "zlib": "Zlib",
}


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


def _library(package: str) -> Dict[str, object]:
    fields = _query(package)
    source, version = fields["source"], fields["version"]
    url = f"pkg:deb/debian/{source}@{version}"
    return _package(
        re.sub(r"[^A-Za-z0-9.-]", "-", package), package, version, LICENCES.get(source, "NOASSERTION"),
        homepage=fields["homepage"] or "NOASSERTION", sourceInfo=f"built from Debian's source package {source} {version}",
        externalRefs=[{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl", "referenceLocator": url}])


def sbom(name: str, version: str, libraries: Iterable[Path]) -> bytes:
    """Returns the document of a package with this name and version that bundles these libraries. It depends only on
    them. Raises ValueError if a library belongs to no Debian package."""
    licence = "GPL-3.0-or-later" if name == "curlew_blender" else "Apache-2.0"
    packages: List[Dict[str, object]] = [_package(name, name, version, licence)]
    packages += [_library(package) for package in sorted({owner(path) for path in libraries})]
    digest = hashlib.sha256(json.dumps(packages).encode()).hexdigest()[:32]
    document = {
        "spdxVersion": "SPDX-2.3",
        "dataLicense": "CC0-1.0",
        "SPDXID": "SPDXRef-DOCUMENT",
        "name": f"{name}-{version}",
        "documentNamespace": f"https://spdx.org/spdxdocs/{name}-{version}-{digest}",
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
