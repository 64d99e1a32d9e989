# SPDX-License-Identifier: Apache-2.0
"""Bundles the shared libraries that a library or program needs and a machine may lack, as copies that find each other."""

import platform
import re
import shutil
import struct
import subprocess
from pathlib import Path
from typing import Dict, Iterable, Iterator, List, Sequence, Set, Tuple

# Libraries that every Linux desktop provides in a suitable version.
_BASE = re.compile(r"(linux-vdso|ld-linux-x86-64|lib(c|m|dl|rt|pthread|gcc_s|stdc\+\+|z))\.")
FOLDER = "lib"  # beside the library
# Packages of libraries that consist of headers, and of those that are linked statically.
HEADERS = ("libhwy-dev", "libkissfft-dev", "libnanoflann-dev", "libnanovdb-dev", "libvulkan-dev", "nlohmann-json3-dev")
STATIC = ("glslang-dev", "libboost-iostreams-dev", "libembree-dev", "libopenvdb-dev", "spirv-tools")


def _run(*words: object) -> str:
    try:
        done = subprocess.run([str(w) for w in words], capture_output=True, text=True, check=False)
    except FileNotFoundError:
        raise ValueError(f"{words[0]} is not installed; ./dev plugin installs what is needed") from None
    if done.returncode != 0:
        raise ValueError(f"{words[0]} failed: {done.stderr.strip() or done.stdout.strip()}")
    return done.stdout


def needed(library: Path) -> Dict[str, Path]:
    """Returns the paths of all direct and indirect dependencies, by soname."""
    found = {}
    for line in _run("ldd", library).splitlines():
        name, arrow, rest = line.strip().partition(" => ")
        if not arrow or _BASE.match(name):
            continue
        path = rest.partition(" (")[0]
        if path == "not found":
            raise ValueError(f"'{library}' needs {name}, which is not installed")
        found[name] = Path(path).resolve()
    return found


def _bundled(soname: str) -> str:
    """Returns a library's name in the bundle. It differs from the usual one, so that another build of the library that
    the host has already loaded is not used instead."""
    return f"curlew-{soname}"


def _versions_needed(data: bytearray, table: int, strings: int) -> Iterator[Tuple[int, bytes]]:
    """Yields the place and the name of each version that an ELF file needs (section .gnu.version_r)."""
    while True:
        _, count, _, first, following = struct.unpack_from("<HHIII", data, table)
        place = table + first
        for _ in range(count):
            _, _, _, name, step = struct.unpack_from("<IHHII", data, place)
            yield place, bytes(data[strings + name:data.index(b"\0", strings + name)])
            place += step
        if not following:
            return
        table += following


def _accept_older_runtime(copy: Path) -> None:
    """Lets a library run with the libstdc++ of GCC 11 if all that it needs of GCC 12's is condition_variable::wait: the
    function has the version GLIBCXX_3.4.30 there, and GLIBCXX_3.4.11 in all, with the same interface."""
    symbols = re.findall(r" (\w+)@GLIBCXX_3\.4\.30", _run("readelf", "--dyn-syms", "--wide", copy))
    if symbols != ["_ZNSt18condition_variable4waitERSt11unique_lockISt5mutexE"]:
        return
    sections = _run("readelf", "--section-headers", "--wide", copy)
    table, strings = (int(re.search(rf" {re.escape(name)} +\w+ +\w+ (\w+) ", sections)[1], 16)  # type: ignore[index]
                      for name in (".gnu.version_r", ".dynstr"))
    data = bytearray(copy.read_bytes())
    places = {name: place for place, name in _versions_needed(data, table, strings)}
    new, old = places[b"GLIBCXX_3.4.30"], places.get(b"GLIBCXX_3.4.11")
    if old is None:
        return
    data[new:new + 4] = data[old:old + 4]  # the hash of the name
    data[new + 8:new + 12] = data[old + 8:old + 12]  # the name
    copy.write_bytes(data)


def _sections(data: bytearray) -> Dict[bytes, Tuple[int, int]]:
    """Returns the place and size of each section of a 64-bit ELF file."""
    table, = struct.unpack_from("<Q", data, 0x28)
    step, count, names = struct.unpack_from("<HHH", data, 0x3A)
    headers = [struct.unpack_from("<IIQQQQ", data, table + k * step) for k in range(count)]
    strings = headers[names][4]
    return {bytes(data[strings + h[0]:data.index(b"\0", strings + h[0])]): (h[4], h[5]) for h in headers}


# Templates of the standard library, which every library contains.
_STANDARD = re.compile(rb"_ZZ?(NK?|T[ISV]N?|GVN)?(St|S[a-z]|9__gnu_cxx)")
_ROOM = 120_000  # bytes that one argument of a command may have, about


