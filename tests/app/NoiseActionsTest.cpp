// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/field/Transforms.h"
#include "curlew/flow/Flow.h"
#include "support/ProbeCommand.h"

#include <numbers>

using namespace curlew;
using namespace curlew::test;
using Catch::Matchers::ContainsSubstring;

TEST_CASE("noise action: equals noiseField() for every type and option", "[app][command]") {
    const Folder folder;
    requireField(folder, "-noise seed=3 alpha=0.5 period=4,6,3 rotation=fast lattice=perlin",
                 noiseField<Psrd3>({.period = {{4, 6, 3}},
                                    .alpha = 0.5,
                                    .rotation = PsrdOptions::Rotation::fast,
                                    .grid = PsrdOptions::Grid::perlin,
                                    .seed = 3}));
    requireField(folder, "-noise dimensions=2 seed=3 alpha=0.5 period=4,6",
                 noiseField<Psrd2>({.period = {{4, 6}}, .alpha = 0.5, .seed = 3}));
    requireField(folder, "-noise type=value dimensions=1 period=7", noiseField<ValueNoise<1>>({.period = {{7}}}));
    requireField(folder, "-noise type=value dimensions=3 seed=9", noiseField<ValueNoise<3>>({.seed = 9}));
    requireField(folder, "-noise type=perlin dimensions=2 period=3", noiseField<PerlinNoise<2>>({.period = {{3, 3}}}));
    requireField(folder, "-noise type=perlin gradients=reference",
                 noiseField<PerlinNoise<3>>({.gradients = PerlinGradients::reference}));
    requireField(folder, "-noise type=gradient dimensions=2 seed=1", noiseField<GradientNoise<2>>({.seed = 1}));
    requireField(folder, "-noise type=simplex dimensions=5 power=3 seed=2",
                 noiseField<SimplexNoise<5>>({.power = 3, .seed = 2}));
    requireField(folder, "-noise type=simplex dimensions=7 kernel=corners",
                 noiseField<SimplexNoise<7>>({.kernel = SimplexKernel::corners}));
    requireField(folder, "-noise type=sine dimensions=4 waves=12 seed=5",
                 noiseField<SineNoise<4>>({.waves = 12, .seed = 5}));
    requireField(
        folder, "-noise dimensions=2 octaves=4 lacunarity=3 gain=0.4 frequency=1.5 amplitude=2 normalize=0",
        noiseField<Psrd2>(
            {}, {.frequency = 1.5, .octaves = 4, .lacunarity = 3, .gain = 0.4, .amplitude = 2, .normalize = false}));
    requireField(folder, "-noise octaves=3 billow=0.1 warp=-0.2",
                 noiseField<Psrd3>({}, {.octaves = 3, .billow = 0.1, .warp = -0.2}));
    requireField(folder, "-noise type=simplex dimensions=4 translate=1,2,3,4",
                 placed(noiseField<SimplexNoise<4>>(), PlacementN<4>{.offset = {{1, 2, 3, 4}}}));
    requireField(folder, "-noise dimensions=2 rotate=0,0,30",
                 placed(noiseField<Psrd2>(), PlacementN<2>{.rotate = {{0, 0, 30}}}));
}

TEST_CASE("noise action: time rotates gradients or slices one more dimension or moves the noise", "[app][command]") {
    const Folder folder;
    requireField(folder, "-noise alpha=0.2 time=0.3", noiseField<Psrd3>({.alpha = 0.2 + 0.3}));
    requireField(folder, "-noise alpha=0.2 time=0.3 octaves=3 octaveAlpha=1",
                 noiseField<Psrd3>({.alpha = 0.2 + 0.3}, {.octaves = 3, .octaveAlpha = 1}));
    // At frequency 2, half a second is half a cell of the last coordinate.
    requireField(folder, "-noise type=simplex dimensions=3 frequency=2 time=0.5",
                 lifted<3>(noiseField<SimplexNoise<4>>({}, {.frequency = 2}), {constantField(0.25)}));
    requireField(folder, "-noise dimensions=2 period=4,4 animate=slice time=0.5",
                 lifted<2>(noiseField<Psrd3>({.period = {{4, 4, 0}}}), {constantField<2>(0.5)}));
    requireField(folder, "-noise type=perlin dimensions=2 time=0.5",
                 placed(noiseField<PerlinNoise<2>>(), PlacementN<2>{.offset = {{0, -0.5}}}));
    // 257 cells are equivalent to 1, since the noise has a period of 256.
    requireField(folder, "-noise type=value frequency=2 time=128.5",
                 placed(noiseField<ValueNoise<3>>({}, {.frequency = 2}), Placement{.offset = {{0, 0, -0.5}}}));
}

