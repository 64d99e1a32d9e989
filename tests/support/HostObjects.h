// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "Catch.h"
#include "Files.h"
#include "curlew/base/Error.h"
#include "curlew/track/Curves.h"
#include "curlew/track/Points.h"
#include "curlew/vdb/Openvdb.h"

#include <cstdlib>
#include <cstring>
#include <limits>
#include <sstream>
#include <string>

// Objects for tests of the files that hosts take. All numbers are representable as 16-bit floats.
namespace curlew::test {

inline Points particlesWithEverything(size_t count) {
    Points p;
    for (size_t n = 0; n < count; ++n) {
        const double t = static_cast<double>(n);
        p.x.push_back(t), p.y.push_back(0.5 * t), p.z.push_back(-t);
        p.vx.push_back(1), p.vy.push_back(static_cast<float>(t)), p.vz.push_back(-2);
        p.id.push_back(static_cast<int64_t>(3 * n) + 5);
        p.f.push_back(0.25 * t), p.g.push_back(-0.5);
        p.age.push_back(0.125f), p.fade.push_back(0.75f);
        p.life.push_back(n % 2 ? 2 : std::numeric_limits<float>::infinity());
    }
    return p;
}

/// Curves with `sizes` vertices each. Every other one is closed.
inline Curves curvesOfSizes(const std::vector<size_t>& sizes) {
    Curves c;
    for (const size_t size : sizes) {
        const size_t k = c.size();
        for (size_t v = 0; v < size; ++v) {
            const double t = static_cast<double>(c.x.size());
            c.along.push_back(0.25 * static_cast<double>(v));
            c.x.push_back(t), c.y.push_back(static_cast<double>(k)), c.z.push_back(-t);
            c.vx.push_back(static_cast<float>(t)), c.vy.push_back(1), c.vz.push_back(0.5f);
            c.f.push_back(t), c.g.push_back(2);
        }
        c.start.push_back(c.x.size());
        c.id.push_back(static_cast<int64_t>(100 - k));
        const auto end = k % 2 ? CurveEnd::closed : CurveEnd::limit;
        c.upstream.push_back(end), c.downstream.push_back(end);
        c.length.push_back(1), c.gap.push_back(0);
    }
    return c;
}

/// A velocity grid of 3 x 4 x 5 voxels of half a unit with the value (i, j, 10 k) at voxel i, j, k.
inline openvdb::Vec3SGrid::Ptr rampGrid(const std::string& name = "vel") {
    openvdb::initialize();
    auto grid = openvdb::Vec3SGrid::create();
    grid->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
    auto access = grid->getAccessor();
    for (int i = -1; i < 2; ++i)
        for (int j = 2; j < 6; ++j)
            for (int k = 7; k < 12; ++k)
                access.setValue({i, j, k}, openvdb::Vec3s(static_cast<float>(i), static_cast<float>(j),
                                                          10.0f * static_cast<float>(k)));
    grid->setName(name);
    grid->setVectorType(openvdb::VEC_CONTRAVARIANT_RELATIVE);
    return grid;
}

/// Reads a little-endian value.
template <class T>
T littleAt(const std::string& bytes, size_t offset) {
    T value;
    std::memcpy(&value, &bytes.at(offset), sizeof value);
    return value;
}

/// Runs a Python program with a module in a folder and returns what it prints; "" if Python or the module is missing.
inline std::string pythonWith(const std::string& module, const std::filesystem::path& folder,
                              const std::string& program) {
    const std::string python = "/usr/bin/python3";
    if (std::system((python + " -c 'import " + module + "' 2>/dev/null").c_str()) != 0) return "";
    store(folder / "run.py", program);
    const std::string out = (folder / "out.txt").string();
    const std::string line = "cd '" + folder.string() + "' && " + python + " run.py > out.txt 2>&1";
    const int status = std::system(line.c_str());
    const std::string printed = bytesOf(out);
    CAPTURE(printed);
    REQUIRE(status == 0);
    return printed;
}

/// The message of the error that a call throws.
template <class Call>
std::string messageOf(const Call& call) {
    try {
        call();
    } catch (const Error& error) {
        return error.what();
    }
    return "no error";
}

} // namespace curlew::test
