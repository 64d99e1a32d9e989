#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs the benchmarks for each instruction set, and the command; prints tables and writes all numbers as JSON.

Compared cases run in turn, round after round, so that a varying load affects all of them; the median of the rounds is
used. Times of one thread are processor times. Times of two threads are wall times, which are unreliable while other
processes use the processor. Therefore the processor time of the main thread, which takes part in the work, is compared
too.

The preview of the Blender add-on is timed in Blender, by bench/blender_preview.py.
"""

import argparse
import json
import math
import os
import re
import statistics
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from datetime import datetime, timezone

# Instruction sets, best first, with the processor flags that they need. The environment variable selects the set.
SETS = {"avx512": {"avx512f", "avx512dq", "avx512bw", "avx512vl"}, "avx2": {"avx2", "fma"}, "scalar": set()}
VARIABLE = "CURLEW_SIMD"
# All cases run with the best set. With the other sets, only those that match COLUMNS run.
COLUMNS = re.compile(r"(dfvn|noise|octaves|bounded)/|velocity/.*/1thread|advect/(none|gauss_newton)/1thread")
# Cases on two threads. Their wall time counts.
WALL = re.compile(r"wait/shade/|.*2threads")
LONG = 10  # Seconds; a case that takes longer is run once.
DIM = 256  # Voxels along an edge of the grid whose memory is measured: that of the case velocity/collocated/1thread.
BOX = ",".join(str(v) for v in [-0.5 / 32] * 3 + [(DIM - 0.5) / 32] * 3)
MEMORY = "memory/collocated"


@dataclass
class Case:
    """Measurements of one case with one instruction set; lists have one value per round."""
    cpu: list = field(default_factory=list)  # ns an item
    real: list = field(default_factory=list)  # ns an item
    counters: dict = field(default_factory=dict)

    def ns(self, real=False):
        return statistics.median(self.real if real else self.cpu)


# ---- Running


def processor():
    """Returns the model and the flags of the processor."""
    with open("/proc/cpuinfo") as file:
        text = file.read()
    model = re.search(r"^model name\s*:\s*(.*)", text, re.M)
    flags = re.search(r"^flags\s*:\s*(.*)", text, re.M)
    return model[1] if model else "unknown", set(flags[1].split()) if flags else set()


def child(arguments, **environment):
    run = subprocess.run(arguments, env={**os.environ, **environment}, capture_output=True, text=True)
    if run.returncode != 0:
        lines = run.stderr.strip().splitlines()
        sys.exit(f"bench: {arguments[0]} failed ({run.returncode}): {lines[-1] if lines else 'no message'}")
    return run.stdout


def short(name):
    """Returns a case's name without the suffix of Google Benchmark."""
    return re.sub(r"/(iterations:\d+|real_time)", "", name)


def run_cases(binary, names, simd, cases):
    """Adds one round of the named cases. Returns those that took too long to be repeated."""
    output = child([binary, f"--benchmark_filter=^({'|'.join(names)})$", "--benchmark_format=json",
                    "--benchmark_min_time=0.02"], **{VARIABLE: simd})
    known = {"name", "run_name", "run_type", "repetitions", "repetition_index", "threads", "iterations", "real_time",
             "cpu_time", "time_unit", "items_per_second", "family_index", "per_family_instance_index"}
    slow = set()
    for run in json.loads(output)["benchmarks"]:
        counted = 1e9 / run["items_per_second"]
        real, cpu = run["real_time"], run["cpu_time"]
        case = cases.setdefault(short(run["name"]), {}).setdefault(simd, Case())
        case.real.append(counted if "real_time" in run["name"] else counted * real / cpu)
        case.cpu.append(counted * cpu / real if "real_time" in run["name"] else counted)
        case.counters = {key: value for key, value in run.items() if key not in known}
        if real * run["iterations"] > LONG * 1e9:  # ns, the unit of all cases
            slow.add(run["name"])
    return slow


def run_rounds(binary, rounds, sets, wanted):
    """Runs all cases for which `wanted`, a function of the short name, is true. Returns {short name: {set: Case}}."""
    names = [name for name in child([binary, "--benchmark_list_tests"]).split() if wanted(short(name))]
    cases, slow = {}, set()
    for turn in range(rounds):
        for simd in sets:
            here = [n for n in names if n not in slow and (simd == sets[0] or COLUMNS.match(n))]
            if not here or (simd == "scalar" and turn > 0 and simd != sets[0]):
                continue
            print(f"round {turn + 1} of {rounds}, {simd}: {len(here)} cases", file=sys.stderr, flush=True)
            found = run_cases(binary, here, simd, cases)
            if simd == sets[0]:
                slow |= found
    return cases


