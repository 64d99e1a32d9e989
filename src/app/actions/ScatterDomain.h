// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Option.h"
#include "curlew/app/run/Context.h"
#include "curlew/track/Scatter.h"

namespace curlew::app {

/// Declares the input `domain`: a flow, shape or level set; none if box= is given and there is no flow. With grid=, a
/// level set.
Input domainInput();

/// Whether points fill a box, so that they need no domain.
bool fillsBox(const Arguments& a);

/// Returns the domain for points: that of the input, restricted to box= if it is given.
Domain scatterDomain(const Context& c, const Arguments& a);

/// Returns the domain of a flow, or the inside of a shape or level set.
Domain domainOfInput(const Context& c, std::string_view input);

/// The domain in which points are created, and how they are placed in it.
struct Birthplace {
    Domain domain;
    ScatterOptions place; ///< Its seed is not set.
};

/// Where points on a surface lie by default. For a flow, they lie slightly off the wall on the flow's side, since the
/// wall itself belongs to neither side. For a shape or level set, they lie on the surface (flowsOnly) or slightly
/// outside (always).
enum class OffSurface { flowsOnly, always };
Birthplace birthplaceOf(const Context& c, const Arguments& a, OffSurface off);

/// The options on= and offset=, and the input density=, which birthplaceOf() reads.
Option onOption();
Option offsetOption(const std::string& byDefault);
Input densityInput();

/// Outputs new points.
inline void givePoints(Context& c, Points particles) {
    c.give(std::make_shared<PointSet>(PointSet{.particles = std::move(particles)}));
}

} // namespace curlew::app
