#pragma once

#include "curlew/app/run/Context.h"

namespace curlew::app {

/// The input `domain`: a flow, shape or level set; none if box= is given and there is no flow. With grid= a level set.
Input domainInput();

/// Where points are wanted: the domain of the input, within box= if that is given.
Domain scatterDomain(const Context& c, const Arguments& a);

/// The domain of an input: that of a flow, or the inside of a shape or level set.
Domain domainOfInput(const Context& c, std::string_view input);

/// Gives new points.
inline void givePoints(Context& c, Points particles) {
    c.give(std::make_shared<PointSet>(PointSet{.particles = std::move(particles)}));
}

} // namespace curlew::app