def peak_memory(arguments):
    """Returns the peak resident memory of a command, in bytes."""
    process = os.posix_spawn(arguments[0], arguments, os.environ)
    _, status, usage = os.wait4(process, 0)
    if status != 0:
        sys.exit(f"bench: {' '.join(arguments)} failed ({os.waitstatus_to_exitcode(status)}): its message is above")
    return usage.ru_maxrss * 1024


def run_memory(command):
    with tempfile.TemporaryDirectory() as folder:
        grid = [command, "-quiet", "-noise", "seed=1", "-noise", "seed=2", "-dfvn", f"box={BOX}", "-velocity"]
        return {"started": peak_memory([command, "-quiet"]),
                "collocated": peak_memory([*grid, f"dim={DIM}"]),
                "staggered": peak_memory([*grid, f"dim={DIM}", "staggered=1"]),
                "collocated, written": peak_memory([*grid, f"dim={DIM}", "-write", os.path.join(folder, "v.vdb")])}


# ---- Derived figures


def slope(points):
    """Returns the slope of a line fitted to the logarithms."""
    x, y = zip(*[(math.log(a), math.log(b)) for a, b in points])
    mx, my = statistics.mean(x), statistics.mean(y)
    return sum((a - mx) * (b - my) for a, b in zip(x, y)) / sum((a - mx) ** 2 for a in x)


def scaling(cases, simd):
    """Returns the exponents with which the time grows."""
    exponents = {}
    for what, prefix in {"voxels": "scale/voxels/", "particles": "scale/particles/", "octaves": "octaves/"}.items():
        sizes = {int(name[len(prefix):]): by_set[simd] for name, by_set in cases.items() if name.startswith(prefix)}
        if len(sizes) > 1:
            points = [(n, case.ns() * (1 if what == "octaves" else n)) for n, case in sizes.items()]
            exponents[what] = slope(points)
    return exponents