TEST_CASE("noise action: loop= closes exactly and differs in the middle", "[app][command]") {
    const Folder folder;
    const std::string noise =
        GENERATE("-noise", "-noise dimensions=2 octaves=3 period=4 warp=0.2",
                 "-noise octaves=3 lacunarity=1.7 octaveAlpha=3", "-noise type=simplex",
                 "-noise type=simplex dimensions=5 frequency=2", "-noise type=perlin dimensions=2 period=3",
                 "-noise type=gradient period=5 seed=2", "-noise type=sine dimensions=3",
                 "-noise animate=offset period=4,6,3", "-noise type=value period=4 octaves=2 seed=1");
    const auto at = [&](double time) {
        const std::string actions = fmt::format("{} time={} loop=2.5", noise, time);
        if (noise.find("dimensions=2") != std::string::npos)
            return probed(folder, actions, randomPoints(cube<2>(2), 20, 3));
        if (noise.find("dimensions=5") != std::string::npos)
            return probed(folder, actions, randomPoints(cube<5>(2), 20, 3));
        return probed(folder, actions, randomPoints(cube(2), 20, 3));
    };
    CAPTURE(noise);
    const auto begin = at(0);
    CHECK(begin == at(2.5));
    CHECK(begin == at(-5));
    CHECK(begin != at(1));
    // The motion is smooth: a small step in time changes the noise little, also across the seam.
    const auto before = at(2.5 - 1e-6);
    double worst = 0;
    for (size_t k = 0; k < begin.size(); ++k) worst = std::max(worst, std::abs(begin[k][0] - before[k][0]));
    // Bound: alpha changes by at most 2 pi / 2.5 per second, 9 times as fast in the third octave, whose amplitude is
    // 1/7; or the noise moves by 6 cells. The first derivatives are below 6 times a frequency of at most 4.
    CHECK(worst < 1e-6 * 6 * 6 * 4);
    CHECK(worst > 0);
}

TEST_CASE("noise action: alpha is periodic with a full turn", "[app][command]") {
    const Folder folder;
    const auto points = randomPoints(cube(2), 50, 4);
    const auto begin = probed(folder, "-noise", points);
    const auto end = probed(folder, fmt::format("-noise time={:.17g}", 2 * std::numbers::pi), points);
    for (size_t k = 0; k < points.size(); ++k) REQUIRE(std::abs(begin[k][0] - end[k][0]) < 1e-14);
}

TEST_CASE("noise action: options that a type lacks are refused with those it has", "[app][command]") {
    const Folder folder;
    folder.mustFail("-noise type=value dimensions=4", {"-noise", "type=value", "1 to 3", "not 4"});
    folder.mustFail("-noise dimensions=1", {"type=psrd", "2 to 3"});
    folder.mustFail("-noise type=simplex dimensions=8", {"dimensions=8"});
    folder.mustFail("-noise type=simplex period=4", {"type=simplex", "'period'", "power, kernel"});
    folder.mustFail("-noise type=value alpha=1", {"type=value", "'alpha'"});
    folder.mustFail("-noise type=value octaveAlpha=1", {"type=value", "'octaveAlpha'"});
    folder.mustFail("-noise octaves=2 time=1 loop=2 octaveAlpha=1.5", {"loop", "octaveAlpha=1.5", "whole number"});
    folder.mustFail("-noise type=psrd waves=3", {"type=psrd", "'waves'"});
    folder.mustFail("-noise type=perlin dimensions=2 gradients=reference", {"reference", "3D"});
    folder.mustFail("-noise dimensions=2 lattice=perlin", {"lattice", "3D"});
    folder.mustFail("-noise type=simplex power=3 kernel=published", {"-noise", "power"});
    folder.mustFail("-noise type=simplex dimensions=4 translate=1,2,3", {"translate=1,2,3", "3 numbers", "4 axes"});
    folder.mustFail("-noise type=simplex dimensions=4 rotate=10,0,0", {"4 dimensions", "rotated"});
    folder.mustFail("-noise dimensions=2 rotate=10,0,0", {"2 dimensions", "0,0,degrees"});
    folder.mustFail("-noise loop=2", {"loop=", "time="});
    folder.mustFail("-noise animate=alpha", {"animate=", "time="});
    folder.mustFail("-noise time=1 loop=0", {"loop=0"});
    folder.mustFail("-noise type=value time=1 animate=alpha", {"type=value", "alpha", "psrd"});
    folder.mustFail("-noise type=value time=1 animate=slice", {"slice", "4 dimensions", "simplex"});
    folder.mustFail("-noise type=simplex dimensions=6 time=1 loop=2", {"slice", "loop=", "8 dimensions"});
    folder.mustFail("-noise type=gradient time=1 loop=2", {"loop", "period="});
    folder.mustFail("-noise billow=-1", {"billow=-1"});
    folder.mustFail("-noise period=2.5", {"period", "whole"});
    folder.mustFail("-noise period=4 octaves=2 lacunarity=2.5", {"lacunarity is a whole number"});
}
