# SPDX-License-Identifier: Apache-2.0
"""Tests the contents of the add-ons that tests/package/pack.py has packed: package_test.py SOURCE_DIR LIBRARY PACKAGES_DIR."""

import io
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
import unittest
import zipfile
from pathlib import Path

source, library, packages = (Path(argument) for argument in sys.argv[1:])
sys.path[:0] = [str(source / "tools" / "packages"), str(source / "plugin" / "blender")]
import package as addon  # noqa: E402
from bundle import bundle, compiles_for_older_systems, needed, newest_symbols  # noqa: E402

# Runs in a separate process and prints the libraries that it has loaded.
PROGRAM = """
import curlew
with curlew.Session() as session:
    session.run("noise frequency=2\\nnoise frequency=2 seed=1\\ndfvn speed=1\\nscatter count=100\\nadvect duration=0.1\\n")
    print(len(session.points().positions))
print(*sorted({line.split()[-1] for line in open("/proc/self/maps") if ".so" in line}), sep="\\n")
"""

# Finds rays' hits in a mesh, and writes and reads with several libraries.
USE = """
import sys, curlew
with curlew.Session() as session:
    for name in ("a.exr", "a.png"):
        session.run(f"read {sys.argv[1]}\\nshade width=64\\nwrite {sys.argv[2]}/{name}\\nread {sys.argv[2]}/{name}\\n")
    session.run(f"read {sys.argv[1]}\\nmesh2ls dim=24\\nwrite {sys.argv[2]}/a.vdb\\nread {sys.argv[2]}/a.vdb\\n")
    print("used")
"""


def tearDownModule():
    """Removes the unpacked files; the packages stay."""
    unpacked.cleanup()


