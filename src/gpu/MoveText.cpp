// SPDX-License-Identifier: Apache-2.0
#include "MoveText.h"

#include "curlew/shader/StageText.h"

#include <fmt/format.h>

namespace curlew {

namespace {

/// The stages of a scheme as macros. Stages are variables of their own, not an array: they stay in registers.
std::string schemeDefinitions(Scheme scheme) {
    const Tableau& tableau = tableauOf(scheme);
    std::string declare = "PLACE k0", place, store;
    for (int s = 1; s < tableau.stages; ++s) {
        declare += fmt::format(", k{}", s);
        store += fmt::format("{}if (stage == {}) k{} = velocity;", s > 1 ? " else " : "", s, s);
    }
    for (int s = 1; s <= tableau.stages; ++s) {
        const Tableau::Row& row = tableau.rows[static_cast<size_t>(s)];
        place += fmt::format("{}if (stage == {}) x = p + (dt * {:.9e}) * ({});", s > 1 ? " else " : "", s, row.factor,
                             stageText(row.weights, s));
    }
    std::string text = fmt::format("#define STAGES {}\n#define DECLARE_STAGES {};\n#define PLACE_STAGE {}\n",
                                   tableau.stages, declare, place);
    text += fmt::format("#define STORE_STAGE {}\n", store);
    if (tableau.embedded())
        text += fmt::format("#define DIFFERENCE ({})\n#define ERROR_ORDER {}.0\n",
                            stageText(tableau.error, tableau.stages + 1, "velocity"), tableau.errorOrder);
    return text;
}

} // namespace

template <int N>
std::string moveDefinitions(const GpuMoveOptions& o, bool tracks, bool wall, const FlowRmsN<N>& rms) {
    std::string text = schemeDefinitions(o.scheme);
    text += fmt::format(
        "#define MOVE_WORDS {}u\n#define COUNTS {}u\n#define MISSED {}u\n#define STARTS {}u\n#define HALVINGS {}u\n",
        kMoveWords, kMoveCounts, kMoveMissed, kMoveStarts, kMoveHalvings);
    const auto define = [&](const char* name, bool is) { text += fmt::format("#define {} {}\n", name, is ? 1 : 0); };
    const bool reprojects = tracks && o.corrections > 0;
    define("ADAPTIVE", o.steps == 0);
    define("REPROJECTS", reprojects);
    define("GUARDED", o.guarded);
    define("WALLED", o.guarded && wall);
    define("LIMITED", o.limited);
    text += fmt::format("#define MAX_CORRECTIONS {}\n#define MAX_SUBDIVISIONS {}u\n", o.corrections, o.maxSubdivisions);
    std::string enough;
    for (size_t k = 0; k + 1 < size_t{N}; ++k)
        enough += fmt::format("{}{:.9e}", k ? ", " : "", reprojects ? o.enough * rms.potentials[k] : 0);
    return text + fmt::format("#define ENOUGH TRACK({})\n", enough);
}
template std::string moveDefinitions<2>(const GpuMoveOptions&, bool, bool, const FlowRmsN<2>&);
template std::string moveDefinitions<3>(const GpuMoveOptions&, bool, bool, const FlowRmsN<3>&);

namespace {

constexpr std::string_view kBegin = R"glsl(
layout(std430, set = 0, binding = 0) buffer State { float state[]; };
layout(std430, set = 0, binding = 1) buffer Counts { uint counts[]; };
layout(push_constant) uniform Request {
    uint count, budget;
    float accuracy, rmsSpeed, maxStep, shortest, guardedShortest, usual;
};
shared uint sums[COUNTS];

#define UNLIMITED uintBitsToFloat(0x7f800000u) // infinity: no length exceeds it, so a driver can remove the test
// In 3D, where flows are long, copies of them would take long to compile.
#if DIM == 2
#define UNROLLED [[unroll]]
#else
#define UNROLLED
#endif

#define WORDS uint(2 * DIM - 1)
float word(uint at, uint i) { return state[i * (WORDS + MOVE_WORDS) + at]; }
void setWord(uint at, uint i, float value) { state[i * (WORDS + MOVE_WORDS) + at] = value; }

struct Point {
    PLACE place;
    TRACK track;
    float left, next, rest, unit, error;
    uint flags;
};
Point pointAt(uint i) {
    Point point;
    for (uint a = 0u; a < uint(DIM); ++a) point.place[a] = word(a, i);
#if DIM == 3
    point.track = vec2(word(3u, i), word(4u, i));
#else
    point.track = word(2u, i);
#endif
    point.left = word(WORDS, i);
    point.next = word(WORDS + 1u, i);
    point.rest = word(WORDS + 2u, i);
    point.unit = word(WORDS + 3u, i);
    point.error = word(WORDS + 4u, i);
    point.flags = floatBitsToUint(word(WORDS + 5u, i));
    return point;
}
void keep(Point point, uint i) {
    for (uint a = 0u; a < uint(DIM); ++a) setWord(a, i, point.place[a]);
#if DIM == 3
    setWord(3u, i, point.track.x);
    setWord(4u, i, point.track.y);
#else
    setWord(2u, i, point.track);
#endif
    setWord(WORDS, i, point.left);
    setWord(WORDS + 1u, i, point.next);
    setWord(WORDS + 2u, i, point.rest);
    setWord(WORDS + 4u, i, point.error);
    setWord(WORDS + 5u, i, uintBitsToFloat(point.flags));
}

// What happened to a point.
struct Tally {
    uint substeps, retries, stalls, coarse, corrected;
};

bool below(TRACK a, TRACK b) {
#if DIM == 3
    return a.x <= b.x && a.y <= b.y;
#else
    return a <= b;
#endif
}

#if WALLED
#define HERE HERE_AND_WALL
#define EVALUATE(x) flowHereAndWall(x)
#else
#define HERE HERE_ALONE
#define EVALUATE(x) flowHere(x)
#undef WALL_OF
#define WALL_OF(h) WALL(0.0)
#endif

)glsl";

// The algorithm of track/Advect.h, one point per invocation. The flow is evaluated at one place of the text, in a loop
// over stages, corrections and steps alike: the program stays short, and points at different stages of their steps are
// evaluated together.
constexpr std::string_view kAdvance = R"glsl(
// Whether the step from p to x, at the end of which the potentials are off by `off`, is taken.
bool accepts(PLACE p, PLACE x, TRACK off, WALL before, WALL after, float chord) {
#if GUARDED
    vec3 between = vec3(0.0);
#if WALLED
    if (abs(before.x) <= chord)
        for (int k = 0; k < 3; ++k) between[k] = flowWall(p + (x - p) * (0.25 * float(k + 1))).x;
#endif
#if !REPROJECTS
    off = TRACK(0.0);
#endif
    return flowAccepts(p, x, off, before, between, after) > 0.0;
#else
    return true;
#endif
}

Tally advance(inout Point point) {
    PLACE p = point.place;
    TRACK track = point.track;
    float left = point.left, next = point.next, rest = point.rest, unit = point.unit, error = point.error;
    uint flags = point.flags;
    DECLARE_STAGES
    PLACE x = p, v = PLACE(0.0);
    WALL before = WALL(0.0);
    float dt = 0.0, seconds = 0.0, chord = 0.0, estimate = 0.0;
    int stage = -1, corrections = 0; // -1: the velocity at p is unknown
    uint evaluations = 0u, substeps = 0u, retries = 0u, stalls = 0u, coarse = 0u, corrected = 0u;
    while (true) {
        if (stage == 0) { // begin a step
            if (!(left > 0.0) || evaluations >= budget) break;
#if ADAPTIVE
            seconds = next * 1.000001 >= left ? left : min(next, 0.5 * left);
            dt = unit * seconds;
#else
            dt = unit * next;
#endif
            k0 = v;
            corrections = 0;
            stage = 1;
        }
        if (stage > 0 && stage <= STAGES) { PLACE_STAGE }
        HERE here = EVALUATE(x);
        PLACE velocity = VELOCITY(here);
        ++evaluations;
        if (stage < 0) {
            v = velocity;
            before = WALL_OF(here);
            if ((flags & STARTS) != 0u) {
                track = POTENTIALS(here);
                flags &= ~STARTS;
            }
            stage = 0;
            continue;
        }
        if (stage < STAGES) {
            STORE_STAGE
            ++stage;
            continue;
        }
        if (stage == STAGES) { // the end of the step
            ++stage;
            chord = length(x - p);
#ifdef DIFFERENCE
            estimate = abs(dt) * length(DIFFERENCE);
            float speed = min(length(v), length(velocity));
            if (rmsSpeed > 0.0) estimate *= clamp(speed * 1024.0 > rmsSpeed ? rmsSpeed / speed : 1024.0, 1.0, 1024.0);
#endif
        }
        bool tooLong = maxStep > 0.0 && length(x - p) > maxStep;
#if ADAPTIVE
        float relative = estimate / accuracy;
        bool refine = !(relative <= 1.0) || tooLong;
        // As track/StepControl.h: a power of 2^(1/8), rounded down. 1/4 for NaN.
        float factor = relative > 0.0 ? exp2(0.125 * floor(log2(0.2 / relative) * (8.0 / ERROR_ORDER))) : 4.0;
        factor = relative >= 0.0 ? clamp(factor, 0.25, 4.0) : 0.25;
        if (tooLong) factor = min(factor, 0.95 * maxStep / length(x - p));
        if (refine && seconds > shortest) {
            ++retries;
            next = max(seconds * factor, shortest);
            stage = 0;
            continue;
        }
#else
        bool refine = tooLong;
#endif
        TRACK off = track - POTENTIALS(here);
#if REPROJECTS
        if (corrections < MAX_CORRECTIONS && !below(abs(off), ENOUGH)) {
#if LIMITED
            x = CORRECTED(x, off, here, chord);
#else
            x = CORRECTED(x, off, here, 1e30);
#endif
            ++corrections;
            ++corrected;
            continue;
        }
#endif
        bool accepted = accepts(p, x, off, before, WALL_OF(here), length(x - p));
        stage = 0;
        uint halvings = flags & HALVINGS;
#if ADAPTIVE
        if (!accepted) {
            if (halvings < MAX_SUBDIVISIONS && seconds > guardedShortest) {
                ++retries;
                ++flags;
                next = 0.5 * seconds;
                continue;
            }
            // The whole step is skipped, not a very short one, or this would take forever.
            ++stalls;
            next = max(ldexp(seconds, int(halvings)), 0.0625 * usual);
            flags = MISSED;
            left = next >= left ? 0.0 : left - next;
            continue;
        }
        error += estimate;
        next = max(seconds * (halvings > 0u ? min(factor, 1.0) : factor), shortest);
        flags &= ~HALVINGS;
        left = seconds >= left ? 0.0 : left - seconds;
#else
        if (next > guardedShortest && (!accepted || refine)) {
            ++retries;
            next *= 0.5;
            continue;
        }
        if (!accepted) {
            ++stalls;
            flags |= MISSED;
            left -= 1.0;
            rest = next = 1.0;
            continue;
        }
        error += estimate;
        rest -= next;
        if (!(rest > 0.0)) {
            left -= 1.0;
            rest = next = 1.0;
        }
#endif
        p = x;
        v = velocity;
        before = WALL_OF(here);
        ++substeps;
        if (refine) ++coarse;
    }
    point = Point(p, track, left, next, rest, unit, error, flags);
    return Tally(substeps, retries, stalls, coarse, corrected);
}
)glsl";

