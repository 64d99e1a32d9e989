// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <optional>
#include <string>

namespace curlew::test {

/// Sets an environment variable for as long as it lives, for this process and those that it starts. Not while other
/// threads run.
class Variable {
  public:
    Variable(std::string name, const std::string& value) : mName(std::move(name)) {
        if (const char* before = std::getenv(mName.c_str())) mBefore = before;
        ::setenv(mName.c_str(), value.c_str(), 1);
    }
    ~Variable() {
        if (mBefore)
            ::setenv(mName.c_str(), mBefore->c_str(), 1);
        else
            ::unsetenv(mName.c_str());
    }
    Variable(const Variable&) = delete;
    Variable& operator=(const Variable&) = delete;

  private:
    std::string mName;
    std::optional<std::string> mBefore;
};

} // namespace curlew::test
