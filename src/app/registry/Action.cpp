// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/registry/Action.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace curlew::app {

namespace {

bool isField(Kind kind) { return kind == Kind::field || kind == Kind::noise || kind == Kind::shape; }
bool isGrid(Kind kind) { return kind == Kind::grid || kind == Kind::levelSet || kind == Kind::velocity; }

template <class T>
const T* named(const std::vector<T>& things, std::string_view name) {
    const auto found = std::find_if(things.begin(), things.end(), [&](const T& thing) { return thing.name == name; });
    return found == things.end() ? nullptr : &*found;
}

} // namespace

bool accepts(Kind wanted, Kind given) {
    return wanted == given || (wanted == Kind::field && isField(given)) || (wanted == Kind::grid && isGrid(given));
}

bool accepts(const std::vector<Kind>& wanted, Kind given) {
    return std::any_of(wanted.begin(), wanted.end(), [&](Kind kind) { return accepts(kind, given); });
}

const Option* Action::option(std::string_view optionName) const { return named(options, optionName); }
const Input* Action::input(std::string_view inputName) const { return named(takes, inputName); }

size_t Action::inputIndex(std::string_view inputName) const {
    const Input* found = input(inputName);
    if (!found) throw std::logic_error(fmt::format("action {} declares no input {}", name, inputName));
    return static_cast<size_t>(found - takes.data());
}

bool Action::changes(const Arguments& arguments) const {
    return varies || arguments.changes() || (variesWith && variesWith(arguments));
}

bool Action::advances(const Arguments& arguments) const { return inFrames == InFrames::each && !timeless(arguments); }

bool Action::timeless(const Arguments& arguments) const {
    return std::any_of(options.begin(), options.end(),
                       [&](const Option& o) { return o.timeless && arguments.given(o.name); });
}

bool Action::makesKind(Kind kind) const {
    return std::any_of(makes.begin(), makes.end(), [&](const Output& output) { return accepts(output.kinds, kind); });
}

} // namespace curlew::app
