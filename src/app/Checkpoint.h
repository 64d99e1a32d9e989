#pragma once

#include "curlew/app/Session.h"

#include <filesystem>
#include <optional>

namespace curlew::app {

/// 64 bits of a text, for telling programs apart.
uint64_t digestOf(std::string_view text);

/// Writes what the next frame needs to know of those before it, bit by bit: all points, what -emit remembers, and the
/// frame of the session's clock. Throws FileError as writeAtomically.
void writeCheckpoint(const std::filesystem::path& path, uint64_t program, const Session& session);

/// Puts the session into the state that was written, and returns the frame after which that was; nothing where there is
/// no such file. Throws FileError for a file that is damaged, or no checkpoint, or of another program.
std::optional<int> restoreCheckpoint(const std::filesystem::path& path, uint64_t program, Session& session);

} // namespace curlew::app
