// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/run/Context.h"
#include "curlew/render/SurfacePaint.h"

namespace curlew::app {

/// What says how a surface is coloured: color, show, texture, …, and how far a flow has carried the texture.
std::vector<Option> colorOptions();
/// The inputs that these options ask for: "value", a field, and "flow".
std::vector<Input> colorInputs();

/// A colour that an option gives; ValueError for a negative part.
Vec3f colorOption(const Arguments& a, std::string_view name);

/// What the options and inputs paint on a surface in this box.
SurfacePaint paintOf(const Context& c, const Arguments& a, const Box& box);

/// Whether a number is not 0 at every moment.
bool everNonzero(const Arguments& a, std::string_view name);

} // namespace curlew::app