class Package(unittest.TestCase):
    """Tests both kinds of packages."""

    def skip_unless_static(self):
        """Skips what does not hold with the shared OpenVDB, which brings 300 MB of libraries along."""
        if any("openvdb" in name for name in needed(library)):
            self.skipTest("OpenVDB is not linked statically: ./dev test does, unless its source cannot be fetched")

    def test_the_library_runs_on_what_is_inside(self):
        self.assertTrue(needed(library), "it needs nothing, so there is nothing to test")
        done = subprocess.run([sys.executable, "-B", "-c", PROGRAM], env={"PYTHONPATH": str(inside)}, text=True,
                              capture_output=True, check=True)
        count, *loaded = done.stdout.split()
        self.assertEqual(count, "100")
        names = {Path(path).name for path in loaded}
        for soname, path in needed(library).items():
            self.assertIn(f"curlew-{soname}", names)
            self.assertNotIn(path.name, names - {Path(p).name for p in numpys()}, "the system's is loaded too")

    def test_no_library_looks_for_another_outside(self):
        for file in [inside / "curlew" / "libcurlew.so", *(inside / "curlew" / "lib").iterdir()]:
            self.assertEqual({name for name, path in needed(file).items() if inside not in path.parents}, set(), file)

    def test_its_symbols_bind_to_nothing_that_a_host_has_loaded(self):
        self.skip_unless_static()
        hosts = [next(Path("/usr/lib/x86_64-linux-gnu").glob(pattern)).resolve() for pattern in
                 ("libopenvdb.so.*.*.*", "libboost_iostreams.so.*", "liblog4cplus*.so.?")]
        hosts += needed(library).values()
        with tempfile.TemporaryDirectory() as logs:
            environment = {"PYTHONPATH": str(inside), "LD_PRELOAD": " ".join(map(str, hosts)), "LD_BIND_NOW": "1",
                           "LD_DEBUG": "bindings", "LD_DEBUG_OUTPUT": f"{logs}/log"}
            done = subprocess.run([sys.executable, "-B", "-c", USE, source / "scenes/spot.obj", logs], env=environment,
                                  text=True, capture_output=True, check=True)
            lines = "".join(log.read_text() for log in Path(logs).glob("log*")).splitlines()
        self.assertIn("used", done.stdout)
        ours = [line for line in lines if f"binding file {inside}" in line]
        self.assertGreater(len(ours), 1000)
        names = {path.name for path in hosts}
        bound = [line for line in ours if names & {word.rpartition("/")[2] for word in line.split()}]
        # Templates of the standard library, which every library contains.
        self.assertEqual([line for line in bound if not re.search("`_ZZ?(NK?|T[ISV]N?|GVN)?(St|S[a-z]|9__gnu_cxx)", line)][:3], [])

    def test_it_is_small(self):
        self.skip_unless_static()
        if any("embree" in name for name in needed(library)):
            self.skipTest("Embree 4 is not linked statically")
        self.assertLess(sum(path.stat().st_size for path in (inside / "curlew").rglob("*") if path.is_file()), 60e6)

    def test_it_asks_no_newer_system_than_the_readme_says(self):
        if not compiles_for_older_systems():
            self.skipTest("the C library here is newer than the packages may ask for: make them on Debian 12")
        newest = newest_symbols([inside / "curlew" / "libcurlew.so", *(inside / "curlew" / "lib").iterdir()])
        self.assertLessEqual(newest["GLIBC"], (2, 34))
        self.assertLessEqual(newest["GLIBCXX"], (3, 4, 29))  # GCC 11

    def test_every_bundled_library_has_its_licence(self):
        texts = list(inside.glob("*.dist-info/licenses/*.txt"))
        self.assertTrue(any("openvdb" in text.name for text in texts))
        for text in texts:
            self.assertIn(b"icense", text.read_bytes(), text)

    def test_the_extension_has_the_same_files_in_a_wheel_and_a_manifest(self):
        legacy = {name.partition("/")[2]: data for name, data in contents("legacy").items()}
        extension = contents("linux-x64")
        told = tomllib.loads(extension.pop("blender_manifest.toml").decode())
        self.assertEqual(len(told["wheels"]), 1)
        self.assertRegex(told["wheels"][0], r"^\./wheels/curlew-[0-9.]+-py3-none-manylinux_2_[0-9]+_x86_64\.whl$")
        with zipfile.ZipFile(io.BytesIO(extension.pop(told["wheels"][0][2:]))) as wheel:
            extension.update({name: wheel.read(name) for name in wheel.namelist()})
        self.assertEqual(legacy.keys(), extension.keys())
        self.assertEqual([name for name in legacy if legacy[name] != extension[name]], [])
        self.assertIn("LICENSE", legacy)
        wanted = {"schema_version", "id", "version", "name", "tagline", "maintainer", "type", "blender_version_min", "license"}
        self.assertLessEqual(wanted, told.keys())
        self.assertEqual((told["type"], told["platforms"]), ("add-on", ["linux-x64"]))
        self.assertEqual(told["id"], "curlew")  # without the word Blender, as its site asks
        self.assertLessEqual(len(told["tagline"]), 64)
        self.assertRegex(told["tagline"], r"\w$")
        self.assertLessEqual(len(told["permissions"]["files"]), 64)

    def test_an_update_replaces_the_folder(self):
        """Blender removes the folder before it unpacks an update only if the folder has an entry."""
        with zipfile.ZipFile(next(packages.glob("*-legacy.zip"))) as archive:
            first = archive.infolist()[0]
        self.assertEqual((first.filename, first.external_attr >> 16), ("curlew_blender/", 0o40755))

    def test_the_same_input_gives_the_same_bytes(self):
        bundled, addon.wheel.bundle = addon.wheel.bundle, copied  # a test of its own: it takes half a minute for all libraries
        try:
            with tempfile.TemporaryDirectory() as folder:
                again = addon.wheel.make(library, addon.version(), Path(folder), level=0)  # as in pack.py
                self.assertEqual(again.read_bytes(), next(packages.glob("*.whl")).read_bytes())
                names = Path(folder) / "a.zip", Path(folder) / "b.zip"
                for name in names:
                    addon.write(name, {"b": b"1", "a": bytes(1000)}, 1)
                self.assertEqual(names[0].read_bytes(), names[1].read_bytes())
        finally:
            addon.wheel.bundle = bundled

    def test_bundling_a_library_twice_gives_the_same_bytes(self):
        one = next(path for name, path in needed(library).items() if "OpenEXR" in name)
        with tempfile.TemporaryDirectory() as folder:
            first, second = ([path.read_bytes() for path in bundle(one, Path(folder) / name)] for name in ("a", "b"))
        self.assertGreater(len(first), 1)
        self.assertEqual(first, second)


def copied(_library, folder):
    """Copies the bundle in the packed add-on, in its order."""
    for path in (inside / "curlew" / "lib").iterdir():
        (folder / "lib").mkdir(exist_ok=True)
        shutil.copy(path, folder / "lib" / path.name)
    names = ["libcurlew.so", *sorted(f"lib/{path.name}" for path in (folder / "lib").iterdir()), "curlew"]
    for name in ("libcurlew.so", "curlew"):
        shutil.copy(inside / "curlew" / name, folder / name)
    return [folder / name for name in names]


def contents(kind):
    """Returns the files in a package, by name."""
    with zipfile.ZipFile(next(packages.glob(f"*-{kind}.zip"))) as archive:
        return {name: archive.read(name) for name in archive.namelist() if not name.endswith("/")}


def numpys():
    """Returns the libraries that NumPy alone loads."""
    code = "import numpy\nprint(*{line.split()[-1] for line in open('/proc/self/maps') if '.so' in line})"
    return subprocess.run([sys.executable, "-c", code], text=True, capture_output=True, check=True).stdout.split()


unpacked = tempfile.TemporaryDirectory()
inside = Path(unpacked.name) / "curlew_blender"
with zipfile.ZipFile(next(packages.glob("*-legacy.zip"))) as legacy_file:
    legacy_file.extractall(unpacked.name)
unittest.main(argv=sys.argv[:1])
