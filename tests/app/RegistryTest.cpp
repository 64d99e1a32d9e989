#include "curlew/app/Program.h"
#include "curlew/app/Registry.h"
#include "curlew/app/Text.h"

#include <catch2/catch.hpp>

#include <regex>
#include <set>

using namespace curlew;
using namespace curlew::app;
using Catch::Matchers::Contains;

TEST_CASE("every action is declared in full, once", "[app]") {
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
        CHECK(&findAction(action.name) == &action);
        CHECK(action.inputs.empty() == action.takes.empty()); // for the reader, and for programs
        CHECK(action.outputs.empty() == action.makes.empty());
    }
    // The names that the design fixes and this version has.
    for (const char* name :
         {"read",  "write", "sphere",  "box",     "torus", "capsule",  "plane",   "gyroid",  "mesh2ls", "noise",
          "ramp",  "sum",   "product", "bound",   "dfvn",  "velocity", "scatter", "advect",  "probe",   "check",
          "slice", "print", "help",    "version", "list",  "quiet",    "verbose", "threads", "trace",   "jitter"})
        CHECK(names.contains(name));
}

TEST_CASE("the actions of a group follow each other", "[app]") {
    std::set<std::string> done;
    std::string group;
    for (const auto& action : registry()) {
        if (action.group == group) continue;
        CAPTURE(action.name, action.group);
        CHECK(done.insert(action.group).second);
        group = action.group;
    }
}

TEST_CASE("every option has help, and a default that it would accept", "[app]") {
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

TEST_CASE("an option's whole name is never ambiguous, and its first letters hardly ever", "[app]") {
    for (const auto& action : registry())
        for (const auto& option : action.options)
            for (const auto& other : action.options) {
                CAPTURE(action.name, option.name, other.name);
                if (&option == &other) continue;
                // A name that begins another would make every beginning of that one ambiguous or wrong.
                CHECK_FALSE(other.name.starts_with(option.name));
                // Both of these are the names of the field: where a noise is put, and psrdnoise's way of turning
                // gradients.
                const std::set<std::string> pair{option.name, other.name};
                if (pair == std::set<std::string>{"rotate", "rotation"}) continue;
                CHECK(option.name.substr(0, 4) != other.name.substr(0, 4));
            }
}

TEST_CASE("every example is a program", "[app]") {
    size_t examples = 0;
    for (const auto& action : registry())
        for (const auto& example : action.examples) {
            CAPTURE(action.name, example);
            auto words = wordsOf(example);
            REQUIRE(words.front() == "curlew");
            words.erase(words.begin());
            std::erase(words, "-config"); // the scene would be looked for from the folder in which the tests run
            std::erase(words, "scenes/demo.txt");
            CHECK_NOTHROW(parseCommandLine(words));
            CHECK_THAT(example, Contains("-" + action.name));
            ++examples;
        }
    CHECK(examples > 15);
}

TEST_CASE("help tells all that is declared", "[app]") {
    const std::string table = helpTable(), overview = helpOverview();
    for (const auto& action : registry()) {
        CAPTURE(action.name);
        CHECK_THAT(table, Contains("| `-" + action.name + "` | " + action.summary + " |"));
        CHECK_THAT(overview, Contains("  -" + action.name + " ") && Contains(action.summary) && Contains(action.group));
        const std::string help = helpFor(action);
        CHECK_THAT(help, Catch::StartsWith("-" + action.name) && Contains(action.summary));
        for (const auto& option : action.options) {
            CHECK_THAT(help, Contains("\n  " + option.name + "="));
            const std::string unwrapped = std::regex_replace(help, std::regex("\n      "), " ");
            CHECK_THAT(unwrapped, Contains(option.help));
            if (!option.fallback.empty()) CHECK_THAT(unwrapped, Contains("(default " + option.fallback + ")"));
            CHECK_THAT(table, Contains(option.name + "="));
            for (const auto& choice : option.choices) CHECK_THAT(help, Contains(choice));
        }
        for (const auto& example : action.examples) CHECK_THAT(help, Contains(example));
    }
}

TEST_CASE("an unknown action is an error that knows a better name", "[app]") {
    CHECK_THROWS_WITH(findAction("nosie"), Contains("'-nosie'") && Contains("did you mean 'noise'"));
    CHECK_THROWS_WITH(findAction("Mesh2LS"), Contains("did you mean 'mesh2ls'"));
    CHECK_THROWS_WITH(findAction("teapot"), Contains("teapot") && !Contains("did you mean"));
    CHECK_THROWS_WITH(findAction(""), Contains("''") || Contains("'-'"));
}
