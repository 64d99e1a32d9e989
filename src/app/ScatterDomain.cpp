#include "ScatterDomain.h"

namespace curlew::app {

Domain scatterDomain(Session& s, const Arguments& a) {
    const auto inside = [](const Sdf& sdf) { return Domain::of({.sdf = sdf, .side = Side::inside}); };
    Domain domain;
    if (a.given("grid")) {
        domain = inside(s.levelSetSdf(a.ages("grid").front(), 0));
    } else if (!a.given("box") || !s.flows.empty()) {
        const auto field = s.newestField(true), grid = s.newestLevelSet();
        const uint64_t flow = s.flows.empty() ? 0 : s.flows.entry().made;
        const uint64_t shape = std::max(field ? s.fields.entry(*field).made : 0, grid ? s.grids.entry(*grid).made : 0);
        if (s.flows.empty() || flow < shape)
            domain = inside(s.newestSdf(0));
        else
            domain = s.flow().domain();
    }
    if (a.given("box")) domain.box = a.box("box");
    return domain;
}

} // namespace curlew::app