def comparisons(cases, memory, sets):
    """Returns tuples (name, value, unit, source, bar); a bar is ("<=" or ">=", number), or None."""
    best, rows = sets[0], []

    def ns(name, simd=best, real=False):
        return cases[name][simd].ns(real) if simd in cases.get(name, {}) else None

    def ratio(name, over, under, bar=None):
        if over is not None and under is not None:
            rows.append((name, over / under, "x", f"{number(over)} / {number(under)}", bar))

    for kind in "random", "row":
        point = f"dfvn/float/{kind}"
        if ns(point) is not None and best == "avx512":
            rows.append((f"DFVN point, {kind}: AVX-512", ns(point), " ns", "", ("<=", 14)))
        if "avx2" in sets[1:]:
            ratio(f"DFVN point, {kind}: AVX2 over AVX-512", ns(point, "avx2"), ns(point), ("<=", 2.2))
        ratio(f"DFVN point, {kind}: port with libm over ours", ns(f"port/computed/{kind}"), ns(point), (">=", 25))
        ratio(f"DFVN point, {kind}: port with table over ours", ns(f"port/table/{kind}"), ns(point), (">=", 6))
    one = {layout: ns(f"velocity/{layout}/1thread") for layout in ("collocated", "staggered")}
    for layout, time in one.items():
        # vdb_ax fills an existing grid. Ours creates the grid first, unless its memory is available already.
        ratio(f"velocity, {layout}: vdb_ax's curlsimplexnoise over ours", ns("ax/curlsimplexnoise"),
              ns(f"velocity/{layout}/again"), (">=", 30))
        ratio("  the same with newly allocated memory", ns("ax/curlsimplexnoise"), time)
    ratio("velocity: staggered over collocated", one["staggered"], one["collocated"], ("<=", 1.2))
    ratio("velocity, collocated: over a constant fill", one["collocated"], ns("fill/constant"))
    for layout in one:
        free = ns(f"bounded/none/{layout}")
        ratio(f"bounded by a sphere over unbounded, {layout}", ns(f"bounded/sphere/{layout}"), free)
        ratio(f"bounded by a level set over unbounded, {layout}", ns(f"bounded/level_set/{layout}"), free, ("<=", 2))
    for name in "velocity/collocated", "velocity/staggered", "advect/gauss_newton":
        ratio(f"one thread over two: {name}", ns(f"{name}/1thread", real=True), ns(f"{name}/2threads", real=True),
              (">=", 1.9))
        ratio("  the same, by the main thread's processor time", ns(f"{name}/1thread"), ns(f"{name}/2threads"))
    ratio("advect: in a mesh over without its wall", ns("advect/mesh/1thread"), ns("advect/mesh_without_wall/1thread"),
          ("<=", 1.3))
    ours = "advect/gauss_newton/1thread"
    ratio("advect: advectPoints, a step a call, over ours", ns("advect_points/step_a_call"), ns(ours), (">=", 3))
    ratio("advect: advectPoints, all in one call, over ours", ns("advect_points/one_call"), ns(ours), (">=", 2))
    for f in "drift_f", "drift_g":
        if ns(ours) is not None and ns("advect_points/one_call") is not None:
            ratio(f"{f}: advectPoints over ours", cases["advect_points/one_call"][best].counters[f],
                  cases[ours][best].counters[f], (">=", 1000))
    for faces in "1e4", "1e5", "1e6":
        ratio(f"level set of {faces} faces, 256 voxels: ours over OpenVDB", ns(f"mesh/solid/{faces}/2threads", real=True),
              ns(f"mesh/openvdb/{faces}/2threads", real=True), ("<=", 2))
        ratio(f"winding number in {faces} faces: exact over fast", ns(f"winding/exact/{faces}"), ns(f"winding/fast/{faces}"))
    for dim in 64, 128, 256:
        ours, theirs = f"enright/{dim}/flowmap/2threads", f"enright/{dim}/openvdb/2threads"
        if ns(ours) is None or ns(theirs) is None:
            continue
        at = {name: cases[name][best].counters for name in (ours, theirs)}
        ratio(f"Enright's test, {dim}: OpenVDB's time over ours", ns(theirs, real=True), ns(ours, real=True), (">=", 1))
        for what in "half", "end":
            rows.append((f"  volume at the {what}: ours", at[ours][f"volume_{what}"], " %", "",
                         ("<=", 0.1) if (what, dim) == ("end", 128) else None))
            rows.append((f"  volume at the {what}: OpenVDB's", at[theirs][f"volume_{what}"], " %", "", None))
        ratio("  volume error at the end: OpenVDB's over ours", abs(at[theirs]["volume_end"]),
              abs(at[ours]["volume_end"]), (">=", 20))
        rows.append(("  surface at the end: ours", at[ours]["surface_end"], " voxels", "", ("<=", 0.05)))
        rows.append(("  surface at the end: OpenVDB's", at[theirs]["surface_end"], " voxels", "", None))
    for scheme in "euler", "rk4":
        for corrections in 0, 1:
            case = f"warp/{scheme}/64steps/{corrections}corrections"
            if ns(case) is not None:
                rows.append((f"image warp at 1024 x 576, {scheme}, 64 steps, {corrections} corrections",
                             cases[case][best].counters["frames_per_second"], " frames/s", "", None))
    if memory:
        grid = cases["velocity/collocated/1thread"][best].counters["bytes"]
        for what, peak in memory.items():
            if what != "started":
                bar = ("<=", 1.1) if what == "collocated" else None
                ratio(f"memory beyond that at the start, over the grid: {what}", (peak - memory["started"]) / 1e6, grid / 1e6, bar)
    return rows


