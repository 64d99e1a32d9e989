// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/actions/Actions.h"
#include "curlew/app/language/Program.h"
#include "curlew/app/registry/Registry.h"
#include "curlew/app/registry/Text.h"
#include "support/Catch.h"
#include "support/Files.h"

#include <algorithm>
#include <fstream>
#include <map>
#include <set>

using namespace curlew;
using namespace curlew::app;
using Catch::Matchers::ContainsSubstring;

TEST_CASE("registry: every action is fully declared and unique", "[app]") {
    std::set<std::string> names;
    for (const auto& action : registry()) {
        CAPTURE(action.name);
        CHECK(names.insert(action.name).second);
        CHECK(
            std::all_of(action.name.begin(), action.name.end(), [](unsigned char c) { return std::isalnum(c) != 0; }));
        CHECK(!action.group.empty());
        CHECK(!action.summary.empty());
        CHECK(action.run);
        CHECK(action.positional.minimum <= action.positional.maximum);
        CHECK(action.positional.what.empty() == (action.positional.maximum == 0));
        CHECK(&findAction(registry(), action.name) == &action);
    }
}

TEST_CASE("registry: -help shows each group once", "[app]") {
    std::set<std::string> done;
    std::string group;
    for (const auto& action : registry()) {
        if (action.group == group) continue;
        CAPTURE(action.name, action.group);
        CHECK(done.insert(action.group).second);
        group = action.group;
    }
}

TEST_CASE("registry: every option has help and a valid default", "[app]") {
    for (const auto& action : registry()) {
        std::set<std::string> names;
        for (const auto& option : action.options) {
            CAPTURE(action.name, option.name, option.fallback);
            CHECK(names.insert(option.name).second);
            CHECK(!option.help.empty());
            CHECK(std::all_of(option.name.begin(), option.name.end(),
                              [](unsigned char c) { return std::isalnum(c) != 0; }));
            CHECK((option.type == OptionType::choice) == !option.choices.empty());
            Arguments arguments(action);
            if (!option.fallback.empty()) CHECK_NOTHROW(arguments.add(option.name + "=" + option.fallback));
        }
    }
}

TEST_CASE("registry: inputs and outputs of every action are fully declared", "[app]") {
    for (const auto& action : registry()) {
        CAPTURE(action.name);
        CHECK(inputsOf(action).empty() == action.takes.empty());
        CHECK(outputsOf(action).empty() == action.makes.empty());
        const auto declared = [&](const std::string& name, OptionType type) {
            const Option* option = action.option(name);
            return name.empty() || (option && option->type == type);
        };
        std::set<std::string> names;
        bool takesAway = false, changes = false;
        for (const Input& input : action.takes) {
            CAPTURE(input.name);
            CHECK(names.insert(input.name).second);
            CHECK_THAT(inputsOf(action), ContainsSubstring(input.name + ": "));
            CHECK(!input.kinds.empty());
            CHECK(input.amount.min <= input.amount.max);
            CHECK(declared(input.age, OptionType::ages));
            takesAway = takesAway || input.use == Use::taken;
            changes = changes || input.use == Use::changed;
            if (input.use == Use::changed)
                CHECK(std::any_of(action.makes.begin(), action.makes.end(),
                                  [&](const Output& output) { return output.kinds == input.kinds; }));
            // INPUT=NAME must not be mistaken for an option, and as= not for an input.
            CHECK(input.name != "as");
            const Option* same = action.option(input.name);
            CHECK((!same || same->type == OptionType::ages));
        }
        CHECK((!takesAway || action.option("keep")));
        CHECK((takesAway || changes || !action.option("keep")));
        CHECK_FALSE(action.option("as"));
        names.clear();
        for (const Output& output : action.makes) {
            CAPTURE(output.name);
            CHECK(names.insert(output.name).second);
            CHECK(!output.kinds.empty());
            CHECK(declared(output.flag, OptionType::flag));
            CHECK((output.amount.min == 0) <= (output.amount.max > 1 || !output.flag.empty()));
        }
        for (const Option& option : action.options)
            for (const std::string& other : option.instead) {
                CAPTURE(option.name, other);
                CHECK(action.option(other));
            }
        for (const Option& option : action.options)
            for (const std::string& condition : option.onlyWith) {
                CAPTURE(option.name, condition);
                if (condition.starts_with('.')) {
                    CHECK(action.details.find(condition) != std::string::npos); // a format
                    continue;
                }
                const size_t equals = condition.find('=');
                const Option* other = action.option(condition.substr(0, equals));
                REQUIRE(other);
                REQUIRE(equals != std::string::npos);
                const std::string wanted = condition.substr(equals + 1);
                if (!wanted.empty()) CHECK(std::count(other->choices.begin(), other->choices.end(), wanted) == 1);
            }
    }
}

TEST_CASE("registry: an input of variable number says when it is taken", "[app]") {
    for (const auto& action : registry())
        for (const Input& input : action.takes) {
            CAPTURE(action.name, input.name, input.help);
            const bool one = input.amount.min == 1 && input.amount.max == 1;
            CHECK((one || !input.help.empty()));
        }
}

