// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/registry/Text.h"
#include "curlew/base/Error.h"
#include "support/Catch.h"

using namespace curlew;
using namespace curlew::app;
using Words = std::vector<std::string>;

TEST_CASE("wordsOf: splits a line as a shell does", "[app]") {
    CHECK(wordsOf("noise  frequency=2\tseed=1 \r") == Words{"noise", "frequency=2", "seed=1"});
    CHECK(wordsOf("read 'my file.obj' \"it's.obj\"") == Words{"read", "my file.obj", "it's.obj"});
    CHECK(wordsOf("a\"b c\"'d e'f") == Words{"ab cd ef"});
    CHECK(wordsOf("write '' \"\"") == Words{"write", "", ""});
    CHECK(wordsOf("noise # frequency=2") == Words{"noise"});
    CHECK(wordsOf("read a#1.obj '# no comment'") == Words{"read", "a#1.obj", "# no comment"});
    CHECK(wordsOf("") == Words{});
    CHECK(wordsOf("   # nothing") == Words{});
}

TEST_CASE("wordsOf: an unterminated quote is an error", "[app]") {
    CHECK_THROWS_AS(wordsOf("read 'a.obj"), ValueError);
    CHECK_THROWS_WITH(wordsOf("read \"a.obj'"), Catch::ContainsSubstring("\""));
}

TEST_CASE("split: keeps empty parts and join reverses it", "[app]") {
    CHECK(split("a,b,,c", ',') == Words{"a", "b", "", "c"});
    CHECK(split("", ',') == Words{""});
    CHECK(split(",", ',') == Words{"", ""});
    for (const char* text : {"", ",", "a", "a,b", ",a,,b,"}) CHECK(join(split(text, ','), ",") == text);
}

TEST_CASE("parseReal: accepts only complete finite numbers", "[app]") {
    const auto value = [](const std::string& text) {
        double number = 0;
        REQUIRE(parseReal(text, number));
        return number;
    };
    CHECK(value("1e6") == 1e6);
    CHECK(value("-.5") == -0.5);
    CHECK(value("+2.50") == 2.5);
    CHECK(value("0.1") == 0.1);
    CHECK(value("1.7976931348623157e308") == std::numeric_limits<double>::max());
    double ignored = 0;
    for (const char* text :
         {"",    " ",    "1 ",       " 1",    "1,0",    "1.0.0", "0x10", "1e",    "e5",  "--1", "nan",
          "inf", "-inf", "infinity", "1e999", "-1e999", "1f",    "one",  "1_000", "+-1", "++1"}) {
        CAPTURE(text);
        CHECK_FALSE(parseReal(text, ignored));
    }
}

TEST_CASE("wrapped: breaks at spaces only", "[app]") {
    CHECK(wrapped("one two three four", 2, 11) == "  one two\n  three\n  four");
    CHECK(wrapped("one two", 0, 7) == "one two");
    CHECK(wrapped("incomprehensibilities", 2, 5) == "  incomprehensibilities");
    CHECK(wrapped("", 3, 10) == "   ");
}