// The same for equal steps that are taken as they are: the points of a group stay at the same stage of their steps.
constexpr std::string_view kAdvanceEqually = R"glsl(
Tally advance(inout Point point) {
    PLACE p = point.place, x = p;
    float dt = point.unit;
    uint corrected = 0u;
    DECLARE_STAGES
    HERE here = EVALUATE(p);
    PLACE velocity = VELOCITY(here);
    if ((point.flags & STARTS) != 0u) point.track = POTENTIALS(here);
    point.flags &= ~STARTS;
    uint steps = min(uint(point.left), max(budget / uint(STAGES + MAX_CORRECTIONS), 1u));
    for (uint k = 0u; k < steps; ++k) {
        k0 = velocity;
        UNROLLED for (int stage = 1; stage <= STAGES; ++stage) {
            PLACE_STAGE
            here = EVALUATE(x);
            velocity = VELOCITY(here);
            STORE_STAGE
        }
#if REPROJECTS
        float limit = LIMITED != 0 ? length(x - p) : UNLIMITED;
        for (int c = 0; c < MAX_CORRECTIONS; ++c) {
            TRACK off = point.track - POTENTIALS(here);
            if (below(abs(off), ENOUGH)) break;
            x = CORRECTED(x, off, here, limit);
            here = EVALUATE(x);
            ++corrected;
        }
        velocity = VELOCITY(here);
#endif
        p = x;
    }
    point.place = p;
    point.left -= float(steps);
    return Tally(steps, 0u, 0u, 0u, corrected);
}
)glsl";

