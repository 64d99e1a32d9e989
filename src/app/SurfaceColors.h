#pragma once

#include "curlew/app/Action.h"
#include "curlew/render/SurfaceShading.h"

#include <functional>

namespace curlew::app {

/// What says how a surface is coloured: color, show, texture, …, and how far a flow has carried the texture.
std::vector<Option> colorOptions();

/// A colour that an option gives; ValueError for a negative part.
Vec3f colorOption(const Arguments& a, std::string_view name);

/// The colours of the hits of a view: one for all, or one for each.
using Painter = std::function<std::vector<Vec3f>(const SurfaceView&, const Monitor&)>;

/// The painter that the options ask for, for a surface in this box. What is missing for it fails here.
Painter painterOf(Session& s, const Arguments& a, const Box& box);

/// Whether it paints what a mirror reflects.
bool paintsFilm(const Arguments& a);

} // namespace curlew::app
