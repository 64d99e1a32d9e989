// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/registry/Action.h"
#include "curlew/app/registry/Text.h"
#include "curlew/base/Error.h"
#include "support/Catch.h"

#include <stdexcept>

using namespace curlew;
using namespace curlew::app;
using Catch::Matchers::ContainsSubstring;

namespace {

/// An action with one option of each type.
const Action& sample() {
    static const Action action{
        .name = "sample",
        .options = {{.name = "flag", .type = OptionType::flag, .fallback = "1"},
                    {.name = "count",
                     .type = OptionType::integer,
                     .fallback = "3",
                     .lower = 1,
                     .upper = 1e6,
                     .formerly = {"number"}},
                    {.name = "size", .type = OptionType::real, .fallback = "0.5", .lower = 0, .exclusive = true},
                    {.name = "slope", .type = OptionType::real, .fallback = "-2"},
                    {.name = "offset", .type = OptionType::vector, .fallback = "1,2,3"},
                    {.name = "box", .type = OptionType::box},
                    {.name = "scheme", .type = OptionType::choice, .fallback = "rk4", .choices = {"euler", "rk4"}},
                    {.name = "name", .type = OptionType::text, .fallback = "vel"},
                    {.name = "grid", .type = OptionType::ages},
                    {.name = "grids", .type = OptionType::text}},
        .positional = {"FILE …", 1, 2}};
    return action;
}

Arguments given(const std::vector<std::string>& tokens) {
    Arguments arguments(sample());
    for (const auto& token : tokens) arguments.add(token);
    return arguments;
}

std::string complaintAbout(const std::string& token) {
    try {
        given({token});
    } catch (const ValueError& e) {
        return e.what();
    }
    return "nothing was wrong with " + token;
}

} // namespace

TEST_CASE("Arguments: options that are not given have their defaults", "[app]") {
    const Arguments a = given({});
    CHECK(a.flag("flag"));
    CHECK(a.integer("count") == 3);
    CHECK(a.real("size") == 0.5);
    CHECK(a.vector("offset") == Vec3d{{1, 2, 3}});
    CHECK(a.text("scheme") == "rk4");
    CHECK(a.choice("scheme") == 1);
    CHECK(a.text("name") == "vel");
    CHECK(a.ages("grid").empty());
    CHECK(a.words().empty());
    CHECK_FALSE(a.given("count"));
}

TEST_CASE("Arguments: every option type is parsed", "[app]") {
    const Arguments a = given({"flag=0", "count=1e6", "size=1e-3", "slope=-.25", "offset=-1,0,2.5",
                               "box=-1,-2,-3,1,2,3", "scheme=euler", "name=a=b c", "grid=0,2", "x y.obj"});
    CHECK_FALSE(a.flag("flag"));
    CHECK(a.integer("count") == 1000000);
    CHECK(a.real("size") == 1e-3);
    CHECK(a.real("slope") == -0.25);
    CHECK(a.vector("offset") == Vec3d{{-1, 0, 2.5}});
    CHECK(a.box("box").lower == Vec3d{{-1, -2, -3}});
    CHECK(a.box("box").upper == Vec3d{{1, 2, 3}});
    CHECK(a.text("scheme") == "euler");
    CHECK(a.choice("scheme") == 0);
    CHECK(a.text("name") == "a=b c");
    CHECK(a.ages("grid") == std::vector<size_t>{0, 2});
    CHECK(a.words() == std::vector<std::string>{"x y.obj"});
    CHECK(a.given("count"));
    CHECK(given({"offset=4"}).vector("offset") == Vec3d{{4, 4, 4}});
    CHECK(given({"name="}).text("name").empty());
}

TEST_CASE("Arguments: an invalid value is refused with the valid choices", "[app]") {
    struct Case {
        std::string token, says;
    };
    const auto c = GENERATE(
        Case{"flag=2", "0 or 1"}, Case{"flag=yes", "0 or 1"}, Case{"flag=", "0 or 1"}, Case{"count=0", "at least 1"},
        Case{"count=1000001", "at most 1000000"}, Case{"count=1.5", "whole number"}, Case{"count=-1", "at least 1"},
        Case{"count=abc", "whole number"}, Case{"count=1,2", "whole number"}, Case{"count=9007199254740993", "whole"},
        Case{"size=0", "above 0"}, Case{"size=-1", "above 0"}, Case{"size=nan", "a number"},
        Case{"size=inf", "a number"}, Case{"size=1e999", "a number"}, Case{"size=", "a number"},
        Case{"slope=1e999", "a number"}, Case{"offset=1,2", "x,y,z"}, Case{"offset=1,2,3,4", "x,y,z"},
        Case{"offset=a,b,c", "x,y,z"}, Case{"offset=1,,3", "x,y,z"}, Case{"offset=1,2,inf", "x,y,z"},
        Case{"box=0,0,0,1,1", "xmin"}, Case{"box=1,0,0,0,1,1", "empty"}, Case{"box=0,0,0,1,1,0", "empty"},
        Case{"scheme=euller", "did you mean 'euler'"}, Case{"scheme=banana", "euler, rk4"},
        Case{"grid=-1", "positions on the stack"}, Case{"grid=1.5", "positions"}, Case{"grid=", "positions"},
        Case{"grid=a", "positions"}, Case{"grid=0,1e9", "positions"});
    CAPTURE(c.token);
    CHECK_THAT(complaintAbout(c.token), ContainsSubstring(c.token) && ContainsSubstring(c.says));
}