def waits(cases, simd):
    """Returns tuples like those of comparisons() for the jobs that users wait for, the cases wait/JOB."""
    jobs = {name.removeprefix("wait/"): by_set[simd] for name, by_set in cases.items() if name.startswith("wait/")}
    rows = []

    def seconds(job):
        return jobs[job].ns(bool(WALL.match(f"wait/{job}"))) / 1e9

    def ratio(name, over, under, bar):
        if over in jobs and under in jobs:
            a, b = seconds(over), seconds(under)
            rows.append((name, a / b, "x", f"{number(a)} / {number(b)} s", bar))

    for job, name in {"shade/mesh": "-shade a mesh, 1280 x 960", "shade/level_set": "-shade a level set, dim=256",
                      "shade/isosurface": "-shade an isosurface", "snap/level_set": "-snap 10^4 points to a level set",
                      "splat/light": "-splat 10^5 curves of 300 vertices, one thread",
                      "splat/light_two_threads": "  two threads"}.items():
        if job in jobs:
            rows.append((name, seconds(job), " s", "", ("<=", 1)))
    if "sequence" in jobs:
        at = jobs["sequence"].counters
        rows += [("-advectLevelSet, 24 frames at dim=64: the slowest frame", at["slowest_frame_s"], " s", "", ("<=", 1)),
                 ("  all frames", seconds("sequence"), " s", "", None),
                 ("  the first, of a voxel", at["first_frame_ns_per_voxel"], " ns", "", None),
                 ("  the last, of a voxel", at["last_frame_ns_per_voxel"], " ns", "", None)]
    for job, name in {"spot192": "Spot, 192 voxels", "million512": "10^6 faces, 512 voxels"}.items():
        ratio(f"level set of {name}: ours over OpenVDB", f"mesh2ls/{job}", f"mesh2ls/{job}_openvdb", ("<=", 1))
    ratio("-advect on a sphere: newton over gauss-newton", "surface/newton", "surface/gauss-newton", ("<=", 2))
    for method in "newton", "gauss-newton":
        if (job := f"surface/{method}") in jobs:
            share = jobs[job].counters["not_converged"]
            rows.append((f"  {method}: points not converged", 100 * share, " %", "", None))
    for job, case in jobs.items():
        if job.startswith("in_mesh/"):
            rows += [(f"-advect in a mesh, {job[8:]}: a particle", 1e6 * seconds(job), " µs", "", None),
                     ("  mean position error", case.counters["error"], "", "", None)]
        if job.startswith("shell/"):
            rows.append((f"-velocity in a shell, {job[6:]} voxels across", seconds(job) * case.counters["bytes"]
                         / case.counters["bytes_per_item"], " s", f"{number(case.ns())} ns a voxel", None))
    equal = "in_mesh/rk4", "in_mesh/adaptive_3e-4", "in_mesh/adaptive_1e-4"
    if all(job in jobs for job in equal):
        (rk4, error), (coarse, most), (fine, least) = ((seconds(job), jobs[job].counters["error"]) for job in equal)
        # Between two accuracies, the time is about a power of the error.
        time = coarse * (fine / coarse) ** (math.log(error / most) / math.log(least / most))
        rows.append(("  adaptive with the error of rk4: over rk4", time / rk4, "x", f"{number(1e6 * time)} µs", None))
    return rows


def met(value, bar):
    return value <= bar[1] if bar[0] == "<=" else value >= bar[1]


# ---- Printing


def number(value):
    return f"{value:.4g}" if 1e-3 < abs(value) < 1e5 else f"{value:.2e}"


def print_cases(cases, sets):
    """Prints times per item by instruction set, with the other counters of a case, and the rates of the roofline."""
    print(f"\n{'time per item, ns':44}" + "".join(f"{simd:>10}" for simd in sets))
    topic = ""
    for name, by_set in cases.items():
        if name.split("/")[0] != topic:
            topic = name.split("/")[0]
            print()
        times = "".join(f"{number(by_set[s].ns(bool(WALL.match(name)))) if s in by_set else '':>10}" for s in sets)
        best = by_set[sets[0]]
        extra = [f"{1 / best.ns():.1f} {'GB' if '/store/' in name else 'GFMA'}/s"] if topic == "roofline" else []
        extra += [f"{key} {number(value)}" for key, value in best.counters.items() if key != "bytes"]
        print(f"{name:44}{times}  {', '.join(extra)}".rstrip())


def print_comparisons(title, rows):
    print(f"\n{title:62}{'':>10}  {'bar':>9}")
    for name, value, unit, made_of, bar in rows:
        verdict = f"{bar[0]} {bar[1]:<6g}{'met' if met(value, bar) else 'MISSED'}" if bar else ""
        print(f"{name:62}{number(value) + unit:>10}  {verdict:16}  {made_of}".rstrip())


