// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Option.h"
#include "curlew/app/run/Context.h"
#include "curlew/track/Scatter.h"

namespace curlew::app {

/// The input `domain`: a flow, shape or level set; none if box= is given and there is no flow. With grid= a level set.
Input domainInput();

/// Where points are wanted: the domain of the input, within box= if that is given.
Domain scatterDomain(const Context& c, const Arguments& a);

/// The domain of an input: that of a flow, or the inside of a shape or level set.
Domain domainOfInput(const Context& c, std::string_view input);

/// Where points are put: the domain, and where in it.
struct Birthplace {
    Domain domain;
    ScatterOptions place; ///< Its seed is not set.
};

/// Where points on a surface lie by default: a little off the wall of a flow, on the flow's side, since the wall itself
/// belongs to neither; and of a shape or level set on it, or a little outside of it.
enum class OffSurface { flowsOnly, always };
Birthplace birthplaceOf(const Context& c, const Arguments& a, OffSurface off);

/// The options on= and offset=, and the input density=, that birthplaceOf() reads.
Option onOption();
Option offsetOption(const std::string& byDefault);
Input densityInput();

/// Gives new points.
inline void givePoints(Context& c, Points particles) {
    c.give(std::make_shared<PointSet>(PointSet{.particles = std::move(particles)}));
}

} // namespace curlew::app
