// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/run/Context.h"
#include "curlew/render/SurfacePaint.h"

namespace curlew::app {

/// The options for the colours of a surface: color, show, texture, …, and how far a flow has carried the texture.
std::vector<Option> colorOptions();
/// The inputs that these options need: "value" (a field) and "flow".
std::vector<Input> colorInputs();

/// Returns the colour in an option. Throws ValueError if a component is negative.
Vec3f colorOption(const Arguments& a, std::string_view name);

/// Returns the paint that the options and inputs specify for a surface in this box.
SurfacePaint paintOf(const Context& c, const Arguments& a, const Box& box);

/// Returns whether a number is nonzero at some moment.
bool everNonzero(const Arguments& a, std::string_view name);

} // namespace curlew::app