TEST_CASE("registry: no option name is a prefix of another and first letters differ", "[app]") {
    for (const auto& action : registry())
        for (const auto& option : action.options)
            for (const auto& other : action.options) {
                CAPTURE(action.name, option.name, other.name);
                if (&option == &other) continue;
                // If one name began another, each abbreviation of the longer one would be ambiguous or wrong.
                CHECK_FALSE(other.name.starts_with(option.name));
                // Exceptions, since these names are established: the placement of a noise and psrdnoise's rotation of
                // gradients; the number of octaves and the rotation of each octave; two limits of a step.
                const std::set<std::string> pair{option.name, other.name};
                if (pair == std::set<std::string>{"rotate", "rotation"}) continue;
                if (pair == std::set<std::string>{"octaves", "octaveAlpha"}) continue;
                if (pair == std::set<std::string>{"maxStep", "maxSubdivisions"}) continue;
                CHECK(option.name.substr(0, 4) != other.name.substr(0, 4));
            }
}

namespace {

/// Returns a value that the option accepts.
std::string valueFor(const Option& option) {
    if (!option.fallback.empty()) return option.fallback;
    switch (option.type) {
        case OptionType::vector:
            return "1,2,3";
        case OptionType::interval:
            return "1,2";
        case OptionType::box:
            return "-1,-1,-1,1,1,1";
        default:
            return "2";
    }
}

/// Returns an action with one option, as it is written after parsing.
std::string written(const Action& action, const std::string& name, const std::string& value) {
    Arguments arguments(action);
    arguments.set(name, value);
    return arguments.program();
}

} // namespace

TEST_CASE("registry: every former name of an option means the option", "[app]") {
    size_t names = 0;
    for (const auto& action : registry())
        for (const auto& option : action.options)
            for (const auto& former : option.formerly) {
                CAPTURE(action.name, option.name, former);
                const std::string value = valueFor(option);
                CHECK(written(action, former, value) == written(action, option.name, value));
                CHECK_THAT(written(action, former, value), ContainsSubstring(" " + option.name + "="));
                CHECK_THAT(helpFor(action), !ContainsSubstring("\n  " + former + "="));
                ++names;
            }
    CHECK(names >= 60); // the names that 0.2.0 changed
}

TEST_CASE("registry: all current and former names within an action are different", "[app]") {
    for (const auto& action : registry()) {
        std::set<std::string> names{"as"};
        for (const auto& option : action.options) names.insert(option.name);
        for (const auto& input : action.takes) names.insert(input.name);
        for (const auto& option : action.options)
            for (const auto& former : option.formerly) {
                CAPTURE(action.name, option.name, former);
                CHECK(names.insert(former).second);
            }
    }
}

TEST_CASE("registry: an option name has one type and one unit in all actions", "[app]") {
    // A jittered lattice is measured in its spacings, a fade between fields in their unit.
    const std::set<std::string> exceptions{"jitter frequency", "jitter layer",  "jitter amount",
                                           "min smoothing",    "max smoothing", "noise amplitude"};
    const auto typeOf = [](const Option& option) {
        return option.type == OptionType::length        ? OptionType::real
               : option.type == OptionType::coordinates ? OptionType::vector
                                                        : option.type;
    };
    std::map<std::string, const Option*> first;
    for (const auto& action : registry())
        for (const auto& option : action.options) {
            CAPTURE(action.name, option.name);
            if (exceptions.contains(action.name + " " + option.name)) continue;
            const Option& same = *first.emplace(option.name, &option).first->second;
            if (option.name != "scale") CHECK(typeOf(option) == typeOf(same)); // along each axis, or along all alike
            CHECK(option.unit == same.unit);
        }
}

TEST_CASE("registry: every example is a valid program", "[app]") {
    // Stands for scenes/demo.txt, since the tests may run in any folder.
    const curlew::test::ScratchFolder folder;
    const std::string scene = (folder / "demo.txt").string();
    std::ofstream(scene) << "set scale=1\nnoise frequency={scale}\n";
    size_t examples = 0;
    for (const auto& action : registry())
        for (const auto& example : action.examples) {
            CAPTURE(action.name, example);
            auto words = wordsOf(example);
            REQUIRE(words.front() == "curlew");
            words.erase(words.begin());
            std::ranges::replace(words, "scenes/demo.txt", scene);
            CHECK_NOTHROW(graphOfCommandLine(words, {.registry = registry(), .world = {.lenient = true}}));
            CHECK_THAT(example, ContainsSubstring("-" + action.name));
            ++examples;
        }
    CHECK(examples > 15);
}

TEST_CASE("findAction: an unknown action is an error with a suggestion", "[app]") {
    CHECK_THROWS_WITH(findAction(registry(), "nosie"),
                      ContainsSubstring("'-nosie'") && ContainsSubstring("did you mean 'noise'"));
    CHECK_THROWS_WITH(findAction(registry(), "Mesh2LS"), ContainsSubstring("did you mean 'mesh2ls'"));
    CHECK_THROWS_WITH(findAction(registry(), "teapot"),
                      ContainsSubstring("teapot") && !ContainsSubstring("did you mean"));
    CHECK_THROWS_WITH(findAction(registry(), ""), ContainsSubstring("''") || ContainsSubstring("'-'"));
}
