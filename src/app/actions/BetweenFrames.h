// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/run/Context.h"
#include "curlew/vdb/GridTypes.h"

#include <list>

namespace curlew::app {

using Grids = std::vector<std::shared_ptr<const openvdb::GridBase>>;

/// The grids of an input in the frames around the moment. Their fraction `part` is that of GridValue.
struct FrameGrids {
    Grids earlier, later;
    double part = 1;
};

inline FrameGrids gridsAround(const Context& c, std::string_view input) {
    FrameGrids grids;
    for (size_t k = 0; k < c.count(input); ++k) {
        const GridValue& value = c.grid(input, k);
        grids.later.push_back(value.grid);
        grids.earlier.push_back(value.earlier ? value.earlier->grid : value.grid);
        if (value.earlier) grids.part = value.part;
    }
    return grids;
}

/// Returns blend(make(earlier grids), make(later grids), part) for a moment between frames; in a frame make(grids).
/// What was made of the grids of the last two frames is kept in the memory of the node, so that it is not made again at
/// every moment.
template <class Make, class Blend>
auto blendedInTime(Context& c, std::string_view input, const Make& make, const Blend& blend) {
    using Made = decltype(make(Grids()));
    using Known = std::list<std::pair<Grids, Made>>;
    const FrameGrids grids = gridsAround(c, input);
    auto known = std::static_pointer_cast<Known>(c.memory().object);
    if (!known) c.memory().object = known = std::make_shared<Known>();
    const auto madeOf = [&](const Grids& of) -> Made {
        for (const auto& [from, made] : *known)
            if (from == of) return made;
        known->emplace_back(of, make(of));
        if (known->size() > 2) known->pop_front();
        return known->back().second;
    };
    if (grids.part >= 1) return madeOf(grids.later);
    if (grids.part <= 0) return madeOf(grids.earlier);
    const Made from = madeOf(grids.earlier), to = madeOf(grids.later);
    return blend(from, to, grids.part);
}

} // namespace curlew::app