class _Symbols:
    """The symbols of an ELF file that the dynamic linker sees."""

    def __init__(self, file: Path) -> None:
        self.file, self.data = file, bytearray(file.read_bytes())
        sections = _sections(self.data)
        (self._table, size), (self._strings, _) = sections[b".dynsym"], sections[b".dynstr"]
        self._dynamic, self._dynamic_size = sections[b".dynamic"]
        self.entries = []  # the name of each symbol, and whether it is defined here
        for place in range(self._table, self._table + size, 24):
            name, _, _, section = struct.unpack_from("<IBBH", self.data, place)
            start = self._strings + name
            self.entries.append((bytes(self.data[start:self.data.index(b"\0", start)]), section != 0))

    def defined(self) -> Set[bytes]:
        """Returns the names of all symbols that others may bind to."""
        return {name for name, here in self.entries if here and name}

    def _entry(self, tag: int) -> int:
        """Returns the place of an entry of the dynamic section."""
        return next(place for place in range(self._dynamic, self._dynamic + self._dynamic_size, 16)
                    if struct.unpack_from("<q", self.data, place)[0] == tag)

    def room(self, names: Dict[bytes, bytes]) -> int:
        """Returns the number of bytes that rename() needs at most."""
        table = 8 * len(self.entries) + 64 if self.defined() & names.keys() else 0
        return sum(len(names[name]) + 1 for name, _ in self.entries if name in names) + table

    def is_large(self) -> bool:
        """Returns whether the new names of all symbols would not fit into the argument of a command."""
        return 22 * len(self.entries) > _ROOM

    def rename(self, names: Dict[bytes, bytes], where: str) -> None:
        """Renames symbols. The new names and a new table of hashes take the place of the search path, which must be long
        enough for them and becomes `where`."""
        address, = struct.unpack_from("<Q", self.data, self._entry(5) + 8)  # DT_STRTAB
        place, = struct.unpack_from("<Q", self.data, self._entry(29) + 8)  # DT_RUNPATH
        self._put(place, where.encode() + b"\0")
        place += len(where) + 1
        hashes_change = bool(self.defined() & names.keys())
        for k, (name, here) in enumerate(self.entries):
            if name in names:
                struct.pack_into("<I", self.data, self._table + 24 * k, place)
                self._put(place, names[name] + b"\0")
                place += len(names[name]) + 1
                self.entries[k] = (names[name], here)
        if hashes_change:
            place += -(address + place) % 8
            self._put(place, self._hashes())
            struct.pack_into("<qQ", self.data, self._entry(0x6FFFFEF5), 4, address + place)  # DT_GNU_HASH becomes DT_HASH
        self.file.write_bytes(self.data)

    def _put(self, place: int, data: bytes) -> None:
        self.data[self._strings + place:self._strings + place + len(data)] = data

    def _hashes(self) -> bytes:
        """Returns a table of hashes in the format of System V, whose symbols need no order."""
        buckets, chains = [0] * (len(self.entries) // 2 + 1), [0] * len(self.entries)
        for k, (name, here) in enumerate(self.entries):
            if here:
                value = 0
                for byte in name:
                    value = (value << 4) + byte
                    value = (value ^ (value >> 24 & 0xF0)) & 0x0FFFFFFF
                bucket = value % len(buckets)
                chains[k], buckets[bucket] = buckets[bucket], k
        return struct.pack(f"<{2 + len(buckets) + len(chains)}I", len(buckets), len(chains), *buckets, *chains)


def _hide(copies: Iterable[Path], libraries: Iterable[Path], where: Dict[Path, str]) -> None:
    """Renames all that the bundled libraries define, wherever these copies define or need it. Otherwise the dynamic linker would bind
    them to libraries of the same kind that the host has loaded, whatever their files are called: it takes the first
    symbol with a name. Those of a host may have another version, or another state. A library with
    too many symbols, such as a shared OpenVDB, keeps its names."""
    symbols = [_Symbols(library) for library in libraries]
    kept = set().union(*(each.defined() for each in symbols if each.is_large()))
    found = sorted(set().union(*(each.defined() for each in symbols)) - kept)
    names = {name: b"curlew_%x" % k for k, name in enumerate(name for name in found if not _STANDARD.match(name))}
    for copy in copies:
        room = len(where[copy]) + 1 + _Symbols(copy).room(names)
        if room > _ROOM:
            raise ValueError(f"'{copy}' needs too many symbols to rename")
        _run("patchelf", "--set-rpath", where[copy].ljust(room, "/"), copy)
        _Symbols(copy).rename(names, where[copy])


def _connect(copy: Path, where: str) -> None:
    """Makes a copy search for its dependencies in the bundle."""
    _run("strip", "--strip-unneeded", copy)  # of names for debuggers, before patchelf moves sections
    _run("patchelf", "--set-rpath", where, copy)
    for name in _run("patchelf", "--print-needed", copy).split():
        if not _BASE.match(name):
            _run("patchelf", "--replace-needed", name, _bundled(name), copy)
    _accept_older_runtime(copy)


def bundle(library: Path, folder: Path) -> List[Path]:
    """Copies the library into a folder, and its dependencies into FOLDER in that folder. Returns all copies."""
    (folder / FOLDER).mkdir(parents=True)
    copies = [Path(shutil.copy(library, folder / "libcurlew.so"))]
    _connect(copies[0], f"$ORIGIN/{FOLDER}")
    for soname, path in sorted(needed(library).items()):
        copy = Path(shutil.copy(path, folder / FOLDER / _bundled(soname)))
        _run("patchelf", "--set-soname", copy.name, copy)
        _connect(copy, "$ORIGIN")
        copies.append(copy)
    libraries = copies[1:]
    _hide(copies, libraries, {copy: "$ORIGIN" if copy in libraries else f"$ORIGIN/{FOLDER}" for copy in copies})
    command = library.parent / "launcher" / "curlew"  # reads untrusted files in a separate process
    if command.is_file():
        copies.append(Path(shutil.copy(command, folder / command.name)))
        _run("strip", copies[-1])
        name = _run("patchelf", "--print-soname", copies[0]).strip()
        _run("patchelf", "--set-rpath", "$ORIGIN", "--replace-needed", name, copies[0].name, copies[-1])
    return copies


def bundle_program(program: Path, folder: Path, where: str = "bin") -> List[Path]:
    """Copies a program or library into a folder below `folder`, and its dependencies into FOLDER. The copies keep their
    names, as other programs do not load them. Returns the originals of the dependencies."""
    for name in (where, FOLDER):
        (folder / name).mkdir(exist_ok=True)
    copy = Path(shutil.copy(program, folder / where / program.name))
    _run("strip", "--strip-unneeded", copy)
    _run("patchelf", "--set-rpath", "$ORIGIN" if where == FOLDER else f"$ORIGIN/../{FOLDER}", copy)
    originals = needed(program)
    for soname, path in sorted(originals.items()):
        if not (folder / FOLDER / soname).exists():
            dependency = Path(shutil.copy(path, folder / FOLDER / soname))
            _run("patchelf", "--set-rpath", "$ORIGIN", dependency)
            _accept_older_runtime(dependency)
    return list(originals.values())


def _owners(libraries: Sequence[Path]) -> Set[str]:
    """Returns the names of the Debian packages that libraries belong to."""
    # Packages made before /lib became a link to /usr/lib list files in /lib. One query of exact paths takes the shortest time.
    paths = [str(library) for library in libraries]
    places = {path: path for path in paths} | {path.removeprefix("/usr"): path for path in paths}
    listed = subprocess.run(["dpkg-query", "--search", *places], capture_output=True, text=True, check=False).stdout if paths else ""
    found = {places.get(line.partition(": ")[2]): line.split(":")[0] for line in listed.splitlines()}
    for path in paths:
        if path not in found:
            raise ValueError(f"'{path}' belongs to no Debian package, so its licence is unknown")
    return {found[path] for path in paths}


def contained(libraries: Iterable[Path]) -> List[str]:
    """Returns the Debian packages of these libraries, and those of the libraries that are part of Curlew itself."""
    return sorted({*HEADERS, *STATIC, *_owners([*libraries])})


def licences(packages: Iterable[str]) -> Dict[str, bytes]:
    """Returns the licences of Debian packages, by name."""
    return {package: Path("/usr/share/doc", package, "copyright").read_bytes() for package in packages}


def compiles_for_older_systems() -> bool:
    """Returns whether programs that are compiled here run on the systems that the packages promise. On a system newer
    than Debian 12, they ask for its C library."""
    return tuple(map(int, platform.libc_ver()[1].split("."))) <= (2, 36)


def newest_symbols(files: Iterable[Path]) -> Dict[str, Tuple[int, ...]]:
    """Returns the newest versions of GLIBC and GLIBCXX that ELF files ask for."""
    newest: Dict[str, Tuple[int, ...]] = {}
    for file in files:
        for name, text in re.findall(r"Name: (GLIBC|GLIBCXX)_([0-9.]+)", _run("readelf", "--version-info", file)):
            version = tuple(map(int, text.split(".")))
            newest[name] = max(newest.get(name, version), version)
    return newest
