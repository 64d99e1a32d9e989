// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Memory.h"

#include <algorithm>
#include <fstream>
#include <limits>
#include <string>

namespace curlew {

namespace fs = std::filesystem;

namespace {

constexpr size_t kUnlimited = std::numeric_limits<size_t>::max();

/// Returns the number in a file; kUnlimited if the file does not exist or says "max".
size_t numberIn(const fs::path& file) {
    std::ifstream stream(file);
    size_t number = 0;
    return stream >> number ? number : kUnlimited;
}

/// Returns the number after a key in memory.stat; 0 if the key is missing.
size_t statistic(const fs::path& file, const std::string& wanted) {
    std::ifstream stream(file);
    std::string key;
    for (size_t number = 0; stream >> key >> number;)
        if (key == wanted) return number;
    return 0;
}

/// The file names of a control group version.
struct Files {
    const char *limit, *usage, *droppable;
};
constexpr Files kVersion1{"memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"};
constexpr Files kVersion2{"memory.max", "memory.current", "inactive_file"};

size_t leftIn(const fs::path& group, const Files& files) {
    const size_t limit = numberIn(group / files.limit), usage = numberIn(group / files.usage);
    if (limit == kUnlimited || usage == kUnlimited) return kUnlimited;
    const size_t held = usage - std::min(usage, statistic(group / "memory.stat", files.droppable));
    return limit - std::min(limit, held);
}

/// Returns the minimum memory left in a group and its parents. In a container, `path` may be the host's name of the
/// group, which does not exist here; the container's own group is then `mount`.
size_t leftUpwards(const fs::path& mount, const fs::path& path, const Files& files) {
    size_t left = kUnlimited;
    for (fs::path group = path.relative_path(); !group.empty(); group = group.parent_path())
        left = std::min(left, leftIn(mount / group, files));
    return std::min(left, leftIn(mount, files));
}

/// Returns whether a comma-separated list contains the word.
bool lists(const std::string& list, const std::string& word) {
    return ("," + list + ",").find("," + word + ",") != std::string::npos;
}

} // namespace

size_t controlGroupMemory(const fs::path& groups, const fs::path& root) {
    size_t left = kUnlimited;
    std::ifstream stream(groups);
    for (std::string line; std::getline(stream, line);) { // 4:memory,hugetlb:/a/b or 0::/a/b
        const size_t first = line.find(':'), second = line.find(':', first + 1);
        if (second == std::string::npos) continue;
        const std::string controllers = line.substr(first + 1, second - first - 1);
        const fs::path path = line.substr(second + 1);
        if (controllers.empty())
            left = std::min({left, leftUpwards(root, path, kVersion2), leftUpwards(root / "unified", path, kVersion2)});
        else if (lists(controllers, "memory"))
            left = std::min(left, leftUpwards(root / "memory", path, kVersion1));
    }
    return left;
}

} // namespace curlew
