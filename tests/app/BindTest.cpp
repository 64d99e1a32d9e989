// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/registry/Action.h"
#include "curlew/app/registry/Bind.h"
#include "support/Catch.h"

using namespace curlew::app;

namespace {

enum class Side { left, right };
struct Inner {
    int count = 3;
    double exponent = 2;
};
struct Outer {
    double size = 0.25;
    Side side = Side::right;
    bool fast = true, closed = false;
    double longest = 0; ///< 0: chosen by the library.
    Inner inner = {};
};

Binding<Outer> binding(const Outer& defaults = {}) {
    using namespace options;
    const auto inner = Binding<Inner>(defaults.inner)
                           .add(
                               integer("count", "", 1, 9, "of them"), [](auto& o) -> auto& { return o.count; })
                           .add(
                               integer("exponent", "", 1, 9, "of it"), [](auto& o) -> auto& { return o.exponent; });
    return Binding<Outer>(defaults)
        .add(
            positive("size", "", "", "of it"), [](auto& o) -> auto& { return o.size; })
        .add(
            choice("side", {"left", "right"}, "of it"), [](auto& o) -> auto& { return o.side; })
        .add(
            flag("fast", "", "or slow"), [](auto& o) -> auto& { return o.fast; })
        .add(
            choice("ends", {"open", "closed"}, "of it"), [](auto& o) -> auto& { return o.closed; })
        .addOptional(
            positive("longest", "", "", "of it"), [](auto& o) -> auto& { return o.longest; })
        .include(
            inner, [](auto& o) -> auto& { return o.inner; });
}

Outer read(const std::vector<std::string>& tokens, const Outer& defaults = {}) {
    const auto bound = binding(defaults);
    const Action action{.name = "sample", .options = bound.options()};
    Arguments arguments(action);
    for (const auto& token : tokens) arguments.add(token);
    return bound.read(arguments);
}

} // namespace

TEST_CASE("Binding: an option's default is that of the struct member", "[app]") {
    const auto fallback = [](const Binding<Outer>& bound, const std::string& name) -> std::string {
        for (const Option& option : bound.options())
            if (option.name == name) return option.fallback;
        return "there is no option " + name;
    };
    CHECK(fallback(binding(), "size") == "0.25");
    CHECK(fallback(binding(), "side") == "right");
    CHECK(fallback(binding(), "fast") == "1");
    CHECK(fallback(binding(), "ends") == "open");
    CHECK(fallback(binding(), "longest").empty());
    CHECK(fallback(binding(), "count") == "3");
    CHECK(fallback(binding(), "exponent") == "2");
    CHECK(fallback(binding({.size = 1, .side = Side::left, .closed = true}), "side") == "left");
    CHECK(fallback(binding({.closed = true}), "ends") == "closed");
}

TEST_CASE("Binding: options fill the struct and its nested members", "[app]") {
    const Outer plain = read({});
    CHECK(plain.size == 0.25);
    CHECK(plain.side == Side::right);
    CHECK(plain.fast);
    CHECK_FALSE(plain.closed);
    CHECK(plain.longest == 0); // not given: left to the library
    CHECK(plain.inner.count == 3);
    const Outer given = read({"size=2", "side=left", "fast=0", "ends=closed", "longest=5", "count=7", "exponent=4"});
    CHECK(given.size == 2);
    CHECK(given.side == Side::left);
    CHECK_FALSE(given.fast);
    CHECK(given.closed);
    CHECK(given.longest == 5);
    CHECK(given.inner.count == 7);
    CHECK(given.inner.exponent == 4);
}
