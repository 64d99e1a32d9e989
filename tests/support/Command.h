// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "Catch.h"
#include "Files.h"
#include "Places.h"

#include <nlohmann/json.hpp>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string>

namespace curlew::test {

namespace fs = std::filesystem;

inline nlohmann::json jsonOf(const fs::path& path) { return nlohmann::json::parse(bytesOf(path)); }

inline size_t linesIn(const std::string& text) {
    return static_cast<size_t>(std::count(text.begin(), text.end(), '\n'));
}

/// How a command ended and what it said.
struct Outcome {
    int status = 0; ///< 128 + the signal where one has ended it, as shells say it.
    std::string out, err;
};

/// A fresh folder in which commands run, and which goes with its end. What they print is kept beside it, so that the
/// folder holds what they have written and nothing else.
class Folder {
  public:
    Folder() {
        static int count = 0;
        mPath = fs::temp_directory_path() / ("curlew_test_" + std::to_string(::getpid()) + "_" +
                                             std::to_string(count++) + "_áé'x y"); // names have to be taken as they are
        fs::create_directories(mPath / "in");
    }
    ~Folder() {
        std::error_code ignored;
        fs::remove_all(mPath, ignored);
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;

    fs::path operator/(const std::string& name) const { return mPath / "in" / name; }

    /// All that it holds, hidden files too.
    std::set<std::string> names() const {
        std::set<std::string> names;
        for (const auto& entry : fs::recursive_directory_iterator(mPath / "in"))
            names.insert(fs::relative(entry.path(), mPath / "in").string());
        return names;
    }

    /// Runs a line of the shell in the folder; `curlew` in it is the command under test.
    Outcome shell(const std::string& line) const {
        store(mPath / "line.sh",
              "curlew() { \"" + command() + "\" \"$@\"; }\ncurlew='" + command() + "'\ncd in\n" + line + "\n");
        const std::string enter = "cd \"" + mPath.string() + "\" && ";
        const int raw = std::system((enter + "exec /bin/sh line.sh >out 2>err </dev/null").c_str());
        Outcome outcome{.status = WIFEXITED(raw) ? WEXITSTATUS(raw) : 128 + WTERMSIG(raw),
                        .out = bytesOf(mPath / "out"),
                        .err = bytesOf(mPath / "err")};
        return outcome;
    }

    Outcome run(const std::string& arguments) const { return shell("curlew " + arguments); }

    /// The same, where nothing but success will do.
    Outcome mustRun(const std::string& arguments) const {
        Outcome outcome = run(arguments);
        CAPTURE(arguments, outcome.out, outcome.err);
        REQUIRE(outcome.status == 0);
        return outcome;
    }

    /// Bad input: the command fails with one line that holds each of `parts`, and leaves the folder as it was.
    void mustFail(const std::string& arguments, const std::vector<std::string>& parts, int status = 1) const {
        const auto before = names();
        const Outcome outcome = run("-quiet " + arguments);
        CAPTURE(arguments, outcome.out, outcome.err);
        CHECK(outcome.status == status);
        CHECK(outcome.out.empty());
        CHECK_THAT(outcome.err, Catch::StartsWith("curlew: ") && Catch::EndsWith("\n"));
        CHECK(linesIn(outcome.err) == 1);
        for (const auto& part : parts) CHECK_THAT(outcome.err, Catch::ContainsSubstring(part));
        CHECK(names() == before);
    }

  private:
    fs::path mPath;
};

} // namespace curlew::test
