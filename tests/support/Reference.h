#pragma once

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

namespace curlew::test {

/// A file of tests/data, which is always there.
inline nlohmann::json ownData(const std::string& name) {
    std::ifstream file(std::filesystem::path(CURLEW_TEST_DATA) / name);
    REQUIRE(file);
    return nlohmann::json::parse(file);
}

/// A file of the reference values that lie beside a checkout on the machines of this project; elsewhere nothing.
inline std::optional<nlohmann::json> reference(const std::string& name) {
    const std::filesystem::path path = std::filesystem::path(CURLEW_SHARED_DIR) / "reference" / name;
    if (!std::filesystem::exists(path)) {
        WARN("skipped: there are no reference values " << path);
        return std::nullopt;
    }
    std::ifstream file(path);
    return nlohmann::json::parse(file);
}

} // namespace curlew::test
