// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Text.h"
#include "support/Catch.h"

using namespace curlew;
using Words = std::vector<std::string>;

TEST_CASE("printable: valid UTF-8 without control characters passes through unchanged", "[base]") {
    for (const std::string text : {"", "plain text", "größer", "→ ∇f × ∇g", "\U0001F426", "a\\b"})
        CHECK(printable(text) == text);
}

TEST_CASE("printable: control characters are escaped", "[base]") {
    CHECK(printable("a\nb") == "a\\x0ab");
    CHECK(printable("\x1b[31mred\x7f") == "\\x1b[31mred\\x7f");
    CHECK(printable(std::string("\0", 1)) == "\\x00");
    CHECK(printable("\xc2\x9b") == "\\xc2\\x9b"); // C1 control: starts an escape sequence on some terminals
}

TEST_CASE("printable: bytes that are not UTF-8 are escaped one by one", "[base]") {
    CHECK(printable("caf\xe9.obj") == "caf\\xe9.obj");              // Latin-1
    CHECK(printable("\xc0\xaf") == "\\xc0\\xaf");                   // overlong
    CHECK(printable("\xed\xa0\x80") == "\\xed\\xa0\\x80");          // surrogate
    CHECK(printable("\xf4\x90\x80\x80") == "\\xf4\\x90\\x80\\x80"); // beyond U+10FFFF
    CHECK(printable("ab\xe2\x82") == "ab\\xe2\\x82");               // cut off
    CHECK(printable("\x80ok") == "\\x80ok");
}

TEST_CASE("nearest: finds the word with the fewest edits", "[base]") {
    const Words words{"frequency", "octaves", "offset", "seed", "mesh2ls"};
    CHECK(nearest("freqency", words) == "frequency");   // a missing letter
    CHECK(nearest("frequencyy", words) == "frequency"); // an additional letter
    CHECK(nearest("fraquency", words) == "frequency");  // a wrong letter
    CHECK(nearest("esed", words) == "seed");            // swapped letters
    CHECK(nearest("sed", words) == "seed");
    CHECK(nearest("MESH2LS", words) == "mesh2ls");
    CHECK(nearest("freq", words) == "frequency"); // an abbreviation
    CHECK(nearest("offset=", words) == "offset");
    CHECK(nearest("ofset", words) == "offset");
}

TEST_CASE("nearest: finds nothing if no word is close", "[base]") {
    const Words words{"frequency", "octaves", "seed"};
    for (const char* word : {"banana", "x", "", "qqqqqqqqq", "fr"}) {
        CAPTURE(word);
        CHECK(nearest(word, words).empty());
        CHECK(didYouMean(word, words).empty());
    }
    CHECK(nearest("seed", {}).empty());
    CHECK(didYouMean("sead", words) == " (did you mean 'seed'?)");
}