def draw_accuracy(cases, simd, command, folder):
    """Draws the mean position error against the processor time of a particle, from the cases accuracy/CURVE/POINT.

    Writes accuracy.csv and accuracy.svg. Returns the picture's path, or None if none of the cases ran.
    """
    points = [(name.split("/")[1].replace("_", " "), by_set[simd].ns() / 1000, by_set[simd].counters["error"])
              for name, by_set in cases.items() if name.startswith("accuracy/")]
    if not points:
        return None
    curves = list(dict.fromkeys(curve for curve, _, _ in points))
    table, picture = os.path.join(folder, "accuracy.csv"), os.path.join(folder, "accuracy.svg")
    with open(table, "w") as file:
        print("time", *curves, sep=",", file=file)
        for curve, time, error in points:
            print(time, *(error if c == curve else "" for c in curves), sep=",", file=file)
    child([command, "-quiet", "-plot", table, picture, "logx=1", "logy=1", "width=1000", "height=640",
           "x=processor time of a particle (µs)", "y=mean position error (world units)",
           "title=Cost against accuracy"])
    return picture


def as_json(model, sets, cases, memory, exponents, rows):
    return {
        "processor": model, "cores": os.cpu_count(), "date": datetime.now(timezone.utc).isoformat(timespec="seconds"),
        "sets": sets, "memory_bytes": memory, "exponents": exponents,
        "cases": {name: {simd: {"cpu_ns": c.cpu, "real_ns": c.real, "median_cpu_ns": c.ns(),
                                "median_real_ns": c.ns(True), "counters": c.counters}
                         for simd, c in by_set.items()} for name, by_set in cases.items()},
        "comparisons": [{"name": name, "value": value, "unit": unit.strip(), "bar": bar,
                         "met": met(value, bar) if bar else None} for name, value, unit, _, bar in rows]}


def main():
    parser = argparse.ArgumentParser(prog="./dev bench", description=__doc__.splitlines()[0])
    parser.add_argument("--binary", required=True, help="the benchmarks (./dev gives it)")
    parser.add_argument("--command", required=True, help="the command curlew (./dev gives it)")
    parser.add_argument("--out", required=True, help="JSON file for the numbers (./dev gives it)")
    parser.add_argument("--rounds", type=int, default=3, help="number of times to run everything (default 3)")
    parser.add_argument("filter", nargs="?", default="", help="regular expression: run only cases whose names match it; cases of "
                        "GPUs only if it contains gpu, because they take very long in software")
    options = parser.parse_args()
    if options.rounds < 1:
        parser.error(f"--rounds {options.rounds} must be at least 1")
    try:
        pattern = re.compile(options.filter)
    except re.error as error:
        parser.error(f"the filter '{options.filter}' is not a regular expression: {error}")

    model, flags = processor()
    sets = [simd for simd, needed in SETS.items() if needed <= flags]
    measures_memory = bool(pattern.search(MEMORY))
    load = os.getloadavg()[0]
    cases = run_rounds(options.binary, options.rounds, sets, lambda name: (
        pattern.search(name) and ("gpu" in options.filter or not name.startswith("gpu/"))
        or measures_memory and name == "velocity/collocated/1thread"))
    if not cases:
        sys.exit(f"bench: no case has a name with '{options.filter}'; {options.binary} --benchmark_list_tests lists them")
    memory = run_memory(options.command) if measures_memory else {}
    exponents, rows, jobs = scaling(cases, sets[0]), comparisons(cases, memory, sets), waits(cases, sets[0])

    print(f"{model}, {os.cpu_count()} cores, load {load:.1f} at the start; medians of up to {options.rounds} runs")
    print_cases(cases, sets)
    if memory:
        print("\npeak memory, MB: " + "; ".join(f"{what} {peak / 1e6:.1f}" for what, peak in memory.items()))
    if exponents:
        print("\ntime grows with the power of: " + ", ".join(f"{what} {e:.2f}" for what, e in exponents.items()))
    for title, section in ("comparison", rows), ("what users wait for", jobs):
        if section:
            print_comparisons(title, section)
    with open(options.out, "w") as file:
        json.dump(as_json(model, sets, cases, memory, exponents, rows + jobs), file, indent=1)
    picture = draw_accuracy(cases, sets[0], options.command, os.path.dirname(options.out))
    if picture:
        print(f"\ncost against accuracy: {picture}")
    print(f"\nall numbers: {options.out}")


if __name__ == "__main__":
    main()
