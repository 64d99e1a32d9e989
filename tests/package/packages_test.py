# SPDX-License-Identifier: Apache-2.0
"""Makes the portable archive and the Debian package, and runs the contents of the archive and of a wheel:
packages_test.py SOURCE_DIR BUILD_DIR VERSION PACKED, where PACKED contains the wheel and the Blender add-ons.
"""

import json
import os
import re
import subprocess
import sys
import tarfile
import tempfile
import unittest
import zipfile
from pathlib import Path

source, build, version, packed = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3], Path(sys.argv[4])
sys.path[:0] = [str(source / "tools" / "packages")]
import portable  # noqa: E402
import wheel  # noqa: E402
from bundle import compiles_for_older_systems, contained, newest_symbols  # noqa: E402

PROGRAM = """
import curlew
with curlew.Session() as session:
    session.run("noise frequency=2\\nnoise frequency=2 seed=1\\ndfvn speed=1\\nscatter count=100\\nadvect duration=0.1\\n")
    print(len(session.points().positions))
print(*sorted({line.split()[-1] for line in open("/proc/self/maps") if ".so" in line}), sep="\\n")
"""


def run(*words, **more):
    """Returns the output of a program that does not see the user's settings."""
    done = subprocess.run([str(w) for w in words], env={"PATH": "/usr/bin:/bin", "HOME": "/"}, text=True,
                          capture_output=True, **more)
    if done.returncode != 0:
        raise AssertionError(f"{words}: {done.stderr}{done.stdout}")
    return done.stdout


class Sbom:
    """Checks the bill of materials of both packages."""

    def check_sbom(self, text, names):
        document = json.loads(text)
        self.assertEqual(document["spdxVersion"], "SPDX-2.3")
        identifiers = [package["SPDXID"] for package in document["packages"]]
        self.assertEqual(len(identifiers), len(set(identifiers)))
        related = {r["relatedSpdxElement"] for r in document["relationships"]}
        self.assertEqual(related, set(identifiers))
        self.assertTrue(all(package["versionInfo"] for package in document["packages"]))
        licences = {package["name"]: package["licenseDeclared"] for package in document["packages"]}
        self.assertEqual(next(licence for name, licence in licences.items() if "openvdb" in name), "MPL-2.0")
        self.assertLessEqual([name for name, licence in licences.items() if licence == "NOASSERTION"], ["liblzma5"])
        self.assertIn("libkissfft-dev", licences)  # a header
        self.assertEqual(set(licences) - {"curlew"}, names)