TEST_CASE("Arguments: a unique prefix of an option name is enough", "[app]") {
    CHECK(given({"c=7"}).integer("count") == 7);
    CHECK(given({"off=7"}).vector("offset")[0] == 7);
    CHECK(given({"grid=1"}).ages("grid").at(0) == 1); // an exact name, although another option begins with it
    CHECK_THAT(complaintAbout("s=1"), ContainsSubstring("'s' is ambiguous: size or slope or scheme"));
    CHECK_THAT(complaintAbout("gri=1"), ContainsSubstring("grid or grids"));
}

TEST_CASE("Arguments: a former name of an option still works", "[app]") {
    CHECK(given({"number=7"}).integer("count") == 7);
    CHECK_THROWS_WITH(given({"count=1", "number=2"}), ContainsSubstring("'count' is given twice"));
    CHECK_THAT(complaintAbout("numbe=1"), ContainsSubstring("has no option 'numbe'"));
    CHECK_THAT(complaintAbout("number=0"), ContainsSubstring("count=0 must be"));
}

TEST_CASE("Arguments: unknown and repeated options are errors", "[app]") {
    CHECK_THAT(complaintAbout("cuont=1"),
               ContainsSubstring("'cuont'") && ContainsSubstring("did you mean 'count'") && ContainsSubstring("slope"));
    CHECK_THAT(complaintAbout("banana=1"),
               ContainsSubstring("'banana'") && !ContainsSubstring("did you mean") && ContainsSubstring("./banana=1"));
    CHECK_THROWS_WITH(given({"count=1", "cou=2"}), ContainsSubstring("'count' is given twice"));
}

TEST_CASE("Arguments: an option without effect beside another one is an error", "[app]") {
    const Action action{.name = "move",
                        .options = {{.name = "steps", .type = OptionType::integer, .fallback = "1"},
                                    {.name = "dt", .type = OptionType::real, .instead = {"steps"}}}};
    const auto finish = [&](const std::vector<std::string>& tokens) {
        Arguments arguments(action);
        for (const auto& token : tokens) arguments.add(token);
        arguments.finish();
    };
    CHECK_NOTHROW(finish({"steps=2"}));
    CHECK_NOTHROW(finish({"dt=2"}));
    CHECK_THROWS_WITH(finish({"steps=2", "dt=2"}), ContainsSubstring("steps= has no effect if dt= is given"));
    CHECK_THROWS_WITH(finish({"dt=2", "steps=2"}), ContainsSubstring("steps= has no effect if dt= is given"));
}

TEST_CASE("Arguments: the number of words is checked", "[app]") {
    CHECK_THROWS_WITH(given({}).finish(), ContainsSubstring("needs FILE"));
    CHECK_NOTHROW(given({"a"}).finish());
    CHECK_THROWS_WITH(given({"a", "b", "c"}), ContainsSubstring("unexpected argument 'c'"));
    CHECK(given({"./a=b.obj"}).words() == std::vector<std::string>{"./a=b.obj"});
    Action wordless = sample();
    wordless.positional = {};
    CHECK_THROWS_WITH(Arguments(wordless).add("a.obj"),
                      ContainsSubstring("options only") && ContainsSubstring("a.obj"));
}

TEST_CASE("Arguments: reading an undeclared option is a logic error", "[app]") {
    const Arguments a = given({});
    CHECK_THROWS_AS(a.real("nothing"), std::logic_error);
    CHECK_THROWS_AS(a.real("count"), std::logic_error); // another type
}

TEST_CASE("Arguments: program writes a line that is parsed to the same arguments", "[app]") {
    const std::vector<std::string> tokens{"count=7", "name=it's \"a\" name#1\\", "my file.obj", "offset=1,2,3", ""};
    const Arguments a = given(tokens);
    auto words = wordsOf(a.program(false));
    CAPTURE(a.program());
    REQUIRE(!words.empty());
    CHECK(words.front() == "sample");
    CHECK(a.program() == "-" + a.program(false));
    words.erase(words.begin());
    const Arguments again = given(words);
    CHECK(again.words() == a.words());
    CHECK(again.text("name") == a.text("name"));
    CHECK(again.integer("count") == 7);
    CHECK_FALSE(again.given("size"));
    CHECK(again.program() == a.program());
}
