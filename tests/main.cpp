// SPDX-License-Identifier: Apache-2.0
#define CATCH_CONFIG_RUNNER
#include "support/Catch.h"

#include <iostream>

namespace {

/// In version 2 of Catch and in version 3.
template <class Test>
std::string nameOf(const Test& test) {
    if constexpr (requires { test.name; })
        return test.name;
    else
        return test.getTestCaseInfo().name;
}

} // namespace

/// CMake keeps the names of tests in lists, where a bracket or semicolon makes many tests into one that never runs; and
/// names are arguments, where a dash begins an option.
int main(int argc, char* argv[]) {
    Catch::Session session;
    for (const auto& test : Catch::getAllTestCasesSorted(session.config())) {
        const std::string name = nameOf(test);
        if (!name.starts_with('-') && name.find_first_of("[];\"\\") == std::string::npos) continue;
        std::cerr << "the name of a test must not begin with a dash, nor contain brackets, semicolons, quotes or "
                     "backslashes: "
                  << name << '\n';
        return EXIT_FAILURE;
    }
    return session.run(argc, argv);
}