class Wheel(unittest.TestCase, Sbom):
    """Tests the wheel, installed in a virtual environment."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.top = Path(cls.folder.name)
        cls.wheel = next(packed.glob("*.whl"))
        run(sys.executable, "-m", "venv", "--system-site-packages", "--without-pip", cls.top / "venv")
        pip = next(Path("/usr/share/python-wheels").glob("pip-*.whl")) / "pip"  # its own wheel, which installing it takes seconds
        run(cls.top / "venv/bin/python", pip, "install", "--no-index", "--no-deps", "--no-compile", cls.wheel)
        cls.site = next((cls.top / "venv").glob("lib/python*/site-packages"))
        cls.executable = os.access(cls.site / "curlew/curlew", os.X_OK)  # before the package is loaded

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_runs_with_its_own_libraries(self):
        count, *loaded = run(self.top / "venv/bin/python", "-B", "-c", PROGRAM).split()
        self.assertEqual(count, "100")
        ours = {Path(path).name for path in loaded if self.site in Path(path).parents}
        self.assertIn("libcurlew.so", ours)
        self.assertTrue(any(name.startswith("curlew-libOpenEXR") for name in ours), ours)
        self.assertFalse([p for p in loaded if re.search("libopenvdb|libOpenEXR", p) and self.site not in Path(p).parents])

    def test_runs_an_example(self):
        with tempfile.TemporaryDirectory() as work:
            text = run(self.top / "venv/bin/python", "-B", source / "plugin/python/examples/particles.py", cwd=work)
            self.assertIn(" 0 of them inside the cube", text)
            self.assertTrue((Path(work) / "particles.npy").is_file())

    def test_the_reader_process_runs(self):
        self.assertTrue(self.executable)
        self.assertIn(version, run(self.site / "curlew/curlew", "-version"))

    def test_its_tag_is_what_its_files_need(self):
        files = [p for p in (self.site / "curlew").rglob("*") if p.is_file() and p.read_bytes()[:4] == b"\x7fELF"]
        self.assertIn(f"py3-none-{wheel.platform_tag(files)}.whl", self.wheel.name)
        if compiles_for_older_systems():
            self.assertTrue(self.wheel.name.endswith("manylinux_2_34_x86_64.whl"), self.wheel.name)

    def test_every_bundled_library_has_its_licence_and_is_listed(self):
        info = next(self.site.glob("curlew-*.dist-info"))
        licences = {p.stem for p in (info / "licenses").glob("*.txt")}
        self.assertGreater(len(licences), 10)
        self.check_sbom((info / "sboms/curlew.spdx.json").read_text(), licences)

    def test_the_same_input_gives_the_same_names_and_digests(self):
        with zipfile.ZipFile(self.wheel) as archive:
            recorded = archive.read(f"curlew-{version}.dist-info/RECORD").decode().splitlines()
            self.assertEqual([line.split(",")[0] for line in recorded], archive.namelist())
            self.assertTrue(all(entry.date_time == (1980, 1, 1, 0, 0, 0) for entry in archive.infolist()))


class Portable(unittest.TestCase, Sbom):
    """Tests the portable archive, unpacked in a temporary folder."""

    @classmethod
    def setUpClass(cls):
        if not compiles_for_older_systems():
            raise unittest.SkipTest("the C library here is newer than the archive may ask for: make it on Debian 12")
        cls.folder = tempfile.TemporaryDirectory()
        archive = portable.make(build, version, Path(cls.folder.name), level=0)
        with tarfile.open(archive) as tar:
            tar.extractall(cls.folder.name)
        archive.unlink()
        cls.top = next(Path(cls.folder.name).iterdir())

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_no_file_looks_outside_for_anything_but_the_runtime(self):
        for file in [self.top / "bin/curlew", self.top / "lib/libcurlew.so"]:
            for line in run("ldd", file).splitlines():
                path = line.partition(" => ")[2].partition(" (")[0]
                if path and self.top not in Path(path).parents:
                    self.assertRegex(Path(path).name, r"^(linux-vdso|ld-linux|lib(c|m|dl|rt|pthread|gcc_s|stdc\+\+|z)[.-])")

    def test_the_command_makes_the_demo(self):
        with tempfile.TemporaryDirectory() as work:
            (Path(work) / "scenes").symlink_to(self.top / "share/curlew/scenes")
            demo = Path(work) / "scenes/demo.txt"
            reduced = re.search("^# reduced: (.*)", demo.read_text(), re.M)[1].split()
            run(self.top / "bin/curlew", "-quiet", "-set", *reduced, "-config", demo.relative_to(work), cwd=work)
            made = {path.name for path in (Path(work) / "out").iterdir()}
            self.assertLessEqual({"spot_velocity.vdb", "spot_speed.png", "spot_speed.exr", "spot_points.ply", "spot_check.json"}, made)

    def test_python_finds_the_library(self):
        code = f"import sys\nsys.path.insert(0, {str(self.top / 'lib/python')!r})\n{PROGRAM}"
        count, *loaded = run(sys.executable, "-B", "-c", code).split()
        self.assertEqual(count, "100")
        self.assertIn(str(self.top / "lib/libcurlew.so"), loaded)

    def test_manual_completions_and_licences_are_inside(self):
        for name in ("share/man/man1/curlew.1", "share/bash-completion/completions/curlew", "LICENSE", "NOTICE"):
            self.assertTrue((self.top / name).is_file() or (self.top / f"{name}.gz").is_file(), name)
        licences = {p.stem for p in (self.top / "share/licences").iterdir()}
        self.check_sbom((self.top / "sbom.spdx.json").read_text(), licences)


class Deb(unittest.TestCase, Sbom):
    """Looks into the Debian package."""

    @classmethod
    def setUpClass(cls):
        with tempfile.TemporaryDirectory() as folder:
            addons = Path(folder) / "addons"  # empty files of the same names: compressing them again takes long
            addons.mkdir()
            for path in packed.glob("*.zip"):
                (addons / path.name).touch()
            run("cpack", "--config", build / "CPackConfig.cmake", "-B", folder, "-D",
                f"CPACK_INSTALLED_DIRECTORIES={addons};usr/share/curlew/blender", "-D", "CPACK_DEBIAN_COMPRESSION_TYPE=zstd")
            deb = next(Path(folder).glob("*.deb"))
            cls.bill = run("sh", "-c", f"dpkg-deb --fsys-tarfile '{deb}' | tar -xO ./usr/share/doc/curlew/sbom.spdx.json")
            cls.names = [line.split(maxsplit=5)[5].partition(" -> ")[0] for line in run("dpkg-deb", "-c", deb).splitlines()]
            cls.fields = {name: run("dpkg-deb", "-f", deb, name) for name in ("Package", "Version", "Depends", "Suggests")}

    def test_everything_is_inside(self):
        for pattern in (r"bin/curlew", r"lib/.*libcurlew\.so", r"include/curlew/vdb/VdbFile\.h", r"include/curlew\.h",
                        r"lib/.*cmake/curlew/curlewConfig\.cmake", r"lib/.*pkgconfig/curlew\.pc",
                        r"lib/python3/dist-packages/curlew/__init__\.py", r"share/curlew/blender/curlew_blender-.*-legacy\.zip",
                        r"share/curlew/blender/curlew_blender-.*-linux-x64\.zip", r"share/man/man1/curlew\.1(\.gz)?",
                        r"share/man/man1/curlew-noise\.1(\.gz)?", r"share/bash-completion/completions/curlew",
                        r"share/zsh/vendor-completions/_curlew", r"share/fish/vendor_completions\.d/curlew\.fish",
                        r"share/doc/curlew/copyright", r"share/doc/curlew/NOTICE", r"share/doc/curlew/sbom\.spdx\.json"):
            self.assertTrue(any(re.fullmatch(r"\./usr/" + pattern, name) for name in self.names), pattern)
        self.assertEqual([name for name in self.names if not name.startswith("./usr/")], [])

    def test_its_bill_of_materials_lists_what_is_compiled_in(self):
        self.check_sbom(self.bill, set(contained([])))

    def test_it_asks_for_what_it_needs(self):
        self.assertEqual((self.fields["Package"].strip(), self.fields["Version"].strip()), ("curlew", version))
        for name in ("libopenexr", "libtbb12", "libassimp", "libc6", "python3-numpy"):
            self.assertIn(name, self.fields["Depends"])
        # The packages that curlewConfig.cmake searches for, and those of the static libraries' own libraries.
        for name in ("openvdb", "boost", "tbb", "fmt", "openexr", "png", "embree", "muparser", "assimp", "minizip", "blosc"):
            self.assertIn(f"lib{name}-dev", self.fields["Suggests"])
        for name in ("nlohmann-json3-dev", "zlib1g-dev"):
            self.assertIn(name, self.fields["Suggests"])


unittest.main(argv=sys.argv[:1])
