// SPDX-License-Identifier: Apache-2.0
#include "Missing.h"

#include "curlew/app/language/Graph.h"
#include "curlew/app/registry/Text.h"

#include <fmt/format.h>

#include <algorithm>

namespace curlew::app {

namespace {

/// Returns a hint about the actions that make objects of these kinds.
std::string hintFor(const std::vector<Kind>& kinds) {
    const auto actionsFor = [](Kind kind) {
        switch (kind) {
            case Kind::field:
            case Kind::noise:
                return "-noise, -ramp or a shape";
            case Kind::shape:
                return "-sphere, -box, …";
            case Kind::flow:
                return "-dfvn, -curl, …";
            case Kind::levelSet:
                return "-mesh2ls, or -read one";
            case Kind::grid:
            case Kind::velocity:
                return "-velocity or -mesh2ls, or -read one";
            case Kind::mesh:
                return "-ls2mesh, or -read one";
            case Kind::points:
                return "-scatter, or -read a .vdb that has them";
            case Kind::curves:
                return "-trace";
            case Kind::image:
                return "-slice, -lic, …, or -read one";
            default:
                return "other actions";
        }
    };
    std::vector<std::string> hints;
    for (const Kind kind : kinds)
        if (const std::string hint = actionsFor(kind); std::find(hints.begin(), hints.end(), hint) == hints.end())
            hints.push_back(hint);
    return join(hints, "; or ");
}

} // namespace

std::string missing(const Input& input, size_t wanted, size_t found, size_t others, bool grids) {
    const std::string what = phraseOf(input.kinds), note = input.help.empty() ? "" : fmt::format(" ({})", input.help);
    const bool levelSet = std::find(input.kinds.begin(), input.kinds.end(), Kind::levelSet) != input.kinds.end();
    if (wanted == 1 && others == 0)
        return fmt::format("needs {} for {}={}, but there is none; make one with {}{}", what, input.name, note,
                           hintFor(input.kinds),
                           levelSet && grids ? ". There are grids, but their class is not 'level set': -field -mesh "
                                               "-mesh2ls makes one of the surface where a grid has the value iso="
                                             : "");
    if (wanted == 1)
        return fmt::format("needs {} for {}={} as well, but there {} only {}; make another with {}", what, input.name,
                           note, others == 1 ? "is" : "are", others == 1 ? "one" : std::to_string(others),
                           hintFor(input.kinds));
    return fmt::format("needs {} objects for {}= ({} each{}), but there {} {}; make them with {}", wanted, input.name,
                       what, input.help.empty() ? "" : "; " + input.help, found == 1 ? "is" : "are",
                       found == 0 ? "none" : std::to_string(found), hintFor(input.kinds));
}

} // namespace curlew::app
