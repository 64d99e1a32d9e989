// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/run/Console.h"
#include "support/Catch.h"
#include "support/Command.h"

#include <fcntl.h>

#include <thread>

using namespace curlew::app;
using Catch::Matchers::ContainsSubstring;

namespace {

/// Returns what `work` prints to standard error, which is a file here, not a terminal.
template <class Work>
std::string heard(const Work& work) {
    const curlew::test::Folder folder;
    const std::string file = (folder / "err").string();
    const int before = dup(STDERR_FILENO), into = open(file.c_str(), O_CREAT | O_WRONLY, 0600);
    dup2(into, STDERR_FILENO);
    work();
    std::fflush(stderr);
    dup2(before, STDERR_FILENO);
    close(before);
    close(into);
    return curlew::test::bytesOf(file);
}

} // namespace

TEST_CASE("Console: verbosity controls what is printed", "[app]") {
    const auto all = [](Console& console) {
        console.info("line");
        console.detail("detail");
        console.warn("trouble");
    };
    CHECK(heard([&] {
              Console console(nullptr);
              all(console);
          }) == "line\nwarning: trouble\n");
    CHECK(heard([&] {
              Console console(nullptr);
              console.setVerbosity(Verbosity::verbose);
              all(console);
          }) == "line\ndetail\nwarning: trouble\n");
    CHECK(heard([&] {
              Console console(nullptr);
              console.setVerbosity(Verbosity::quiet);
              all(console);
          }).empty());
}

TEST_CASE("Console: progress is shown after one second and at most every few seconds", "[app]") {
    Console console(nullptr), quiet(nullptr);
    quiet.setVerbosity(Verbosity::quiet);
    CHECK_FALSE(quiet.follow("work").report);
    CHECK(heard([&] {
              const auto monitor = console.follow("short work");
              for (const double fraction : {0.0, 0.5, 1.0}) monitor.report(fraction);
          }).empty());
    const std::string text = heard([&] {
        const auto monitor = console.follow("long work");
        std::this_thread::sleep_for(std::chrono::milliseconds(1010));
        monitor.report(0.25);
        monitor.report(0.26);
        monitor.report(1);
    });
    CHECK(curlew::test::linesIn(text) == 1);
    CHECK_THAT(text, ContainsSubstring("long work") && ContainsSubstring("25 %") && !ContainsSubstring("\x1b"));
}

TEST_CASE("Console: a listener receives all output instead of the standard streams", "[app]") {
    std::string said, printed;
    std::vector<double> fractions;
    bool stop = false;
    Console console(Listener{.info = [&](std::string_view line) { said += line; },
                             .print = [&](std::string_view text) { printed += text; },
                             .progress = [&](const Progress& now) { fractions.push_back(now.fraction); },
                             .cancelled = [&] { return stop; }});
    CHECK(heard([&] {
              console.info("a line");
              console.detail("a detail");
              console.print("a text");
              console.follow("work").report(0.5);
              console.setVerbosity(Verbosity::quiet);
              console.info("nothing");
              console.print(", another");
          }).empty());
    CHECK(said == "a line");
    CHECK(printed == "a text, another");
    CHECK(fractions == std::vector{0.5});
    CHECK_FALSE(console.follow("work").report);
    stop = true;
    CHECK(console.cancelled());
    Console deaf(Listener{});
    deaf.info("a line");
    deaf.print("a text");
    CHECK_FALSE(deaf.follow("work").report);
    CHECK_FALSE(deaf.cancelled());
}

TEST_CASE("Console: cancelled reports that the user has asked to stop", "[app]") {
    bool stop = false;
    Console console([&] { return stop; }), deaf(nullptr);
    const auto monitor = console.follow("work");
    CHECK_NOTHROW(monitor.check());
    CHECK_FALSE(console.cancelled());
    stop = true;
    CHECK(console.cancelled());
    CHECK_THROWS_AS(monitor.check(), curlew::Interrupted);
    CHECK_FALSE(deaf.cancelled());
    CHECK_NOTHROW(deaf.follow("work").check());
}