constexpr std::string_view kEnd = R"glsl(
void main() {
    if (gl_LocalInvocationIndex < COUNTS) sums[gl_LocalInvocationIndex] = 0u;
    barrier();
    uint i = gl_GlobalInvocationID.x;
    if (i < count) {
        Point point = pointAt(i);
        if (point.left > 0.0) {
            Tally tally = advance(point);
            keep(point, i);
            atomicAdd(sums[0], tally.substeps);
            atomicAdd(sums[1], tally.retries);
            atomicAdd(sums[2], tally.stalls);
            atomicAdd(sums[3], tally.coarse);
            atomicAdd(sums[4], tally.corrected);
            atomicAdd(sums[5], point.left > 0.0 ? 1u : 0u);
        }
    }
    barrier();
    if (gl_LocalInvocationIndex < COUNTS) atomicAdd(counts[gl_LocalInvocationIndex], sums[gl_LocalInvocationIndex]);
}
)glsl";

} // namespace

std::string moveText(const GpuMoveOptions& o) {
    const bool equally = o.steps > 0 && !o.guarded && o.maxStep == 0 && !tableauOf(o.scheme).embedded();
    return fmt::format("{}{}{}", kBegin, equally ? kAdvanceEqually : kAdvance, kEnd);
}

} // namespace curlew
